"""Networks on Warp against the kernel of the CPU."""

from __future__ import annotations

import numpy as np
import pytest

from exneat_cli.algorithms import RECURRENT, EvolutionSettings, from_stock
from exneat_cli.brains import Brains, assemble
from exneat_cli.brains.brain import lay_out, memory_size
from exneat_cli.tasks import AntTask, RobotTask, Task
from exneat_cli.wiring import Geometry, Wiring, plan_body, plan_modules
from tests.brains.teams import actions_of, busy, random_team

wp = pytest.importorskip("warp", reason="needs exneat[gpu]")

STEPS, TEAMS = 100, 6
FEED_FORWARD = busy(EvolutionSettings(), weight_init_stdev=0.2)


def actions_on_warp(brains: Brains, sensed: np.ndarray) -> np.ndarray:
    """(brains, steps, A) what all of them do from their starts on, given (steps, sensed size)."""
    from exneat_cli.brains.batch import activate, packed

    count = len(brains.size)
    with wp.ScopedDevice("cpu"):
        programs = wp.array(packed(brains)[np.newaxis])
        memory = wp.zeros((count, memory_size(brains)), dtype=float)
        action = wp.zeros((count, brains.output_slot.shape[1]), dtype=float)
        slots, which = wp.zeros(count, dtype=int), wp.array(np.arange(count, dtype=np.int32))
        done = []
        for row in sensed.astype(np.float32):
            values = memory.numpy()
            values[:, : row.size] = row
            memory.assign(values)
            wp.launch(activate, dim=count, inputs=[programs, slots, which, memory, action])
            done.append(action.numpy().copy())
    return np.stack(done, axis=1)


@pytest.mark.parametrize(
    ("task", "geometry", "linkage", "settings"),
    [
        (AntTask(), None, "none", FEED_FORWARD),
        (AntTask(), "all", "full", FEED_FORWARD),
        (RobotTask(model="ant"), "single", "joints", FEED_FORWARD),
        (AntTask(), "all", "full", busy(RECURRENT, activation_default="sigmoid", weight_init_stdev=0.1)),
    ],
    ids=["neat", "all-full", "single-joints", "recurrent"],
)
def test_networks_do_on_warp_what_they_do_on_the_cpu(
    task: Task, geometry: str | None, linkage: str, settings: EvolutionSettings
) -> None:
    plan = plan_body(task, hidden=4)
    if geometry:
        task = task.shared_by(Geometry(geometry).subpopulations(task.parts))
        plan = plan_modules(task, Geometry(geometry), linkage, Wiring(), hidden=4)
    teams = [[from_stock(genome) for genome in random_team(plan, settings, seed)] for seed in range(TEAMS)]
    brains = lay_out([assemble(plan, [team], feed_forward=settings.feed_forward) for team in teams])
    sensed = np.random.default_rng(0).standard_normal((STEPS, task.sensed_size))
    expected = np.stack([actions_of(brains, b, sensed) for b in range(TEAMS)])
    assert np.ptp(expected) > 0.1
    np.testing.assert_allclose(actions_on_warp(brains, sensed), expected, rtol=0.0, atol=1e-5)
