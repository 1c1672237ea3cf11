"""General maze and hunting as an ordinary user would write them: plain Python loops over NumPy arrays.

The rules are those of `exneat_cli.tasks.grid.maze` and `exneat_cli.tasks.grid.predator_prey` at their
defaults; the random numbers are others.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple, Protocol

import neat
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

MOVES = ((0, -1), (0, 1), (-1, 0), (1, 0), (0, 0))
"""Change of row and column: left, right, up, down, stay."""
SIDES = MOVES[:4]
TIE_NOISE = 1e-3
SPARE_STEPS = 2
LONGEST_FLIGHT = 7


class PlainOutcome(NamedTuple):
    """Fitness and number of agent steps of one episode."""

    fitness: float
    steps: int


class PlainWorld(Protocol):
    """What `run_episode` needs.

    Attributes:
        signals: (2, N, N), both channels of every tile.
        path: (N, N), whether one can walk on a tile.
        agent: its row and column.
        steps: that it has done.
    """

    signals: NDArray[np.float64]
    path: NDArray[np.bool_]
    agent: tuple[int, int]
    steps: int

    def reset(self, rng: Generator) -> None:
        """Draw a new world."""

    def after_move(self, rng: Generator) -> float | None:
        """What follows the agent's move: None while the episode goes on, else its fitness."""


def run_episode(world: PlainWorld, network: neat.nn.RecurrentNetwork, rng: Generator) -> PlainOutcome:
    """One episode in a new world, with the network at rest at first."""
    world.reset(rng)
    network.reset()
    fitness = None
    while fitness is None:
        row, column = world.agent
        neighbours = [world.signals[:, row + down, column + right] for down, right in SIDES]
        values = network.activate(np.clip(np.concatenate(neighbours), 0.0, 1.0))
        down, right = MOVES[np.argmax(values + rng.uniform(0.0, TIE_NOISE, len(MOVES)))]
        if world.path[row + down, column + right]:
            world.agent = row + down, column + right
        world.steps += 1
        fitness = world.after_move(rng)
    return PlainOutcome(fitness, world.steps)


class PlainMaze:
    """The general maze of size x size tiles."""

    def __init__(self, size: int) -> None:
        self.size = size

    def reset(self, rng: Generator) -> None:
        """Draw maze, start and goal, and lay the cues."""
        self._carve(rng)
        corners = [(row, column) for row in (1, self.size - 2) for column in (1, self.size - 2)]
        goal, start = rng.permutation(len(corners))[:2]
        self.agent, self.steps = corners[start], 0
        self._measure_distances(corners[goal])
        self.fastest, self.furthest = self.distances[self.agent], self.distances.max()
        cues = np.where(self.path, (self.furthest - self.distances) / self.furthest / 2, 0.0)
        self.signals = np.stack([cues, cues])

    def after_move(self, rng: Generator) -> float | None:
        """Nothing happens; the fitness once the goal or the end of the budget is reached."""
        distance, late = self.distances[self.agent], self.steps - self.fastest
        if distance > 0 and late < SPARE_STEPS:
            return None
        time = 1 - late / SPARE_STEPS if distance == 0 else 0.0
        return float(0.5 * time + 0.5 * (1 - distance / self.furthest))

    def _carve(self, rng: Generator) -> None:
        """Aldous-Broder: a random walk over the cells opens the wall to each cell that it enters first."""
        self.path = np.zeros((self.size, self.size), dtype=bool)
        cells = self.size // 2
        row, column = (int(k) for k in rng.integers(cells, size=2))
        self.path[2 * row + 1, 2 * column + 1] = True
        unvisited = cells * cells - 1
        while unvisited > 0:
            down, right = SIDES[rng.integers(4)]
            if not (0 <= row + down < cells and 0 <= column + right < cells):
                continue
            if not self.path[2 * (row + down) + 1, 2 * (column + right) + 1]:
                self.path[2 * row + 1 + down, 2 * column + 1 + right] = True
                self.path[2 * (row + down) + 1, 2 * (column + right) + 1] = True
                unvisited -= 1
            row, column = row + down, column + right

    def _measure_distances(self, goal: tuple[int, int]) -> None:
        """Breadth-first search for the walking distance of every path tile to the goal; -1 on walls."""
        self.distances = np.full((self.size, self.size), -1)
        self.distances[goal] = 0
        queue = deque([goal])
        while queue:
            row, column = queue.popleft()
            for down, right in SIDES:
                tile = row + down, column + right
                if self.path[tile] and self.distances[tile] < 0:
                    self.distances[tile] = self.distances[row, column] + 1
                    queue.append(tile)


class Prey:
    """One prey; its flight goes on in `direction` for `flight` more tiles."""

    def __init__(self, row: int, column: int) -> None:
        self.row, self.column = row, column
        self.direction, self.flight = (0, 0), 0


class PlainHunting:
    """Hunting on size x size open tiles; the arguments are those of `exneat_cli.tasks.Hunting`."""

    def __init__(self, *, size: int, n_prey: int, steps: int, p_e: float, p_c: float, p_m: float) -> None:
        self.size, self.n_prey, self.max_steps = size, n_prey, steps
        self.p_e, self.p_c, self.p_m = p_e, p_c, p_m
        profile = np.exp(-0.5 * np.arange(-2, 3) ** 2)
        self.patch = np.outer(profile, profile)
        chances = np.arange(1, LONGEST_FLIGHT + 1) ** -2.0
        self.flight_chance = np.cumsum(chances) / chances.sum()

    def reset(self, rng: Generator) -> None:
        """Put the agent into the centre, prey on distinct other tiles, and let the first cues out."""
        self.path = np.pad(np.ones((self.size, self.size), dtype=bool), 1)
        self.signals = np.zeros((2, self.size + 2, self.size + 2))
        centre = (self.size + 2) // 2
        self.agent, self.steps = (centre, centre), 0
        tiles = [(r, c) for r, c in np.argwhere(self.path).tolist() if (r, c) != self.agent]
        self.free = [Prey(*tiles[k]) for k in rng.choice(len(tiles), self.n_prey, replace=False)]
        self._advance(rng)

    def after_move(self, rng: Generator) -> float | None:
        """Catch, then the world moves on; the share of prey caught once all are or the time is over."""
        self.free = [prey for prey in self.free if not self._is_caught(prey)]
        if self.steps < self.max_steps and self.free:
            self._advance(rng)
            if self.free:
                return None
        return 1 - len(self.free) / self.n_prey

    def _advance(self, rng: Generator) -> None:
        self.signals *= self.p_c
        free = []
        for prey in self.free:
            if self._is_caught(prey):
                continue
            if rng.random() < self.p_m:
                self._move(prey, rng)
                if self._is_caught(prey):
                    continue
            free.append(prey)
            for channel in range(2):
                self._emit(channel, prey, rng)
        self.free = free

    def _is_caught(self, prey: Prey) -> bool:
        return (prey.row, prey.column) == self.agent

    def _move(self, prey: Prey, rng: Generator) -> None:
        """One tile of a Levy flight; a wall ends the flight."""
        if prey.flight == 0:
            prey.direction = SIDES[rng.integers(4)]
            prey.flight = 1 + int(np.searchsorted(self.flight_chance, rng.random()))
        row, column = prey.row + prey.direction[0], prey.column + prey.direction[1]
        if self.path[row, column]:
            prey.row, prey.column = row, column
            prey.flight -= 1
        else:
            prey.flight = 0

    def _emit(self, channel: int, prey: Prey, rng: Generator) -> None:
        """Add a 5 x 5 patch, or the same values in random order; walls get nothing."""
        patch = self.patch
        if rng.random() >= self.p_e:
            patch = rng.permutation(patch.ravel()).reshape(patch.shape)
        top, left = prey.row - 2, prey.column - 2
        first_row, last_row = max(top, 1), min(top + 4, self.size)
        first_column, last_column = max(left, 1), min(left + 4, self.size)
        self.signals[channel, first_row : last_row + 1, first_column : last_column + 1] += patch[
            first_row - top : last_row + 1 - top, first_column - left : last_column + 1 - left
        ]
