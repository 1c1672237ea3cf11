"""Settings of episodes: executors, noise, and sweeps of one setting."""

from __future__ import annotations

import dataclasses
import os
import re
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_real, check_whole, is_finite
from exneat_cli.tasks import HasInitialPose, Task

_GPU_PACKAGES = {"mujoco-warp": "4.0.0", "warp-lang": "1.19.0"}
"""Packages of `exneat[gpu]`; results depend on their versions."""
EXECUTORS = ("threads", "serial", "processes", "dask", "warp")
_DEVICE = re.compile(r"cpu|cuda(:\d{1,2})?")
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/:]\S*:\d+")


@dataclass(frozen=True)
class Executor:
    """Where episodes run; results do not depend on it, except with ``warp``, which computes in single precision.

    Attributes:
        name: ``threads``, ``serial`` for one thread, ``processes`` for worker processes on this machine, ``dask``
            for those of a cluster, or ``warp`` for training in batches of worlds on a GPU.
        workers: number of threads, or of processes with one thread each; 0 takes every core that this process may
            use. Must be 0 with `address`, since that cluster has its own workers.
        address: address of the scheduler of a running dask cluster, e.g. ``tcp://10.0.0.1:8786``; None starts workers
            on this machine.
        worlds: for ``warp``, the maximum number of parallel worlds on its device.
        device: for ``warp``, ``cuda``, ``cuda:0``, ... or ``cpu``; None takes a GPU if there is one.

    Raises:
        ConfigError: a value is out of range, or makes no sense with this name.
    """

    name: str = "threads"
    workers: int = 0
    address: str | None = None
    worlds: int = 8192
    device: str | None = None

    def __post_init__(self) -> None:
        check_choice("executor.name", self.name, EXECUTORS)
        check_whole("executor.workers", self.workers, 0, 1 if self.name == "serial" else 4096)
        check_whole("executor.worlds", self.worlds, 1, 1_000_000)
        if self.device is not None:
            if self.name != "warp":
                raise ConfigError(
                    "executor.device", f"none with executor={self.name}", self.device, "only executor=warp has one"
                )
            if not isinstance(self.device, str) or not _DEVICE.fullmatch(self.device):
                raise ConfigError("executor.device", "null, cpu, cuda or cuda:<number>", self.device)
        if self.address is None:
            return
        if self.name != "dask":
            raise ConfigError(
                "executor.address", f"none with executor={self.name}", self.address, "only executor=dask has one"
            )
        if not isinstance(self.address, str) or not _ADDRESS.fullmatch(self.address):
            raise ConfigError("executor.address", "a scheduler's address such as tcp://10.0.0.1:8786", self.address)
        if self.workers:
            fix = "a cluster at an address has the workers that were started for it"
            raise ConfigError("executor.workers", "0 together with executor.address", self.workers, fix)

    @property
    def threads(self) -> int:
        """Number of threads that run at once, in this process or in workers that it starts."""
        if self.name == "serial":
            return 1
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return self.workers or cores

    def check_installed(self) -> None:
        """Refuse an executor whose library or device is missing.

        Raises:
            ExneatError: it is not installed or of another version, or there is no such device.
        """
        if self.name == "dask" and find_spec("distributed") is None:
            raise ExneatError("executor=dask: expected dask, which is not installed\n  pip install 'exneat[dask]'")
        if self.name == "warp":
            _ = self.device_name

    @property
    def device_name(self) -> str:
        """Warp's name of the device on which ``warp`` runs.

        Raises:
            ExneatError: MuJoCo Warp is not installed or of another version, or there is no such device.
        """
        for package, wanted in _GPU_PACKAGES.items():
            try:
                came = version(package)
            except PackageNotFoundError:
                came = "none"
            if came.split(".")[:2] != wanted.split(".")[:2]:
                raise ExneatError(
                    f"executor=warp: expected {package} {wanted}, got {came}\n  pip install 'exneat[gpu]'"
                )
        from exneat_cli.rollouts.batch.devices import find_device

        return find_device(self.device)


def is_compiled(task: Task) -> bool:
    """Whether a task's episodes run in compiled code, which threads speed up; plain Python code needs processes."""
    return task.open(training=False).compiled


@dataclass(frozen=True)
class Noise:
    """Noise in episodes.

    Attributes:
        sensor_std: sd of the normal noise on every reading at every step, in the reading's unit.
        reset_scale: size of the noise on the initial pose, on positions (rad, m) and velocities (rad/s, m/s); None
            takes the task's default.

    Raises:
        ConfigError: a value is negative or not finite.
    """

    sensor_std: float = 0.0
    reset_scale: float | None = None

    def __post_init__(self) -> None:
        check_real("noise.sensor_std", self.sensor_std, 0.0)
        if self.reset_scale is not None:
            check_real("noise.reset_scale", self.reset_scale, 0.0)


@dataclass(frozen=True)
class Sweep:
    """One setting of the task or of the noise, as used in training, and the levels at which to test it.

    Attributes:
        name: e.g. ``sensor_noise``.
        parameter: the dotted name of the setting, which starts with ``task.`` or ``noise.``.
        levels: its values, all different.
        label: label of its axis in figures.

    Raises:
        ConfigError: there are no levels, or one is not a finite number or occurs twice.
    """

    name: str
    parameter: str
    levels: tuple[float, ...]
    label: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "levels", tuple(self.levels))
        if not self.levels:
            raise ConfigError("sweep.levels", f"at least one level of {self.parameter}", list(self.levels))
        for level in self.levels:
            if isinstance(level, bool) or not isinstance(level, int | float) or not is_finite(level):
                raise ConfigError("sweep.levels", f"finite numbers, levels of {self.parameter}", level)
        if len(set(self.levels)) < len(self.levels):
            raise ConfigError("sweep.levels", "levels that all differ", list(self.levels))


def perturbed(task: Task, noise: Noise, sweep: Sweep, level: float) -> tuple[Task, Noise]:
    """Task and noise with the sweep's setting at another level.

    Raises:
        ConfigError: the task has no such setting, or it refuses the level.
    """
    section, _, name = sweep.parameter.partition(".")
    part = {"task": task, "noise": noise}.get(section)
    if part is None or name not in {field.name for field in dataclasses.fields(part)}:  # type: ignore[arg-type]
        raise ConfigError("sweep", f"a sweep that fits task={task.name}", sweep.name, f"it has no {sweep.parameter}")
    if sweep.parameter == "noise.reset_scale" and not isinstance(task, HasInitialPose):
        raise ConfigError("sweep", f"a sweep that fits task={task.name}", sweep.name, "it has no initial pose")
    changed = dataclasses.replace(part, **{name: level})  # type: ignore[type-var]
    return (changed, noise) if section == "task" else (task, changed)  # type: ignore[return-value]
