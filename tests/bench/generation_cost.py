"""Whole training generations against the physics alone: what evolution, brains, rewards and records add."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.compiling import compiled
from exneat_cli.rollouts import Executor, Outcomes, Runner
from exneat_cli.runs import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import AntTask, RobotTask, Simulation
from exneat_cli.tasks.robots.dynamics import RobotWorld, rewind
from exneat_cli.wiring import Geometry, Wiring
from tests.bench.bare_physics import Recording, check_x, record, replay
from tests.bench.measurement import RATIO, Bar, Row, VerificationError, seconds_of
from tests.bench.two_threads import usable_cores

_Item = TypeVar("_Item")

VARIANTS = {
    "Ant, neat": RunSettings(algorithm="neat"),
    "Ant, exneat single/none": RunSettings(),
    "Ant, exneat all/none": RunSettings(geometry=Geometry("all")),
    "Ant, exneat all/full": RunSettings(geometry=Geometry("all"), linkage="full"),
    "Ant in its parts' frames, exneat single/joints": RunSettings(
        task=AntTask(frame="part"), linkage="joints", wiring=Wiring(central=False, trunk="shared")
    ),
    "hexapod in its parts' frames, exneat auto/none": RunSettings(task=RobotTask(), geometry=Geometry("auto")),
}
"""All of population 100; where nothing else is said, with a central module."""
GENERATIONS = 5
"""That are counted, each a ratio of its own; the one before them is not, since it compiles."""
GENERATION_BAR, EPISODES_BAR = Bar(1.15, at_least=False), Bar(1.10, at_least=False)


class WatchedRunner(Runner):
    """A runner that remembers what it ran last.

    Attributes:
        brains, episodes, outcomes: see `Runner.run`.
        seconds: wall seconds of that call.
    """

    brains: Brains
    episodes: Sequence[EpisodeSeeds]
    outcomes: Outcomes
    seconds: float

    def __enter__(self) -> WatchedRunner:
        return self

    def run(
        self, brains: Brains | Sequence[Brains] | None, episodes: Sequence[EpisodeSeeds], *, moments: bool = False
    ) -> Outcomes:
        """The same as without watching."""
        assert isinstance(brains, Brains)
        self.brains, self.episodes = brains, episodes
        began = time.perf_counter()
        self.outcomes = super().run(brains, episodes, moments=moments)
        self.seconds = time.perf_counter() - began
        return self.outcomes


@compiled
def replay_from_start(world: RobotWorld, controls: NDArray[np.float64]) -> float:
    """`replay` from where the last reset had put the body; returns the x of the trunk at the end, in metres."""
    rewind(world)
    replay(world, controls)
    return float(world.xpos[world.trunk, 0])


class BarePhysics:
    """Threads that do nothing but the physics of recorded episodes; a context manager that ends them.

    They start with the longest episode and take the next whenever one is free, so all end together. The start of
    the generation's episodes is drawn before the clock starts; putting the body there, once per episode, is part
    of the time, since every thread has to do that between two episodes: it is one `mj_forward`, about a twentieth of
    what a single control step costs.
    """

    def __init__(self, settings: RunSettings, threads: int) -> None:
        assert isinstance(settings.task, RobotTask)
        self._task = settings.task
        reset_scale = settings.noise.reset_scale
        self._simulations = [self._task.open_disturbed(training=True, reset_scale=reset_scale) for _ in range(threads)]
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="physics")

    def __enter__(self) -> BarePhysics:
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown()

    def seconds(self, runner: WatchedRunner) -> float:
        """Wall seconds of the physics of all episodes that `runner` ran last.

        Raises:
            VerificationError: an episode done again was another one.
        """
        recordings = self._recordings(runner)
        recordings.sort(key=lambda recording: -len(recording.controls))
        return seconds_of(partial(self._replay, recordings))

    def _recordings(self, runner: WatchedRunner) -> list[Recording]:
        (seeds,) = runner.episodes
        for simulation in self._simulations:
            simulation.reset(simulation.world, generator(seeds.world))
        steps, fitness = runner.outcomes.steps[:, 0].tolist(), runner.outcomes.fitness[:, 0].tolist()
        recordings: list[Recording] = []

        def check(simulation: Simulation, b: int) -> None:
            recording = record(self._task, simulation, runner.brains, b)
            did, expected = (len(recording.controls), recording.fitness), (steps[b], fitness[b])
            if did != expected:
                raise VerificationError(f"steps and fitness of an episode step by step: {did}; expected {expected}")
            recordings.append(recording)

        self._share(check, range(len(steps)))
        return recordings

    def _replay(self, recordings: Sequence[Recording]) -> None:
        self._share(_replay_one, recordings)

    def _share(self, work: Callable[[Simulation, _Item], None], items: Iterable[_Item]) -> None:
        """Do `work` for all items, each thread in a world of its own."""
        waiting = iter(items)

        def work_on(simulation: Simulation) -> None:
            for item in waiting:
                work(simulation, item)

        for worker in [self._pool.submit(work_on, simulation) for simulation in self._simulations]:
            worker.result()


def _replay_one(simulation: Simulation, recording: Recording) -> None:
    check_x("replayed", replay_from_start(simulation.world, recording.controls), recording.final_x)


def compare_with_physics(variant: str) -> list[Row]:
    """Wall seconds of whole generations and of their episodes over those of the bare physics on as many threads.

    Args:
        variant: a key of `VARIANTS`.

    Returns:
        Two rows, with one ratio for each generation.

    Raises:
        VerificationError: an episode done again was another one.
    """
    settings, threads = VARIANTS[variant], usable_cores()
    walls, episodes, bare = [], [], []
    with (
        WatchedRunner(settings.task, settings.noise, Executor("threads", threads), training=True) as runner,
        BarePhysics(settings, threads) as physics,
    ):
        training = Training.start(settings)
        for _ in range(1 + GENERATIONS):
            walls.append(seconds_of(partial(training.advance, runner)))
            episodes.append(runner.seconds)
            bare.append(physics.seconds(runner))
    steps = (training.history[-1]["env_steps"] - training.history[0]["env_steps"]) / GENERATIONS
    rows = []
    for what, seconds, bar in (("generations", walls, GENERATION_BAR), ("episodes", episodes, EPISODES_BAR)):
        name = f"whole {what}, {variant} / bare mj_step + mj_rnePostConstraint, s, {threads} threads"
        ratios = [ours / theirs for ours, theirs in zip(seconds[1:], bare[1:], strict=True)]
        rows.append(Row(name, RATIO, ratios, bar, f"{steps:,.0f} steps in {np.median(seconds[1:]):.3f} s"))
    return rows
