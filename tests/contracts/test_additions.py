"""A task, an algorithm and a linkage that are defined here alone go the whole way of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.algorithms import (
    ALGORITHMS,
    Algorithm,
    Candidate,
    ExNEAT,
    Problem,
    Results,
    Search,
    State,
    Team,
    pack_teams,
    unpack_teams,
)
from exneat_cli.compiling import compiled_lean
from exneat_cli.errors import check_real, check_whole
from exneat_cli.main import main
from exneat_cli.records import RunDirectory
from exneat_cli.tasks import ENDED, RUNNING, TASKS, Part, Simulation, Task
from exneat_cli.wiring import LINKAGES, Pin
from tests.records.histories import history_of

pytestmark = pytest.mark.usefixtures("no_figures")


class CorridorWorld(NamedTuple):
    """place: (3,) of the agent, of the goal, and steps taken."""

    place: NDArray[np.int64]
    size: int


@compiled_lean
def reset(world: CorridorWorld, rng: Generator) -> None:
    world.place[1] = 0 if rng.random() < 0.5 else world.size - 1
    world.place[0] = world.size // 2
    world.place[2] = 0


@compiled_lean
def rewind(world: CorridorWorld) -> None:
    world.place[0] = world.size // 2
    world.place[2] = 0


@compiled_lean
def observe(world: CorridorWorld, readings: NDArray[np.float64]) -> None:
    readings[0] = 1.0 if world.place[1] < world.place[0] else 0.0
    readings[1] = 1.0 - readings[0]


@compiled_lean
def step(world: CorridorWorld, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    world.place[0] += 1 if action[1] > action[0] else -1
    world.place[2] += 1
    terms[0] = 1.0 if world.place[0] == world.place[1] else 0.0
    at_an_end = world.place[0] <= 0 or world.place[0] >= world.size - 1
    return ENDED if at_an_end or world.place[2] == world.size else RUNNING


@dataclass(frozen=True)
class Corridor(Task):
    """Walk to the end that a cue points to."""

    name: str = "corridor"
    size: int = 7

    terms: ClassVar[tuple[str, ...]] = ("arrived",)
    observation_size: ClassVar[int] = 2
    actuator_names: ClassVar[tuple[str, ...]] = ("left", "right")

    def __post_init__(self) -> None:
        check_whole("task.size", self.size, 3, 99)

    @property
    def parts(self) -> tuple[Part, ...]:
        return (Part("left", (0,), (0,), (-1.0, 0.0)), Part("right", (1,), (1,), (1.0, 0.0)))

    @property
    def longest_episode(self) -> int:
        return self.size

    def open(self, *, training: bool) -> Simulation:
        return Simulation(CorridorWorld(np.zeros(3, np.int64), self.size), reset, rewind, observe, step)


@dataclass(frozen=True)
class RandomSearch(Algorithm):
    """New random genomes in every generation; a generation has a second turn for its better half."""

    name: str = "random_search"
    kept: float = 0.5

    def __post_init__(self) -> None:
        check_real("algorithm.kept", self.kept, 0.1, 1.0)

    def start(self, problem: Problem) -> Search:
        return Draws(problem, self.kept)

    def restored(self, problem: Problem, state: State) -> Search:
        search = Draws(problem, self.kept)
        plain, columns = state
        search.generation = int(plain["generation"])
        (search.best,) = unpack_teams(columns, "best", problem)
        search.fitness = float(plain["fitness"])
        return search


class Draws(Search):
    def __init__(self, problem: Problem, kept: float) -> None:
        self.problem, self.kept = problem, kept
        self.generation, self.fitness = 0, -np.inf
        self.best: Team | None = None
        self.teams: list[Team] = []
        self.second = False

    def ask(self) -> tuple[list[Team], int]:
        if not self.second:
            anew = replace(self.problem, seed=self.problem.seed + 1 + self.generation)
            self.teams = list(ExNEAT().start(anew).ask()[0])
        return self.teams, self.problem.episodes

    def tell(self, results: Results) -> bool:
        fitness = np.where(results.failed, -np.inf, results.fitness.mean(axis=1))
        order = np.argsort(-fitness, kind="stable")
        if fitness[order[0]] > self.fitness:
            self.best, self.fitness = self.teams[order[0]], float(fitness[order[0]])
        self.teams = [self.teams[k] for k in order[: max(1, int(self.kept * len(order)))]]
        self.second = not self.second
        self.generation += not self.second
        return not self.second

    def candidates(self) -> list[Candidate]:
        return [] if self.best is None else [Candidate(self.best, self.fitness, self.generation - 1)]

    def state(self) -> State:
        assert self.best is not None
        plain = {"generation": self.generation, "fitness": self.fitness}
        return plain, pack_teams([self.best], "best")

    def columns(self) -> dict[str, int | float]:
        return {"record": self.fitness}


def opposite(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The first output of the last other part."""
    peers = [k for k in range(len(parts)) if k != own]
    return (Pin(0, peers[-1], delayed=True),)


@pytest.fixture
def configuration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with the YAML of all three, which are registered meanwhile."""
    monkeypatch.setitem(TASKS, "corridor", Corridor)
    monkeypatch.setitem(ALGORITHMS, "random_search", RandomSearch)
    monkeypatch.setitem(LINKAGES, "opposite", opposite)
    budget = "{generations: 3, population: 6, episodes: 2, validation_episodes: 2, test_episodes: 3, sweep_episodes: 2}"
    files = {
        "task/corridor.yaml": "# @package _global_\ndefaults: [/evolution: recurrent]\n"
        f"task: {{name: corridor, size: 7}}\nbudgets: {{quick: {budget}, smoke: {budget}}}\n",
        "algorithm/random_search.yaml": "name: random_search\nkept: 0.5\n",
        "linkage/opposite.yaml": "# @package _global_\nlinkage: opposite\n",
    }
    for name, text in files.items():
        path = tmp_path / "mine" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / "mine"


@pytest.mark.parametrize(
    "chosen",
    [
        ["task=corridor"],
        ["task=track_maze", "linkage=opposite", "geometry=all", "budget=smoke"],
        ["task=corridor", "algorithm=random_search", "algorithm.kept=0.3", "linkage=opposite"],
    ],
)
def test_additions_train_resume_to_the_same_bytes_and_are_evaluated(
    tmp_path: Path, configuration: Path, chosen: list[str]
) -> None:
    arguments = ["--config-dir", str(configuration), *chosen, "executor=serial", "sweep=none"]
    output = [f"output={tmp_path / 'whole'}"]
    assert main(["train", *arguments, *output, "generations=3"]) == 0
    assert main(["train", *arguments, f"output={tmp_path / 'parts'}", "generations=2"]) == 0
    assert main(["train", *arguments, f"output={tmp_path / 'parts'}", "generations=3", "resume=true"]) == 0
    (whole,) = (RunDirectory(path.parent) for path in (tmp_path / "whole").rglob("manifest.json"))
    (parts,) = (RunDirectory(path.parent) for path in (tmp_path / "parts").rglob("manifest.json"))
    assert history_of(whole.history) == history_of(parts.history)
    assert whole.champion.read_bytes() == parts.champion.read_bytes()
    assert (
        main(["evaluate", f"run={whole.path}", "sweep=sensor_noise", "sweep.levels=[0,0.2]", "sweep.episodes=2"]) == 0
    )
    assert len(whole.robustness.read_text(encoding="utf-8").splitlines()) == 3
    assert main(["inspect", f"run={whole.path}"]) == 0


def test_an_experiment_of_additions_is_swept_and_reported(
    tmp_path: Path, configuration: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    experiment = tmp_path / "corridors.yaml"
    experiment.write_text(
        "claim: Search by chance finds the way.\n"
        "settings: {task: corridor}\n"
        "variants:\n"
        "  neat: {label: NEAT, settings: {algorithm: neat}}\n"
        "  chance: {label: by chance, settings: {algorithm: random_search, linkage: opposite}}\n"
        "conditions:\n  clean: {label: no noise, settings: {}}\n"
        "runs: {smoke: 2}\n",
        encoding="utf-8",
    )
    common = [f"experiment={experiment}", "budget=smoke", f"output={tmp_path / 'out'}"]
    assert main(["sweep", *common, "--config-dir", str(configuration), "executor=serial"]) == 0
    assert main(["report", *common, "--config-dir", str(configuration)]) == 0
    assert "by chance" in (tmp_path / "out" / "report" / "corridors" / "index.html").read_text(encoding="utf-8")


def test_the_second_turn_of_a_generation_faces_other_episodes(tmp_path: Path, configuration: Path) -> None:
    arguments = ["--config-dir", str(configuration), "task=corridor", "algorithm=random_search", "executor=serial"]
    assert main(["train", *arguments, f"output={tmp_path / 'out'}"]) == 0
    (run,) = (RunDirectory(path.parent) for path in (tmp_path / "out").rglob("manifest.json"))
    rows = history_of(run.history)
    assert [int(row["episodes"]) for row in rows] == [(6 + 3) * 2 * generation for generation in (1, 2, 3)]
    assert "record" in rows[0]
    assert "species" not in rows[0]
