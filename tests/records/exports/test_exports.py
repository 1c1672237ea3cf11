"""An exported champion does what ours does: in NumPy, ONNX, neat-python, and by what its graph says."""

from __future__ import annotations

import dataclasses
import json
import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from exneat_cli.algorithms import ARS, NEAT, RECURRENT, EvolutionSettings, from_stock
from exneat_cli.algorithms.neat.settings import STOCK
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.errors import ExneatError
from exneat_cli.records import Score, exports, write_whole
from exneat_cli.records.champion import Champion, Genome, Scores, read_champion
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.runs import RunSettings, train
from exneat_cli.seeding import generator, shared_episodes
from exneat_cli.tasks import AntTask, GymTask, Hunting, RobotTask
from exneat_cli.wiring import Geometry, Wiring
from tests.brains.teams import busy, random_team

STEPS, EPISODE = 1000, 50
OWN_FRAMES: Any = {"frame": "part", "contact_forces": False}
TRUNK: Any = {"wiring": Wiring(central=False, trunk="shared"), "linkage": "joints"}
DIRECT = EvolutionSettings(initial_connection="full_direct", output_activation="clamped")
ARRAYS: Any = {
    "mutation": "adaptive",
    "safe_mutation": True,
    "crossover": "average",
    "crossover_prob": 0.5,
    "parent_selection": "rank",
}
"""What neat-python's genomes cannot do."""
SETTINGS = {
    "NEAT on Ant": RunSettings(task=AntTask(), algorithm=NEAT()),
    "single with joints, in parts' own frames": RunSettings(task=AntTask(**OWN_FRAMES), evolution=DIRECT, **TRUNK),
    "single that feels contacts in its own frames": RunSettings(task=AntTask(frame="part"), **TRUNK),
    "lr with hidden links": RunSettings(task=AntTask(), geometry=Geometry("lr"), linkage="hidden"),
    "all that hunt, recurrent": RunSettings(task=Hunting(), geometry=Geometry("all"), linkage="output"),
    "NEAT that hunts": RunSettings(task=Hunting(), algorithm=NEAT(), evolution=RECURRENT),
    "a planar body": RunSettings(task=RobotTask(model="half_cheetah"), geometry=Geometry("all"), linkage="joints"),
    "Humanoid, whose controls are not from -1 to 1": RunSettings(
        task=RobotTask(model="humanoid"), geometry=Geometry("auto"), wiring=Wiring(central=True), linkage="full"
    ),
    "a Box of actions": RunSettings(task=GymTask(env_id="Pendulum-v1")),
    "ARS": RunSettings(
        task=AntTask(max_steps=5, **OWN_FRAMES),
        algorithm=ARS(),
        geometry=Geometry("fb"),
        population=4,
        generations=2,
        validation_episodes=1,
        test_episodes=1,
        **TRUNK,
    ),
}


def evolved(settings: RunSettings) -> Champion:
    """A champion whose genomes went through many mutations; nobody ever tested it."""
    team = random_team(settings.plan, busy(settings.evolution, conn_delete_prob=0.1, node_delete_prob=0.1), seed=3)
    return Champion(
        variant=settings.variant,
        task=settings.to_plain()["task"],
        sensors=settings.task.sensor_names,
        actuators=settings.task.actuator_names,
        feed_forward=settings.evolution.feed_forward,
        scores=Scores(test=Score(1, 0.0, 0.0, 0.0, 0.0, 0, (0.0,))),
        plan=settings.plan,
        genomes=tuple(Genome.of(from_stock(genome)) for genome in team),
    )


@pytest.fixture(scope="module", params=SETTINGS)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[RunSettings, Champion]:
    settings = SETTINGS[request.param]
    if request.param == "ARS":
        settings = dataclasses.replace(settings, output=str(tmp_path_factory.mktemp("outputs")))
        return settings, read_champion(train(settings).directory.champion)
    return settings, evolved(settings)


def observations(size: int) -> np.ndarray:
    """Of the first the orientation is no quaternion at all."""
    drawn = np.random.default_rng(7).normal(0.0, 0.7, (STEPS, size))
    drawn[0] = 0.0
    return drawn


def ours(settings: RunSettings, champion: Champion) -> np.ndarray:
    """(steps, A) the controls that our own brain and world make of the observations."""
    task, brains = settings.task, lay_out([champion.brain()])
    simulation = task.open(training=False)
    memory, action = np.zeros(memory_size(brains)), np.zeros(len(task.actuator_names))
    controls = []
    for k, readings in enumerate(np.clip(observations(task.observation_size), *task.observation_limits)):
        memory[:] *= k % EPISODE > 0
        sensed = memory[: task.sensed_size]
        if simulation.sense is None:
            sensed[:] = readings
        else:
            simulation.sense(simulation.world, readings, sensed)
        activate(brains, 0, memory, action)
        if simulation.drive is not None:
            simulation.drive(simulation.world, action)
        if isinstance(task, GymTask):
            controls.append(simulation.world.interface.taken(action))
        elif isinstance(task, RobotTask):
            controls.append(simulation.world.middle + simulation.world.span * action)
        else:
            controls.append(action.copy())
    assert np.std(controls) > 1e-3
    return np.array(controls)


def exported(form: str, case: tuple[RunSettings, Champion], place: Path) -> Path:
    settings, champion = case
    for path, content in exports.exported(form, champion, settings.task, settings.evolution, place).items():
        path.parent.mkdir(exist_ok=True)
        write_whole(path, content)
    return place


def loaded(path: Path) -> Any:
    assert "exneat_cli" not in path.read_text("utf-8")
    return runpy.run_path(str(path))["Champion"]()


def test_in_numpy_it_acts_as_ours_in_every_episode(case: tuple[RunSettings, Champion], tmp_path: Path) -> None:
    champion, expected = loaded(exported("python", case, tmp_path / "champion.py")), ours(*case)
    # Networks of relu that feed themselves grow without bounds; Gymnasium's Box is in single precision.
    rtol = 1e-6 if expected.dtype == np.float32 else 1e-12
    for k, observation in enumerate(observations(case[0].task.observation_size)):
        if k % EPISODE == 0:
            champion.reset()
        np.testing.assert_allclose(champion.act(observation), expected[k], rtol=rtol, atol=1e-12)


def test_in_onnx_it_acts_as_ours(case: tuple[RunSettings, Champion], tmp_path: Path) -> None:
    pytest.importorskip("onnx", reason="pip install 'exneat[onnx]'")
    runtime = pytest.importorskip("onnxruntime", reason="pip install 'exneat[onnx]'")
    path, expected = exported("onnx", case, tmp_path / "champion.onnx"), ours(*case)
    session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    start = {each.name: np.zeros((1, each.shape[1])) for each in session.get_inputs() if each.name == "state"}
    state = start
    for k, observation in enumerate(observations(case[0].task.observation_size)):
        state = state if k % EPISODE else start
        controls, *following = session.run(None, {"observation": observation[None], **state})
        state = dict(zip(("state",), following, strict=False))
        np.testing.assert_allclose(controls[0], expected[k], rtol=1e-6, atol=1e-6)
    if not start:  # then many observations go at once
        (controls,) = session.run(None, {"observation": observations(case[0].task.observation_size)})
        np.testing.assert_allclose(controls, expected, rtol=1e-6, atol=1e-6)


def test_its_links_and_all_recurrent_nodes_are_state_and_nothing_else_is(tmp_path: Path) -> None:
    onnx = pytest.importorskip("onnx", reason="pip install 'exneat[onnx]'")
    for name, remembers in {
        "NEAT on Ant": False,
        "lr with hidden links": True,
        "all that hunt, recurrent": True,
    }.items():
        case = SETTINGS[name], evolved(SETTINGS[name])
        graph = onnx.load(exported("onnx", case, tmp_path / "champion.onnx")).graph
        assert [each.name for each in graph.input] == ["observation", "state"][: 1 + remembers]
        assert [each.name for each in graph.output] == ["controls", "next_state"][: 1 + remembers]


@pytest.mark.parametrize("name", ["NEAT on Ant", "single with joints, in parts' own frames", "NEAT that hunts"])
def test_neat_pythons_own_networks_act_as_ours(name: str, tmp_path: Path) -> None:
    champion = evolved(SETTINGS[name])
    assert ARRAYS.keys() == STOCK.keys()
    powers: Any = {"weight_mutate_power_min": 0.001, "weight_mutate_power_max": 10.0}
    evolution = dataclasses.replace(SETTINGS[name].evolution, **powers, **ARRAYS)
    place = exported("neat", (dataclasses.replace(SETTINGS[name], evolution=evolution), champion), tmp_path / "neat")
    made = runpy.run_path(str(place / "networks.py"))["networks"](place)
    wired = json.loads((place / "modules.json").read_text("utf-8"))
    brains = lay_out([champion.brain()])
    memory, action = np.zeros(memory_size(brains)), np.zeros(champion.plan.action_size)
    for sensed in observations(champion.plan.observation_size):
        memory[: sensed.size] = sensed
        activate(brains, 0, memory, action)
        theirs = np.zeros_like(action)
        for module in wired["modules"]:
            theirs[module["drives"]] = made[module["name"]].activate(sensed[module["senses"]].tolist())
        np.testing.assert_allclose(theirs, action, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["lr with hidden links", "all that hunt, recurrent"])
def test_neat_python_has_no_networks_that_read_each_other(name: str, tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match="format=python and format=onnx hold links"):
        exported("neat", (SETTINGS[name], evolved(SETTINGS[name])), tmp_path / "neat")
    assert not (tmp_path / "neat").exists()


def lines_of(dot: str) -> Iterator[tuple[str, str, str]]:
    """Of a graph: source and target of an edge, or a node and nothing, and the label."""
    for line in dot.splitlines():
        if found := re.match(r'\s*(\w+)(?: -> (\w+))?(?: \[(?:label="?((?:[^"\\]|\\.)*?)"?[,\]])?.*)?;$', line):
            yield found[1], found[2] or "", found[3] or ""


def test_its_graph_says_all_that_is_needed_to_evaluate_it(tmp_path: Path) -> None:
    settings = SETTINGS["lr with hidden links"]
    champion = evolved(settings)
    text = exported("dot", (settings, champion), tmp_path / "champion.dot").read_text("utf-8")
    assert text.count("{") == text.count("}")
    functions, reads = {}, {}
    for source, target, label in lines_of(text):
        if target:
            reads.setdefault(target, []).append((source, float(label) if label else 1.0))
        elif "bias" in label:
            words = re.match(r"(\w+)\\nbias (\S+?)(?:\\nresponse (\S+))?$", label)
            assert words is not None
            functions[source] = words[1], float(words[2]), float(words[3] or 1.0)
    delayed = set(re.findall(r"(\w+ -> \w+) \[style=dashed", text))

    def value(node: str, sensed: np.ndarray, before: dict[str, float], now: dict[str, float]) -> float:
        if node[0] == "s":
            return float(sensed[int(node[1:])])
        if node not in now:
            total = 0.0
            for source, weight in reads.get(node, []):
                is_old = f"{source} -> {node}" in delayed
                total += weight * (before.get(source, 0.0) if is_old else value(source, sensed, before, now))
            if node in functions:
                assert functions[node][0] == "tanh"
                total = np.tanh(np.clip(2.5 * (functions[node][1] + functions[node][2] * total), -60.0, 60.0))
            now[node] = total
        return now[node]

    brains = lay_out([champion.brain()])
    memory, action = np.zeros(memory_size(brains)), np.zeros(champion.plan.action_size)
    before: dict[str, float] = {}
    for sensed in observations(champion.plan.observation_size):
        memory[: sensed.size] = sensed
        activate(brains, 0, memory, action)
        now: dict[str, float] = {}
        acted = [value(f"a{k}", sensed, before, now) for k in range(action.size)]
        before = now | {node: value(node, sensed, before, now) for node in functions}
        np.testing.assert_allclose(acted, action, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("model", "env_id"), [("half_cheetah", "HalfCheetah-v5"), ("humanoid", "Humanoid-v5")])
def test_it_moves_gymnasiums_own_body_as_it_moves_ours(model: str, env_id: str, tmp_path: Path) -> None:
    settings = RunSettings(task=RobotTask(model=model, max_steps=15), geometry=Geometry("all"), linkage="output")
    champion = evolved(settings)
    (episode,) = shared_episodes("test", 1)
    with Runner(settings.task, Noise(), Executor("serial"), training=False) as runner:
        outcomes = runner.run(champion.brain(), [episode])
    acting, env = loaded(exported("python", (settings, champion), tmp_path / "c.py")), gymnasium.make(env_id)
    env.unwrapped.np_random = generator(episode.world)
    observation, _ = env.reset()
    forward, steps, over = 0.0, 0, False
    while not over:
        # Humanoid's observation begins with the positions and velocities that ours are.
        observation, _, over, _, terms = env.step(acting.act(observation[: settings.task.observation_size]))
        forward, steps = forward + terms["reward_forward"], steps + 1
        over = over or steps == settings.task.max_steps
    assert steps == outcomes.steps[0, 0]
    assert forward == pytest.approx(outcomes.fitness[0, 0], rel=1e-9)


def test_names_from_a_stranger_stay_names(tmp_path: Path) -> None:
    settings = SETTINGS["NEAT that hunts"]
    nasty = '"""\\n"; import os # \' ] } -> x'
    champion = evolved(settings)
    names = (nasty, *champion.sensors[1:])
    champion = type(champion)(**{**{f: getattr(champion, f) for f in champion.__struct_fields__}, "sensors": names})
    assert loaded(exported("python", (settings, champion), tmp_path / "c.py")).act(np.zeros(8)).shape == (5,)
    assert f"label={json.dumps(nasty)}" in exported("dot", (settings, champion), tmp_path / "c.dot").read_text("utf-8")
