"""Named random streams, all derived from one root seed.

Each purpose has its own number in the spawn key of a `numpy.random.SeedSequence`, so streams of different purposes are
independent, and a new purpose does not change the others. Validation and test episodes are derived from a constant
instead of the run's seed, so that they are the same for all runs and variants.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from numpy.random import PCG64, Generator, SeedSequence

STREAMS = {
    "evolution": 0,
    "pairing": 1,
    "world": 2,
    "sensor_noise": 3,
    "action_ties": 4,
    "validation": 5,
    "test": 6,
    "random_actions": 7,
    "bootstrap": 8,
}
"""Purpose -> first entry of the spawn key. Numbers are never reused: results depend on them."""

SHARED_ROOT = 0
"""Root of the validation and test streams, which do not depend on the run's seed."""


class EpisodeSeeds(NamedTuple):
    """The seeds of one episode: of the world, the sensor noise, and random numbers in the agent's actions."""

    world: SeedSequence
    sensor_noise: SeedSequence
    actions: SeedSequence


def stream(root: int, purpose: str, *indices: int) -> SeedSequence:
    """Seed of one stream of a run with seed `root`; `purpose` is a key of `STREAMS`.

    `indices` select one of the purpose's streams, e.g. by subpopulation, or by generation and episode.
    """
    return SeedSequence(root, spawn_key=(STREAMS[purpose], *indices))


def generator(seed: SeedSequence) -> Generator:
    """A PCG64 generator at the start of the stream of `seed`, as Gymnasium uses."""
    return Generator(PCG64(seed))


def training_episodes(root: int, generation: int, count: int, first: int = 0) -> list[EpisodeSeeds]:
    """`count` episodes of one generation (counted from 0), from number `first` on, the same for all of its teams."""
    purposes = ("world", "sensor_noise", "action_ties")
    return [
        EpisodeSeeds(*(stream(root, purpose, generation, episode) for purpose in purposes))
        for episode in range(first, first + count)
    ]


def shared_episodes(purpose: str, count: int) -> list[EpisodeSeeds]:
    """The first `count` episodes of ``"validation"`` or ``"test"``, the same for all runs and variants."""
    kinds = [[stream(SHARED_ROOT, purpose, episode, kind) for episode in range(count)] for kind in range(3)]
    return [EpisodeSeeds(*seeds) for seeds in zip(*kinds, strict=True)]


def generator_in(state: Mapping[str, Any]) -> Generator:
    """A generator that continues from the state of another, ``generator.bit_generator.state``.

    Raises:
        KeyError, OverflowError, TypeError, ValueError: the state is invalid.
    """
    bit_generator = PCG64(0)
    bit_generator.state = dict(state)  # type: ignore[assignment]
    return Generator(bit_generator)
