"""A robot's model, by name (Gymnasium's and our own) or from a file, and the rules of its episodes.

Gymnasium's models have the rules of its v5 environments (Farama Foundation, 2024).
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import mujoco

from exneat_cli.errors import ConfigError, check_path

LARGEST = 64 * 2**20
"""Maximum total size of a model and the files that it includes (bytes)."""


@dataclass(frozen=True)
class Rules:
    """The rules of a robot's episodes.

    Attributes:
        control_period: seconds per control step.
        heights: healthy range of the trunk's height in m; None for 0.4 to 2 times the initial height.
        steepest: limit of a planar trunk's healthy angles in rad.
        largest: limit of healthy velocities, and of healthy positions from the third on.
        speed: whose speed counts: that of the ``trunk``, its first joint (``slide``) or the centre of ``mass``.
        reset_scale: size of the noise on the initial pose.
        normal: whether this noise is normal on velocities; otherwise it is uniform, as on positions.
        forward_weight, healthy_reward, control_weight, contact_weight: weights of the full reward.
        cost_limit: contact forces (N, N m) are clipped to this in the contact cost.
        largest_contact_cost: upper limit of the contact cost of a step.
        named_by_place: whether parts are named by their position, because the names of their bodies mislead.
    """

    control_period: float = 0.05
    heights: tuple[float, float] | None = None
    steepest: float = float("inf")
    largest: float = float("inf")
    speed: str = "trunk"
    reset_scale: float = 0.1
    normal: bool = True
    forward_weight: float = 1.0
    healthy_reward: float = 1.0
    control_weight: float = 0.5
    contact_weight: float = 5e-4
    cost_limit: float = 1.0
    largest_contact_cost: float = float("inf")
    named_by_place: bool = False


_ALWAYS = (float("-inf"), float("inf"))
_PLANAR = Rules(heights=_ALWAYS, speed="slide", normal=False, contact_weight=0.0)

NAMED: dict[str, tuple[str, Rules]] = {
    "ant": ("ant.xml", Rules(heights=(0.2, 1.0), named_by_place=True)),
    "half_cheetah": ("half_cheetah.xml", replace(_PLANAR, normal=True, healthy_reward=0.0, control_weight=0.1)),
    "hopper": (
        "hopper.xml",
        replace(
            _PLANAR,
            control_period=0.008,
            heights=(0.7, float("inf")),
            steepest=0.2,
            largest=100.0,
            reset_scale=5e-3,
            control_weight=1e-3,
        ),
    ),
    "walker2d": (
        "walker2d_v5.xml",
        replace(_PLANAR, control_period=0.008, heights=(0.8, 2.0), steepest=1.0, reset_scale=5e-3, control_weight=1e-3),
    ),
    "swimmer": ("swimmer.xml", replace(_PLANAR, control_period=0.04, healthy_reward=0.0, control_weight=1e-4)),
    "humanoid": (
        "humanoid.xml",
        Rules(
            control_period=0.015,
            heights=(1.0, 2.0),
            speed="mass",
            reset_scale=1e-2,
            normal=False,
            forward_weight=1.25,
            healthy_reward=5.0,
            control_weight=0.1,
            contact_weight=5e-7,
            cost_limit=float("inf"),
            largest_contact_cost=10.0,
        ),
    ),
    "hexapod": ("hexapod.xml", Rules()),
}
"""File and rules of each named model."""


def rules_of(model: str) -> Rules:
    """The rules of a named model; Ant's for a file, with heights that follow from its initial pose."""
    return NAMED[model][1] if model in NAMED else Rules()


def path_of(model: str) -> Path:
    """The file of a model, by name or path.

    Raises:
        ConfigError: there is no such file.
    """
    if model in NAMED:
        return _shipped(model)
    path = check_path("task.model", model, "an MJCF file")
    if not path.is_file():
        fix = f"or one of the names {', '.join(NAMED)}"
        raise ConfigError("task.model", "an MJCF file that exists", model, fix)
    return path


@functools.cache
def _shipped(model: str) -> Path:
    ours = resources.files(__package__)
    return Path(
        str((ours if model == "hexapod" else resources.files("gymnasium.envs.mujoco.assets")) / NAMED[model][0])
    )


_Stamp = tuple[int, int] | None
_seen: dict[Path, dict[Path, _Stamp]] = {}
"""All files of each model read so far, by main file, with stamps that tell whether they have changed."""


def _state(model: str) -> tuple[Path, tuple[tuple[Path, _Stamp], ...]]:
    """The model's file, and the current state of all of its files, which may change while a program runs."""
    main = path_of(model).resolve()
    if any(_stamp(path) != stamp for path, stamp in _seen.get(main, {main: None}).items()):
        _seen[main] = {path: _stamp(path) for path in _paths(main)}
    return main, tuple(_seen[main].items())


def _stamp(path: Path) -> _Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


def _paths(main: Path) -> list[Path]:
    """The file and all that it includes.

    Raises:
        ConfigError: one of them is missing or cannot be read, the file is not MJCF, or they are too large.
    """
    with _reading(main):
        _refuse_large([main])
        paths = [main, *(Path(os.path.normpath(name)) for name in mujoco.mju_getXMLDependencies(str(main)))]
        _refuse_large(paths)
    return sorted(set(paths))


@contextlib.contextmanager
def _reading(main: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        came = f"{error.filename}: {error.strerror}"
        raise ConfigError("task.model", "a model whose files can all be read", came) from error
    except mujoco.FatalError as error:
        raise ConfigError("task.model", "an MJCF file", f"{main.name}: {error}") from error


def files_of(model: str) -> dict[str, bytes]:
    """The model's file and all that it includes, by their paths below their common directory.

    Raises:
        ConfigError: one of them is missing, cannot be read or is not MJCF, or they are too large.
    """
    return _files(*_state(model))


@functools.lru_cache(maxsize=16)
def _files(main: Path, state: tuple[tuple[Path, _Stamp], ...]) -> dict[str, bytes]:
    paths = [path for path, _ in state]
    common = Path(os.path.commonpath([path.parent for path in paths]))
    with _reading(main):
        return {str(path.relative_to(common)): path.read_bytes() for path in paths}


def _refuse_large(paths: Iterable[Path]) -> None:
    if sum(path.stat().st_size for path in paths) > LARGEST:
        raise ConfigError("task.model", f"files of at most {LARGEST >> 20} MB together", "larger ones")


def digest_of(model: str) -> str:
    """SHA-256 of the model's files and their names."""
    digest = hashlib.sha256()
    for name, content in files_of(model).items():
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def load(model: str) -> mujoco.MjModel:
    """The compiled model; the same object as long as none of its files changes.

    Raises:
        ConfigError: its files cannot be used, see `files_of`, or MuJoCo refuses them.
    """
    return _load(*_state(model))


@functools.lru_cache(maxsize=16)
def _load(path: Path, _: tuple[tuple[Path, _Stamp], ...]) -> mujoco.MjModel:
    mujoco.set_mju_user_warning(lambda message: None)  # otherwise MuJoCo writes MUJOCO_LOG.TXT
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise ConfigError("task.model", "an MJCF file that MuJoCo can load", f"{path.name}: {reason}") from error
