"""Gymnasium environments: making them, their spaces, and their pictures."""

from __future__ import annotations

import functools
import importlib
import json
import math
import os
import warnings
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError, ExneatError, nearest
from exneat_cli.tasks.user_code import make_findable


class Interface(NamedTuple):
    """The spaces and metadata of an environment.

    `low`, `high`: (A,) the actions that -1 and 1 stand for; `space`: the action space; `first`: the smallest discrete
    action, None if actions are continuous; `max_steps`: the environment's own limit, if any; `render_modes`,
    `render_fps`: how it can be drawn, and control steps per second, if they have a duration; `is_mujoco`: whether
    MuJoCo simulates it.
    """

    observation_size: int
    actions: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    space: spaces.Space[Any]
    first: int | None
    max_steps: int | None
    render_modes: tuple[str, ...]
    render_fps: float | None
    is_mujoco: bool

    @property
    def is_discrete(self) -> bool:
        """Whether actions are discrete."""
        return self.first is not None

    def taken(self, action: NDArray[np.float64]) -> Any:
        """Convert our action, (A,), to the environment's action space."""
        if self.first is not None:
            return self.first + int(np.argmax(action))
        share = (np.clip(action, -1.0, 1.0) + 1.0) / 2.0
        values = self.low + share * (self.high - self.low)
        return values.astype(self.space.dtype).reshape(self.space.shape)


@functools.lru_cache(64)
def interface_of(env_id: str, kwargs: str) -> Interface:
    """Make the environment once to read its spaces and metadata; `kwargs` is JSON."""
    env = make(env_id, json.loads(kwargs), None)
    try:
        senses, acts = env.observation_space, env.action_space
        max_steps = env.spec.max_episode_steps if env.spec else None
        modes, fps = env.metadata.get("render_modes") or (), env.metadata.get("render_fps")
        shown = tuple(map(str, modes)), float(fps) if fps else None, simulated_by_mujoco(env) is not None
    finally:
        env.close()
    if not isinstance(senses, spaces.Box) or senses.dtype.kind not in "biuf" or not senses.shape:
        raise _unsupported(env_id, "observations in a Box of numbers", senses)
    size = math.prod(senses.shape)
    if isinstance(acts, spaces.Discrete):
        none = np.zeros(0)
        return Interface(size, int(acts.n), none, none, acts, int(acts.start), max_steps, *shown)
    if not isinstance(acts, spaces.Box) or acts.dtype.kind != "f":
        raise _unsupported(env_id, "actions that are Discrete or a Box of real numbers", acts)
    low, high = acts.low.ravel().astype(float), acts.high.ravel().astype(float)
    has_low, has_high = np.isfinite(low), np.isfinite(high)
    # Where a bound is missing, the range is two units wide: -1 to 1, or starting from the other bound.
    lowest = np.where(has_low, low, np.where(has_high, high - 2.0, -1.0))
    highest = np.where(has_high, high, np.where(has_low, low + 2.0, 1.0))
    return Interface(size, len(low), lowest, highest, acts, None, max_steps, *shown)


def simulated_by_mujoco(env: gymnasium.Env[Any, Any]) -> mujoco.MjData | None:
    """The state of an environment's MuJoCo simulation, if it has one."""
    data = getattr(env.unwrapped, "data", None)
    return data if isinstance(data, mujoco.MjData) else None


def _unsupported(env_id: str, expected: str, came: object) -> ConfigError:
    fix = f"{env_id} has {str(came)[:200]}; a wrapper of gymnasium.wrappers may turn it into one"
    return ConfigError("task.env_id", f"an environment with {expected}", env_id, fix)


def make(env_id: str, kwargs: Mapping[str, Any], max_steps: int | None) -> gymnasium.Env[Any, Any]:
    """Make an environment, or raise a `ConfigError` that says why it cannot be made."""
    module, _, own_id = env_id.rpartition(":")
    if module:
        _import(module, env_id)
    # Otherwise MuJoCo would write MUJOCO_LOG.TXT into the working directory; its warning counters are not affected.
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # advice about versions and spaces
            env = gymnasium.make(own_id, max_episode_steps=max_steps, disable_env_checker=True, **kwargs)
    except (gymnasium.error.DependencyNotInstalled, ImportError) as error:
        raise ConfigError("task.env_id", "an environment that is installed", env_id, in_words(error)) from error
    except gymnasium.error.Error as error:
        raise _unknown(env_id) from error
    except Exception as error:  # its constructor may raise anything
        if kwargs:
            expected = f"arguments that {env_id} takes"
            raise ConfigError("task.kwargs", expected, dict(kwargs), in_words(error)) from error
        raise ConfigError("task.env_id", "an environment that can be made", env_id, in_words(error)) from error
    if env.spec is None or env.spec.id != own_id:
        raise _unknown(env_id)  # Gymnasium takes the newest version if none is given
    return env


def _import(module: str, env_id: str) -> None:
    """Import the module that registers an environment; `find_task` has checked before that this is allowed."""
    make_findable(module.partition(".")[0])
    try:
        importlib.import_module(module)
    except (Exception, SystemExit) as error:  # its code may raise anything
        expected = "a module that can be imported from here, a colon and an id"
        raise ConfigError("task.env_id", expected, env_id, in_words(error)) from error


def _unknown(env_id: str) -> ConfigError:
    fix = nearest(env_id.rpartition(":")[2], gymnasium.registry, 0.5)
    fix = fix or "python -c 'import gymnasium; gymnasium.pprint_registry()' lists them"
    return ConfigError("task.env_id", "the id of a registered environment, with its version", env_id, fix)


def in_words(error: BaseException) -> str:
    """Any error as one line of text."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:300]


PICTURES = "rgb_array"
"""The render mode in which an environment returns pictures."""
Snapshot = tuple[bytes, tuple[int, int, int]]
"""An environment's own picture, compressed with zlib since an episode has hundreds of them, and its shape."""


def picture_of(env: gymnasium.Env[Any, Any], env_id: str) -> Snapshot:
    """The current picture of an environment that was made with the render mode `PICTURES`.

    Raises:
        ExneatError: it cannot be drawn here, or gives no picture.
    """
    # pygame prints a greeting to standard output, and looks for a screen that is not needed.
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pygame's, about its dependencies
            picture: Any = env.render()
    except Exception as error:  # rendering may raise anything
        raise ExneatError(f"task.env_id={env_id}: it cannot be drawn here: {in_words(error)}") from error
    pixels = np.asarray(picture)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint8:
        came = f"expected a picture of (height, width, 3) bytes, got {pixels.shape} of {pixels.dtype}"
        raise ExneatError(f"task.env_id={env_id}: {came}")
    return zlib.compress(pixels.tobytes(), 1), pixels.shape


class EnvironmentCamera:
    """Returns the pictures that environments draw themselves, in their own size."""

    def draw(self, snapshot: Snapshot) -> NDArray[np.uint8]:
        """(height, width, 3) the picture in a snapshot."""
        content, shape = snapshot
        return np.frombuffer(zlib.decompress(content), np.uint8).reshape(shape)
