"""Robots in a batch against MuJoCo, from the same starts with the same controls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.seeding import generator, training_episodes
from exneat_cli.tasks import FAILED, RUNNING, RobotTask
from exneat_cli.tasks.task import Simulation

wp = pytest.importorskip("warp", reason="needs exneat[gpu]")

WORLDS, STEPS = 16, 20
PERIOD = 0.01
"""One physics step: what differs in the last bits grows a hundredfold within 20 longer steps."""


def drawn(task: RobotTask, scale: float) -> list[Simulation]:
    """One world on the CPU for each episode."""
    simulations = [task.open_disturbed(training=True, reset_scale=scale) for _ in range(WORLDS)]
    for simulation, seeds in zip(simulations, training_episodes(1, 0, WORLDS), strict=True):
        simulation.reset(simulation.world, generator(seeds.world))
    return simulations


def steps_on_the_cpu(task: RobotTask, simulation: Simulation, actions: np.ndarray) -> list[tuple[np.ndarray, ...]]:
    """What is sensed before each step until the episode ends, the terms of the step, and how it stands then."""
    readings, sensed, terms = np.zeros(task.observation_size), np.zeros(task.sensed_size), np.zeros(4)
    done, status = [], RUNNING
    for action in actions.copy():
        if status == RUNNING:
            simulation.observe(simulation.world, readings)
            (simulation.sense or (lambda _, a, b: np.copyto(b, a)))(simulation.world, readings, sensed)
            if simulation.drive:
                simulation.drive(simulation.world, action)
            status = simulation.step(simulation.world, action, terms)
            done.append((sensed.copy(), terms.copy(), status))
    return done


@pytest.mark.parametrize(("model", "frame"), [("ant", "world"), ("ant", "part"), ("hexapod", "part")])
def test_worlds_on_warp_go_the_way_of_mujoco(model: str, frame: str) -> None:
    scale = {"hexapod": 0.1}.get(model, 0.25)
    common = {"control_period": PERIOD, "patience": 18, "progress": 0.02}
    task = RobotTask(model=model, frame=frame, contact_forces=True, **common)
    rng = np.random.default_rng(5)
    actions = rng.uniform(-1.0, 1.0, (STEPS, WORLDS, len(task.actuator_names)))
    actions[7, 3] = np.nan
    expected = [steps_on_the_cpu(task, simulation, actions[:, w]) for w, simulation in enumerate(drawn(task, scale))]
    worlds = task.open_batch(WORLDS, "cpu", training=True, reset_scale=scale, room=1)
    flag = wp.zeros(1, dtype=int)
    # Contacts are stiff: their forces change with the last bits of positions.
    largest = np.array([1e-3 if "contact" in name else 1e-4 for name in task.sensor_names])
    worlds.begins.assign(np.arange(WORLDS, dtype=np.int32))
    worlds.status.fill_(RUNNING)
    worlds.reset(wp.array(worlds.starts(training_episodes(1, 0, WORLDS))))
    worlds.begins.fill_(-1)
    readings = wp.zeros((WORLDS, task.observation_size), dtype=float)
    sensed = wp.zeros((WORLDS, task.sensed_size), dtype=float) if worlds.is_framed else readings
    for step in range(STEPS):
        worlds.observe(readings)
        worlds.sense(readings, sensed)
        felt = sensed.numpy().copy()
        worlds.drive(wp.array(actions[step].astype(np.float32)))
        worlds.step()
        terms, status = worlds.terms.numpy(), worlds.status.numpy()
        for w, steps in enumerate(expected):
            if step < len(steps):
                difference = np.abs(felt[w] - steps[step][0])
                np.testing.assert_array_less(difference, largest * (1.0 + np.abs(steps[step][0])))
                assert status[w] == steps[step][2]
                if status[w] != FAILED:
                    np.testing.assert_allclose(terms[w], steps[step][1], rtol=1e-4, atol=1e-4)
    worlds.note_overflows(flag)
    assert not flag.numpy()[0]
    assert status[3] == FAILED
    assert len({len(steps) for steps in expected}) > 2, "expected episodes of several lengths"
    if model == "ant":
        assert worlds.force.numpy().any(), "expected contacts"


def test_a_model_that_warp_cannot_simulate_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "tied.xml"
    path.write_text(
        """<mujoco><worldbody><body name="trunk"><freejoint/><geom size="0.1"/>
        <body name="leg"><joint name="hip"/><geom size="0.1"/></body></body></worldbody>
        <equality><joint joint1="hip"/></equality>
        <actuator><motor joint="hip"/></actuator></mujoco>"""
    )
    with pytest.raises(ConfigError, match=r"task\.model.*executor=warp"):
        RobotTask(model=str(path)).open_batch(2, "cpu", training=True, reset_scale=None, room=1)
