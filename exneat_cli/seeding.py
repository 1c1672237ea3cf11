"""Named random streams, all grown from one root seed.

Each purpose has a number of its own in the spawn key of a `numpy.random.SeedSequence`, so streams of
different purposes never meet, and a new purpose leaves the others as they are. Validation and test
episodes grow from a constant instead of the run's seed: every run and every variant faces the same ones.
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
    """What makes one episode: the world, the noise on the sensors, and chance in the agent's own actions."""

    world: SeedSequence
    sensor_noise: SeedSequence
    actions: SeedSequence


def stream(root: int, purpose: str, *indices: int) -> SeedSequence:
    """Seed of one stream of a run with seed `root`; `purpose` is a key of `STREAMS`.

    `indices` say which of the purpose's streams, e.g. a subpopulation, or a generation and an episode.
    """
    return SeedSequence(root, spawn_key=(STREAMS[purpose], *indices))


def generator(seed: SeedSequence) -> Generator:
    """A PCG64 generator at the start of `seed`'s stream, the kind that Gymnasium uses."""
    return Generator(PCG64(seed))


def training_episodes(root: int, generation: int, count: int, first: int = 0) -> list[EpisodeSeeds]:
    """`count` episodes of one generation (counted from 0), from number `first` on; its teams share them."""
    purposes = ("world", "sensor_noise", "action_ties")
    return [
        EpisodeSeeds(*(stream(root, purpose, generation, episode) for purpose in purposes))
        for episode in range(first, first + count)
    ]


def shared_episodes(purpose: str, count: int) -> list[EpisodeSeeds]:
    """The first `count` episodes of ``"validation"`` or ``"test"``, equal for all runs and variants."""
    kinds = [[stream(SHARED_ROOT, purpose, episode, kind) for episode in range(count)] for kind in range(3)]
    return [EpisodeSeeds(*seeds) for seeds in zip(*kinds, strict=True)]


def generator_in(state: Mapping[str, Any]) -> Generator:
    """A generator that goes on from the state of another, ``generator.bit_generator.state``.

    Raises:
        KeyError, OverflowError, TypeError, ValueError: it is no such state.
    """
    bit_generator = PCG64(0)
    bit_generator.state = dict(state)  # type: ignore[assignment]
    return Generator(bit_generator)
