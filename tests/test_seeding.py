"""Random streams never meet."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.seeding import STREAMS, generator, shared_episodes, stream, training_episodes

SEEDS = st.integers(0, 2**64)


def first_draws(seed: object) -> tuple[float, ...]:
    return tuple(generator(seed).random(3))  # type: ignore[arg-type]


@given(SEEDS)
def test_training_validation_and_test_episodes_are_disjoint(root: int) -> None:
    episodes = [
        *(e for generation in range(5) for e in training_episodes(root, generation, 4)),
        *shared_episodes("validation", 10),
        *shared_episodes("test", 20),
    ]
    streams = [first_draws(seed) for episode in episodes for seed in episode]
    assert len(set(streams)) == len(streams)


@given(SEEDS, st.integers(0, 50))
def test_training_episodes_repeat_and_differ_between_generations(root: int, generation: int) -> None:
    def draws(g: int) -> list[tuple[float, ...]]:
        return [first_draws(world) for world, *_ in training_episodes(root, g, 3)]

    assert draws(generation) == draws(generation)
    assert not set(draws(generation)) & set(draws(generation + 1))


def test_purposes_never_share_a_number() -> None:
    assert len(set(STREAMS.values())) == len(STREAMS)


@given(SEEDS, SEEDS)
def test_two_roots_have_different_streams(one: int, other: int) -> None:
    assert (first_draws(stream(one, "pairing")) == first_draws(stream(other, "pairing"))) == (one == other)


def test_more_test_episodes_leave_the_first_ones_as_they_are() -> None:
    few = [first_draws(world) for world, *_ in shared_episodes("test", 3)]
    many = [first_draws(world) for world, *_ in shared_episodes("test", 30)]
    assert many[:3] == few
