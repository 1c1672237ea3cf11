"""What only some tasks offer; the other rooms ask with `isinstance`."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks.task import Adapter, Camera, Simulation


@runtime_checkable
class HasTiles(Protocol):
    """A task whose world can be drawn as tiles."""

    def tiles(self, world: Any) -> NDArray[np.float64]:
        """(N, N, 3) path (1 or 0) and both channels of every tile as they are now."""


@runtime_checkable
class HasInitialPose(Protocol):
    """A task whose worlds start from a pose that `noise.reset_scale` disturbs."""

    def usual_reset_scale(self) -> float:
        """The size of this noise unless told otherwise."""

    def open_disturbed(self, *, training: bool, reset_scale: float) -> Simulation:
        """Open a new world, with noise of this size on the initial pose."""


@runtime_checkable
class HasFullReward(Protocol):
    """A task with a second figure besides the fitness."""

    def full_reward_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) the second figure that tests report."""


@runtime_checkable
class HasDistance(Protocol):
    """A task whose fitness says how far an episode led."""

    def metres_of(self, fitness: float) -> float:
        """Distance travelled forward (m)."""


@runtime_checkable
class HasAdapter(Protocol):
    """A task whose champions can be taken to other programs although it turns readings or actions."""

    def adapter(self) -> Adapter:
        """How readings become what brains sense, and what brains put out becomes controls."""


@runtime_checkable
class HasPicture(Protocol):
    """A task whose world can be filmed."""

    def snapshot(self, world: Any) -> Any:
        """What a picture of the world as it is now needs, as data that other processes can read."""

    def camera(self, width: int, height: int) -> Camera:
        """Something that makes pictures of snapshots, of so many pixels."""


@runtime_checkable
class HasBatch(Protocol):
    """A task of which many worlds run side by side on a GPU."""

    def open_batch(self, count: int, device: str, *, training: bool, reset_scale: float | None, room: int) -> Any:
        """Open `count` worlds on a device, with `room` times the usual room for contacts.

        Raises:
            ConfigError: they cannot run there.
        """
