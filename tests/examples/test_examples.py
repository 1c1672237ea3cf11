"""Every example runs, and the champion that NumPy runs acts as ours does."""

from __future__ import annotations

import csv
import dataclasses
import importlib.util
import json
import shutil
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import ALGORITHMS, NEAT, RECURRENT, EvolutionSettings
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.main import main
from exneat_cli.records import read_yaml
from exneat_cli.records.champion import read_champion
from exneat_cli.runs import RunSettings, train
from exneat_cli.tasks import TASKS, AntTask, Hunting
from exneat_cli.wiring import LINKAGES, Geometry, Wiring
from tests.records.histories import history_of

pytestmark = pytest.mark.usefixtures("no_figures")
EXAMPLES = Path(__file__).parents[2] / "examples"
CONF = ["--config-dir", str(EXAMPLES / "conf")]

# Mutations come often, so that a few generations leave networks with all that a network can have.
BUSY: Any = {"node_add_prob": 0.6, "node_delete_prob": 0.5, "conn_add_prob": 0.6, "conn_delete_prob": 0.5}
SHORT: Any = {"population": 8, "generations": 8, "validation_episodes": 1, "test_episodes": 1}
WALK = AntTask(max_steps=5)
CHAMPIONS = {
    "NEAT on Ant": RunSettings(task=WALK, algorithm=NEAT(), evolution=EvolutionSettings(**BUSY), **SHORT),
    "modules on Ant, linked, with a central one": RunSettings(
        task=WALK, geometry=Geometry("all"), linkage="full", evolution=EvolutionSettings(**BUSY), **SHORT
    ),
    "modules on Ant that share a genome, with sigmoids, clamped outputs and no central one": RunSettings(
        task=WALK,
        linkage="hidden",
        wiring=Wiring(central=False),
        evolution=EvolutionSettings(activation_default="sigmoid", output_activation="clamped", **BUSY),
        **SHORT,
    ),
    "recurrent modules that hunt, linked": RunSettings(
        task=Hunting(steps=5),
        geometry=Geometry("all"),
        linkage="output",
        evolution=dataclasses.replace(RECURRENT, **BUSY),
        **SHORT,
    ),
}


@pytest.fixture(autouse=True)
def in_an_empty_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Also takes what examples registered out of the registries again."""
    monkeypatch.chdir(tmp_path)
    registries: list[dict[str, Any]] = [TASKS, ALGORITHMS, LINKAGES]
    before = [dict(registry) for registry in registries]
    yield
    for registry, entries in zip(registries, before, strict=True):
        registry.clear()
        registry.update(entries)


def load(example: str) -> Any:
    name = example.removesuffix(".py")
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / example)
    assert spec is not None
    assert spec.loader is not None
    sys.modules[name] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", CHAMPIONS)
def test_a_champion_acts_in_numpy_as_it_does_in_our_brains(name: str) -> None:
    file = train(CHAMPIONS[name]).directory.champion
    champion = read_champion(file)
    brains = lay_out([champion.brain()])
    memory, ours = np.zeros(memory_size(brains)), np.zeros(champion.plan.action_size)
    stranger = load("run_champion.py").Champion(json.loads(file.read_text(encoding="utf-8")))
    actions = []
    for sensed in np.random.default_rng(5).standard_normal((50, champion.plan.observation_size)):
        memory[: len(sensed)] = sensed
        activate(brains, 0, memory, ours)
        actions.append(stranger.act(sensed))
        # Networks of relu that feed themselves grow without bounds.
        np.testing.assert_allclose(actions[-1], ours, rtol=1e-12, atol=1e-12)
    assert np.std(actions) > 1e-3


def test_a_champion_of_ant_walks_in_gymnasiums_environment_without_exneat() -> None:
    champion = train(CHAMPIONS["NEAT on Ant"]).directory.champion
    walk = load("run_champion.py").walk
    assert walk(champion, steps=20) == walk(champion, steps=20) != 0.0


def test_running_a_champion_takes_25_lines_besides_imports_and_documentation() -> None:
    text = (EXAMPLES / "run_champion.py").read_text(encoding="utf-8")
    code = text[text.index("ACTIVATIONS") : text.index("def walk")].splitlines()
    assert len([line for line in code if line.strip() and not line.strip().startswith(('"""', "#"))]) <= 25


@pytest.mark.parametrize(
    ("example", "choice", "variant"),
    [
        ("custom_task.py", ["task=corridor"], "corridor/exneat-single-none"),
        ("custom_linkage.py", ["task=track_maze", "linkage=ring"], "track_maze/exneat-single-ring"),
        ("custom_algorithm.py", ["task=track_maze", "algorithm=hill_climber"], "track_maze/hill_climber-single-none"),
    ],
)
def test_what_an_example_adds_trains_is_tested_and_resumes_to_the_same_history(
    example: str, choice: list[str], variant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))  # workers look where this process does
    load(example)
    asked = ["train", *CONF, *choice, "budget=smoke"]
    assert main([*asked, "generations=3"]) == 0
    (run,) = Path().glob(f"outputs/{variant}-s0-*")
    sweep = ["sweep=sensor_noise", "sweep.levels=[0,0.5]", "sweep.episodes=2"]
    assert main(["evaluate", f"run={run}", *sweep]) == 0
    assert (run / "robustness.csv").exists()
    assert main([*asked, "generations=5", "resume=true"]) == 0
    undisturbed = RunSettings.from_plain({**read_yaml(run / "config.yaml"), "output": "undisturbed"})
    assert history_of(run / "history.csv") == history_of(train(undisturbed).directory.history)


def test_the_task_goes_by_its_class_and_as_the_package_that_its_pyproject_makes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "custom_task", raising=False)
    shutil.copy(EXAMPLES / "custom_task.py", tmp_path)
    assert main(["train", "task=custom", "task.kind=custom_task:Corridor", "budget=smoke"]) == 0
    project = tomllib.loads((EXAMPLES / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    metadata = tmp_path / "exneat_corridor-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 1.0\n")
    lines = [f"{name} = {place}" for name, place in project["entry-points"]["exneat.tasks"].items()]
    (metadata / "entry_points.txt").write_text("\n".join(["[exneat.tasks]", *lines]))
    TASKS.pop("corridor", None)  # where importing the file put it, if nobody had imported it before
    assert main(["train", "task=custom", "task.name=corridor", "budget=smoke"]) == 0
    one, other = Path("outputs/corridor").iterdir()
    assert history_of(one / "history.csv") == history_of(other / "history.csv")


def test_the_lamp_of_the_corridor_is_found() -> None:
    finished = train(RunSettings(task=load("custom_task.py").Corridor(), generations=5, population=30, episodes=5))
    assert finished.result.champion.fitness_mean == 1.0


def test_the_experiment_of_ones_own_is_swept_and_reported() -> None:
    experiment = f"experiment={EXAMPLES / 'my_experiment.yaml'}"
    assert main(["sweep", experiment, "budget=smoke"]) == 0
    assert main(["report", experiment, "budget=smoke"]) == 0
    report = Path("outputs/report/my_experiment")
    assert "Four modules with shared genomes" in (report / "index.html").read_text(encoding="utf-8")
    assert {"training-noisy.svg", "robustness-noisy-sensor_noise.svg"} < {path.name for path in report.iterdir()}
    with (report / "comparison-my_experiment.csv").open(encoding="utf-8") as file:
        assert [row["variant"] for row in csv.DictReader(file)] == ["NEAT", "ExNEAT, shared"]


def test_the_quick_start_trains_both_and_says_what_came_out(capsys: pytest.CaptureFixture[str]) -> None:
    load("quick_start.py")
    first, _, second, _ = capsys.readouterr().out.splitlines()
    assert Path(first, "champion.json").exists()
    assert Path(second, "champion.json").exists()
