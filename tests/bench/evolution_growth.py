"""How the time of a generation grows with population and modules, and shrinks with threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from exneat_cli.algorithms import Coevolution, EvolutionSettings, Problem, Results
from exneat_cli.brains import assemble
from exneat_cli.rollouts import Executor, Runner
from exneat_cli.runs import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.wiring import Module, Pin, Plan
from tests.bench.measurement import RATIO, Bar, Row, VerificationError, growth_ratios, seconds_of
from tests.bench.two_threads import usable_cores
from tests.bench.workload import PLAN as NEAT_PLAN

POPULATIONS = (50, 100, 200, 400, 800)
MODULES = (1, 2, 4, 8, 16)
MODULE_POPULATION = 100
LEG_SHAPE = (22, 4, 2)
"""Inputs, initial hidden nodes and outputs of a leg's module on Ant."""
LINEAGES = 4
"""Trainings that are begun anew with other seeds: under chance alone genomes drift, the smaller the population the
further, and figures of a single one would tell of that."""
WARM_UP = 2
GENERATIONS = 8
"""Of a lineage, first those that are not counted, then those that are."""
THREAD_GENERATIONS = 6
BAR = Bar(2.1, at_least=False)


class Growing:
    """A training without episodes: teams get standard normal noise as fitness.

    Args:
        plan: wires the brains.
        population: of each subpopulation.
        root: of its random streams.
    """

    def __init__(self, plan: Plan, population: int, root: int) -> None:
        self._plan, settings = plan, EvolutionSettings()
        self.coevolution = Coevolution(Problem(plan, settings, population, episodes=1, pairing="rank", seed=root))
        self._rng = np.random.default_rng(root)
        self._teams = self.coevolution.ask()[0]

    def advance(self) -> float:
        """Wall seconds of all that a generation is but its episodes: tell, ask and making the brains."""
        teams = len(self._teams)
        results = Results(self._rng.standard_normal((teams, 1)), np.zeros(teams, np.bool_))
        return seconds_of(partial(self._advance, results))

    def _advance(self, results: Results) -> None:
        self.coevolution.tell(results)
        self._teams = self.coevolution.ask()[0]
        assemble(self._plan, [team.genomes for team in self._teams], feed_forward=True)

    @property
    def connections(self) -> float:
        """Mean connections of a team."""
        return float(np.mean([sum(len(g.connections) for g in team.genomes) for team in self._teams]))


def measure_growth_with_population() -> list[Row]:
    """Seconds of a generation without its episodes, NEAT on Ant, per doubling of the population."""
    makers = [partial(Growing, NEAT_PLAN, population) for population in POPULATIONS]
    return _rows("population {} / {}, NEAT 105-6-8, evolution and brains, s", POPULATIONS, makers)


def measure_growth_with_modules() -> list[Row]:
    """The same per doubling of the number of modules, each like a leg's on Ant and of a subpopulation of its own."""
    makers = [partial(Growing, legs(count), MODULE_POPULATION) for count in MODULES]
    shape = "-".join(map(str, LEG_SHAPE))
    name = f"{{}} / {{}} modules {shape}, population {MODULE_POPULATION} each, evolution and brains, s"
    return _rows(name, MODULES, makers)


def legs(count: int) -> Plan:
    """A plan of `count` modules that sense the same, drive actuators of their own and share no genomes."""
    inputs, hidden, outputs = LEG_SHAPE
    modules = [
        Module(
            name=f"leg {k}",
            position=(0.0, 0.0),
            subpopulation=k,
            pins=tuple(Pin(index) for index in range(inputs)),
            outputs=outputs,
            hidden=hidden,
            drives=tuple(range(k * outputs, (k + 1) * outputs)),
        )
        for k in range(count)
    ]
    return Plan(tuple(modules), inputs, count * outputs)


def _rows(name: str, sizes: Sequence[int], makers: Sequence[Callable[[int], Growing]]) -> list[Row]:
    """One row per doubling; `makers` make the training of each size from a root seed."""
    ratios: list[list[float]] = [[] for _ in sizes[1:]]
    seconds: list[list[float]] = [[] for _ in sizes]
    for root in range(LINEAGES):
        trainings = [make(root) for make in makers]
        growth_ratios([training.advance for training in trainings], WARM_UP)
        costs = [partial(_noted, training.advance, own) for training, own in zip(trainings, seconds, strict=True)]
        for own, more in zip(ratios, growth_ratios(costs, GENERATIONS), strict=True):
            own += more
    notes = [
        f"{np.median(own):.4f} s, last {training.connections:,.0f} connections per team and "
        f"{training.coevolution.columns()['species']} species"
        for own, training in zip(seconds, trainings, strict=True)
    ]
    return [
        Row(name.format(large, small), RATIO, own, BAR, f"{large}: {after}; {small}: {before}")
        for (small, large), (before, after), own in zip(pairwise(sizes), pairwise(notes), ratios, strict=True)
    ]


def _noted(cost: Callable[[], float], seconds: list[float]) -> float:
    seconds.append(cost())
    return seconds[-1]


def measure_growth_with_threads() -> Row:
    """Whole training generations of NEAT on Ant per second, with a thread per core over those with one.

    Raises:
        VerificationError: the two trainings differ.
    """
    cores = usable_cores()
    settings = RunSettings(algorithm="neat")
    executors = [Executor("threads", threads) for threads in (cores, 1)]
    runners = [Runner(settings.task, settings.noise, executor, training=True) for executor in executors]
    with runners[0], runners[1]:
        trainings = [Training.start(settings) for _ in runners]
        turns = [partial(training.advance, runner) for training, runner in zip(trainings, runners, strict=True)]
        rounds = [[seconds_of(turn) for turn in turns] for _ in range(1 + THREAD_GENERATIONS)]
    histories = [[{**row, "wall_seconds": 0.0} for row in training.history] for training in trainings]
    if histories[0] != histories[1]:
        raise VerificationError("a training depends on the number of threads")
    ratios = [single / several for several, single in rounds[1:]]
    steps = trainings[0].history[-1]["env_steps"]
    note = f"{steps:,} steps in all; no bar: what one core more adds depends on what else the machine does"
    return Row(f"whole Ant generations, NEAT, {cores} threads / 1 thread, generations/s", RATIO, ratios, None, note)
