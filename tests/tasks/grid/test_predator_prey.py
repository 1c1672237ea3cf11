"""Foraging and hunting: catching, what the agent senses, and how episodes end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exneat_cli.brains import linear_fusion
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.seeding import shared_episodes, stream
from exneat_cli.tasks import ENDED, RUNNING, Foraging, Hunting
from exneat_cli.tasks.grid.predator_prey import observe, reset, rewind, step
from exneat_cli.tasks.grid.prey_field import FREE, PREY_COLUMN, PREY_ROW, Field
from exneat_cli.tasks.grid.world import COLUMN, COLUMN_STEPS, MOVES, ROW, ROW_STEPS, STAY

ACTIONS = np.eye(len(MOVES))


def field_of(task: Foraging, seed: int = 0) -> Field:
    field: Field = task.open(training=False).world
    reset(field, np.random.default_rng(seed))
    return field


class SlowField:
    """The rule as it is told: the whole field fades, prey are caught, move and emit, then the agent senses.

    Prey go where and emit what `field` drew for them; nothing else is taken from it.
    """

    def __init__(self, task: Foraging, field: Field) -> None:
        self.task, self.keep = task, task.p_c
        self.library = task.rules == "library"
        self.ways, self.path = field.places, field.path
        before = np.concatenate([np.zeros_like(field.cues[:1]), field.cues[:-1]])
        self.emissions = field.cues - self.keep * before
        self.signals = np.zeros((2, *self.path.shape))
        self.agent = (self.path.shape[0] // 2,) * 2
        self.places = [tuple(place) for place in field.start.tolist()]
        self.free = [True] * task.n_prey
        self.steps = 0
        self.advance()

    def advance(self) -> None:
        self.signals *= self.keep
        for k in range(self.task.n_prey):
            self.catch(k)
            if not self.free[k]:
                continue
            self.places[k] = tuple(self.ways[self.steps, k].tolist())
            if not self.library:
                self.catch(k)
            if not self.free[k]:
                continue
            channels = [0, 1] if isinstance(self.task, Hunting) else [k % 2]
            for own, channel in enumerate(channels):
                self.signals[channel] += self.emissions[self.steps, :, :, k * len(channels) + own]

    def catch(self, k: int) -> None:
        self.free[k] = self.free[k] and self.places[k] != self.agent

    def sensed(self) -> list[float]:
        row, column = self.agent
        sides = [(row + ROW_STEPS[side], column + COLUMN_STEPS[side]) for side in range(4)]
        return [self.signals[(channel, *tile)] for tile in sides for channel in (0, 1)]

    def step(self, move: int) -> tuple[int, float]:
        """Status and share of prey caught, or 0 before the end."""
        tile = self.agent[0] + ROW_STEPS[move], self.agent[1] + COLUMN_STEPS[move]
        if self.path[tile]:
            self.agent = tile
        self.steps += 1
        for k in range(0 if self.library else self.task.n_prey):
            self.catch(k)
        if self.steps < self.task.steps and any(self.free):
            self.advance()
            if any(self.free):
                return RUNNING, 0.0
        return ENDED, self.free.count(False) / self.task.n_prey

    def towards_prey(self) -> int:
        """The move that comes nearer to the first free prey."""
        target = self.places[self.free.index(True)] if any(self.free) else self.agent
        down, right = target[0] - self.agent[0], target[1] - self.agent[1]
        if abs(down) > abs(right):
            return MOVES.index("down" if down > 0 else "up")
        return STAY if right == 0 else MOVES.index("right" if right > 0 else "left")


def assert_equal(field: Field, slow: SlowField) -> None:
    tiles = slow.task.tiles(field)
    np.testing.assert_array_equal(tiles[..., 0], slow.path)
    np.testing.assert_allclose(np.moveaxis(tiles[..., 1:], 2, 0), slow.signals, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(field.prey[:, [PREY_ROW, PREY_COLUMN]], slow.places)
    np.testing.assert_array_equal(field.prey[:, FREE], slow.free)
    assert (field.agent[ROW], field.agent[COLUMN]) == slow.agent


def live_by_the_rule(task: Foraging, field: Field, moves: list[int] | None) -> int:
    """Compare at every step; the agent takes `moves` and then rests, or chases prey if there are none.

    Returns:
        How many prey were caught while others were free.
    """
    slow, observation, terms = SlowField(task, field), np.zeros(8), np.full(1, np.nan)
    status, caught = RUNNING, 0
    while status == RUNNING:
        observe(field, observation)
        np.testing.assert_allclose(observation, slow.sensed(), rtol=0, atol=1e-12)
        assert_equal(field, slow)
        caught = slow.free.count(False)
        move = slow.towards_prey() if moves is None else [*moves, *[STAY] * task.steps][slow.steps]
        status, share = slow.step(move)
        assert step(field, ACTIONS[move], terms) == status
        assert terms[0] == pytest.approx(share)
    assert_equal(field, slow)
    return caught


@st.composite
def small_tasks(draw: st.DrawFn) -> Foraging:
    size = draw(st.integers(3, 7))
    parameters: dict[str, Any] = {
        "size": size,
        "n_prey": draw(st.integers(1, min(8, size**2 - 1))),
        "steps": draw(st.integers(1, 30)),
        "p_e": draw(st.floats(0.0, 1.0)),
        "p_c": draw(st.floats(0.0, 1.0)),
        "patch_width": draw(st.sampled_from([1, 3, 5])),
        "rules": draw(st.sampled_from(["own", "library"])),
    }
    if draw(st.booleans()):
        return Foraging(**parameters)
    return Hunting(p_m=draw(st.floats(0.0, 1.0)), motion=draw(st.sampled_from(["levy", "brownian"])), **parameters)


@given(small_tasks(), st.integers(0, 2**32), st.none() | st.lists(st.integers(0, 4), max_size=30))
@settings(max_examples=150, deadline=None)
def test_what_is_looked_up_equals_the_whole_field_that_fades_step_by_step(
    task: Foraging, seed: int, moves: list[int] | None
) -> None:
    field = field_of(task, seed)
    live_by_the_rule(task, field, moves)
    rewind(field)
    live_by_the_rule(task, field, moves)


@pytest.mark.parametrize("p_c", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("world", [Foraging, Hunting])
def test_the_cues_of_prey_caught_midway_fade_as_the_rule_tells(world: type[Foraging], p_c: float) -> None:
    task = world(p_c=p_c)
    assert max(live_by_the_rule(task, field_of(task, seed), moves=None) for seed in range(20)) >= 3


def test_prey_that_walk_into_the_agent_are_caught_even_before_the_first_step() -> None:
    # Three tiles a side and prey on all but the centre: some move onto it at the reset.
    early = 0
    for seed in range(30):
        task = Hunting(size=3, n_prey=8, p_m=1.0)
        field = field_of(task, seed)
        early += int((field.prey[:, FREE] == 0).sum())
        live_by_the_rule(task, field, [STAY] * 50)
    assert early > 0


def test_foraging_prey_alternate_channels_and_hunting_prey_use_both() -> None:
    # Patches of one tile are heard where their prey is alone.
    foraging, hunting = Foraging(patch_width=1), Hunting(patch_width=1, p_m=0.0)
    for task, expected in ((foraging, [[1.0, 0.0], [0.0, 1.0]] * 5), (hunting, [[1.0, 1.0]] * 10)):
        field = field_of(task)
        rows, columns = field.start.T
        assert task.tiles(field)[rows, columns, 1:].tolist() == expected


def test_stepping_onto_a_prey_catches_it_and_the_last_one_ends_the_episode() -> None:
    field, terms = field_of(Foraging(n_prey=2)), np.zeros(1)
    field.start[:] = field.places[:] = (4, 5), (4, 6)
    rewind(field)
    right = ACTIONS[MOVES.index("right")]
    assert step(field, right, terms) == RUNNING
    assert (list(field.prey[:, FREE]), terms[0]) == ([0, 1], 0.0)
    assert step(field, right, terms) == ENDED
    assert terms[0] == 1.0


@pytest.mark.parametrize(("rules", "caught"), [("own", 1.0), ("library", 0.0)])
def test_by_the_librarys_rules_the_last_move_catches_nothing(rules: str, caught: float) -> None:
    field, terms = field_of(Foraging(n_prey=1, steps=1, rules=rules)), np.zeros(1)
    field.start[:] = field.places[:] = (4, 5)
    rewind(field)
    assert step(field, ACTIONS[MOVES.index("right")], terms) == ENDED
    assert terms[0] == caught


@pytest.mark.parametrize(("rules", "free"), [("own", 0), ("library", 1)])
def test_by_the_librarys_rules_prey_that_walk_onto_the_agent_get_away_if_it_moves_on(rules: str, free: int) -> None:
    field, terms = field_of(Hunting(n_prey=2, rules=rules)), np.zeros(1)
    field.start[:] = field.places[:] = (4, 5), (1, 1)
    field.places[0, 0] = (4, 4)
    rewind(field)
    assert field.prey[0, FREE] == free
    assert step(field, ACTIONS[MOVES.index("left")], terms) == RUNNING
    assert field.prey[0, FREE] == free


def test_linear_fusion_reaches_by_the_librarys_rules_what_it_reaches_in_the_library() -> None:
    # Measured with Multimodal_mazes itself: 10 tiles a side, cues of which half persist, sensor noise 0.02.
    common = {"size": 10, "p_c": 0.5, "rules": "library"}
    for task, reached in ((Foraging(**common), 0.32), (Hunting(**common), 0.72)):
        with Runner(task, Noise(0.02), Executor(), training=False) as runner:
            fusion = runner.run([linear_fusion(8, 5, task.parts)], shared_episodes("test", 1000))
        assert fusion.fitness.mean() == pytest.approx(reached, abs=0.05)


@pytest.mark.parametrize("task", [Foraging(), Hunting()])
def test_following_the_cues_is_far_better_than_chance(task: Foraging) -> None:
    seeds = shared_episodes("test", 100)
    own = [(world, noise, stream(0, "random_actions", k)) for k, (world, noise, _) in enumerate(seeds)]
    with Runner(task, Noise(), Executor(), training=False) as runner:
        fusion = runner.run([linear_fusion(8, 5, task.parts)], seeds)
        luck = runner.run(None, own)
    assert fusion.fitness.mean() > luck.fitness.mean() + 0.2
