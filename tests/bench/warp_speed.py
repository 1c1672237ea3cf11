"""Training on a GPU: speed of whole evolution and of physics alone, many runs side by side, and memory.

All of it takes less than ten minutes on one large GPU; sizes are options, so that it can be tried on a CPU.
"""

from __future__ import annotations

import functools
import multiprocessing
import tempfile
import threading
import time
from collections.abc import Iterable
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import mannwhitneyu

from exneat_cli.brains import assemble
from exneat_cli.rollouts import Executor, Runner, keep_workers
from exneat_cli.runs import RunSettings, train
from exneat_cli.runs.training import Training
from exneat_cli.seeding import training_episodes
from exneat_cli.tasks import RobotTask
from exneat_cli.wiring import Geometry
from tests.bench.measurement import MEGABYTES, RATIO, SECONDS, STEPS_A_SECOND, Bar, Row

if TYPE_CHECKING:
    from exneat_cli.rollouts.batch.stage import Stage

SPEED_BAR, OVERHEAD_BAR, SECONDS_BAR = Bar(300_000.0, True), Bar(0.8, True), Bar(600.0, False)
FIRST_SEED = 100
STEADY_STEPS = 80
"""Control steps after which worlds are at different points of their episodes."""


@dataclass(frozen=True)
class Sizes:
    """How much of it is measured.

    Attributes:
        worlds: of the comparison with bare physics, and of whole evolution.
        queued: episodes for each world in a generation of whole evolution: a run waits for its longest one, and others
            use its worlds meanwhile.
        seconds: that whole evolution is watched for.
        memory_worlds: of which the memory is measured.
        runs, generations, population: of the training side by side.
        cpu_runs: of the same on the CPU, whose test figures are compared.
        max_steps: of an episode.
        device: Warp's, None for a GPU if there is one.
    """

    worlds: int = 4000
    queued: int = 16
    seconds: int = 45
    memory_worlds: int = 5000
    runs: int = 10
    generations: int = 100
    population: int = 100
    cpu_runs: int = 3
    max_steps: int = 1000
    device: str | None = None

    @property
    def executor(self) -> Executor:
        """Room for all episodes of a generation."""
        return Executor("warp", worlds=max(self.worlds, self.runs * self.population), device=self.device)


def settings_of(sizes: Sizes, seed: int, **changes: object) -> RunSettings:
    """ExNEAT on Ant, one network for four legs that each sense in their own frame."""
    task = RobotTask(model="ant", max_steps=sizes.max_steps)
    values = {"task": task, "algorithm": "exneat", "geometry": Geometry("single"), "seed": seed}
    values |= {"population": sizes.population, "generations": sizes.generations, "executor": sizes.executor}
    return RunSettings(**{**values, **changes})  # type: ignore[arg-type]


def measure_evolution(sizes: Sizes) -> Row:
    """Environment steps a second of runs side by side whose episodes fill the worlds, in the midst of evolution."""
    count = max(1, sizes.queued * sizes.worlds // sizes.population)
    executor = Executor("warp", worlds=sizes.worlds, device=sizes.device)
    trainings = [Training.start(settings_of(sizes, FIRST_SEED + k)) for k in range(count)]
    is_over = threading.Event()
    with keep_workers(), ThreadPoolExecutor(count) as pool:

        def evolve(training: Training) -> None:
            with Runner(training.settings.task, training.settings.noise, executor, training=True) as runner:
                while not (is_over.is_set() or training.is_over):
                    training.advance(runner)

        runs = [pool.submit(evolve, training) for training in trainings]
        while not all(training.history for training in trainings) and not any(run.done() for run in runs):
            time.sleep(0.1)  # the first generation compiles
        before, began = _steps(trainings), time.perf_counter()
        wait(runs, timeout=sizes.seconds, return_when=FIRST_COMPLETED)
        did, seconds = _steps(trainings) - before, time.perf_counter() - began
        is_over.set()
        for run in runs:
            run.result()
    note = f"{did} steps in {seconds:.0f} s"
    return Row(f"whole evolution, {count} runs side by side", STEPS_A_SECOND, [did / seconds], SPEED_BAR, note)


def _steps(trainings: Iterable[Training]) -> int:
    return sum(int(training.history[-1]["env_steps"]) for training in trainings if training.history)


def compare_with_bare_steps(sizes: Sizes) -> Row:
    """Speed of whole control steps over that of `mujoco_warp.step` alone, of the same worlds from the same states."""
    import mujoco_warp
    import warp as wp

    stage, worlds = _filled_stage(sizes, sizes.worlds)
    _do_steps(stage, STEADY_STEPS)
    model, data = worlds.model, worlds.data
    state = [(array, array.numpy()) for array in (data.qpos, data.qvel, data.qacc_warmstart, data.ctrl)]

    def bare() -> None:
        for _ in range(5):
            mujoco_warp.step(model, data)

    ours = _seconds_per_call(lambda: _do_steps(stage, 1), 40)
    for array, values in state:
        array.assign(values)
    model.callback.contactfilter = model.callback.control = None
    with wp.ScopedDevice(stage.device):
        bare()
        reference: object = bare
        if stage.device.is_cuda:
            with wp.ScopedCapture() as capture:
                bare()
            reference = functools.partial(wp.capture_launch, capture.graph)
        for array, values in state:
            array.assign(values)
        bare_seconds = _seconds_per_call(reference, 4)  # type: ignore[arg-type]
    note = f"{sizes.worlds / ours:,.0f} against {sizes.worlds / bare_seconds:,.0f} control steps a second"
    return Row("whole control steps over bare steps", RATIO, [bare_seconds / ours], OVERHEAD_BAR, note)


def _do_steps(stage: Stage, steps: int) -> None:
    stage.launch(steps)
    stage.look()


def _seconds_per_call(work: object, calls: int) -> float:
    import warp as wp

    wp.synchronize()
    began = time.perf_counter()
    for _ in range(calls):
        work()  # type: ignore[operator]
    wp.synchronize()
    return (time.perf_counter() - began) / calls


def _filled_stage(sizes: Sizes, count: int) -> tuple[Stage, Any]:
    """A stage of so many worlds with enough to do for all of them, and its worlds."""
    from exneat_cli.rollouts.batch.stage import Stage

    settings = settings_of(sizes, FIRST_SEED)
    task = settings.task
    teams, _ = Training.start(settings).search.ask()
    brains = assemble(settings.plan, [team.genomes for team in teams], feed_forward=settings.evolution.feed_forward)
    scale = settings.noise.reset_scale
    worlds = task.open_batch(count, sizes.executor.device_name, training=True, reset_scale=scale, room=1)
    stage = Stage(
        worlds,
        sensor_std=0.0,
        slots=1,
        sensed_size=task.sensed_size,
        action_size=len(task.actuator_names),
        terms=len(task.terms),
        moments=False,
    )
    stage.put(0, brains, training_episodes(FIRST_SEED, 0, -(-6 * count // len(teams))))
    return stage, worlds


def measure_device_memory(sizes: Sizes) -> Row:
    """Memory of the device that so many worlds take, with their networks."""
    import warp as wp

    device = wp.get_device(sizes.executor.device_name)
    before = device.free_memory if device.is_cuda else 0
    stage, _ = _filled_stage(sizes, sizes.memory_worlds)
    _do_steps(stage, 2)
    wp.synchronize()
    taken = (before - device.free_memory) / 1e6 if device.is_cuda else 0.0
    return Row(f"memory at {sizes.memory_worlds} worlds", MEGABYTES, [taken], None, str(device.name))


def compare_with_cpu(sizes: Sizes) -> tuple[Row, ...]:
    """Seconds of runs side by side, and the distribution of their test figures beside that of runs on the CPU.

    Those on the CPU go on meanwhile, each in a process of its own.
    """
    spawning = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as directory, ProcessPoolExecutor(mp_context=spawning) as cores:
        asked = [settings_of(sizes, FIRST_SEED + k, output=directory, name="warp") for k in range(sizes.runs)]
        others = [replace(each, executor=Executor("serial"), name="cpu") for each in asked[: sizes.cpu_runs]]
        waiting = [cores.submit(_figure, each) for each in others]
        began = time.perf_counter()
        with keep_workers(), ThreadPoolExecutor(sizes.runs) as pool:
            on_gpu = list(pool.map(_figure, asked))
        seconds = time.perf_counter() - began
        on_cpu = [each.result() for each in waiting]
    budget = f"{sizes.runs} runs x {sizes.generations} generations x {sizes.population} teams"
    rows = [Row(f"{budget}, side by side", SECONDS, [seconds], SECONDS_BAR, f"test figures {np.round(on_gpu, 1)}")]
    if on_cpu:
        p = float(mannwhitneyu(on_gpu, on_cpu).pvalue)
        note = f"on the CPU {np.round(on_cpu, 1)}"
        rows.append(Row("Mann-Whitney p of test figures, GPU and CPU", RATIO, [p], Bar(0.05, True), note))
    return tuple(rows)


def _figure(settings: RunSettings) -> float:
    return train(settings).result.champion.fitness_mean
