"""Optional capabilities of tasks, which the other rooms check with `isinstance`."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks.task import Adapter, Camera, Simulation


@runtime_checkable
class HasTiles(Protocol):
    """A task whose world can be drawn as tiles."""

    def tiles(self, world: Any) -> NDArray[np.float64]:
        """(N, N, 3) current path (1 or 0) and both channels of every tile."""


@runtime_checkable
class HasInitialPose(Protocol):
    """A task whose worlds start from a pose that `noise.reset_scale` disturbs."""

    def usual_reset_scale(self) -> float:
        """The default size of this noise."""

    def open_disturbed(self, *, training: bool, reset_scale: float) -> Simulation:
        """Open a new world, with noise of this size on the initial pose."""


@runtime_checkable
class HasFullReward(Protocol):
    """A task with a second score besides the fitness."""

    def full_reward_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) full reward of episodes whose terms add up to `totals`, (..., terms)."""


@runtime_checkable
class HasDistance(Protocol):
    """A task whose fitness can be converted to a distance."""

    def metres_of(self, fitness: float) -> float:
        """Forward distance (m) of an episode with this fitness."""


@runtime_checkable
class HasAdapter(Protocol):
    """A task that transforms readings or actions and whose champions can still run in other programs."""

    def adapter(self) -> Adapter:
        """How readings become sensed values, and a brain's outputs controls."""


@runtime_checkable
class HasPicture(Protocol):
    """A task whose world can be filmed."""

    def snapshot(self, world: Any) -> Any:
        """The data for a picture of the world's current state, in a form that other processes can read."""

    def camera(self, width: int, height: int) -> Camera:
        """A camera that draws snapshots in this size (pixels)."""


@runtime_checkable
class HasBatch(Protocol):
    """A task that can run many worlds in parallel on a GPU."""

    def open_batch(self, count: int, device: str, *, training: bool, reset_scale: float | None, room: int) -> Any:
        """Open `count` worlds on a device, with `room` times the usual room for contacts.

        Raises:
            ConfigError: the task cannot run there.
        """
