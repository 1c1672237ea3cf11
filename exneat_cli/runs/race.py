"""Which of several teams is the best on validation episodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from exneat_cli.brains import Brains
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.seeding import EpisodeSeeds

FIRST_ROUND = 2
"""Episodes per team in the first round of a race."""


def race(
    runner: Runner, brains: Sequence[Brains], episodes: Sequence[EpisodeSeeds], first: int = FIRST_ROUND
) -> tuple[int, list[Outcomes]]:
    """Let brains race by successive halving: the better half of a round continues with twice as many episodes.

    A few episodes are enough to drop the worst brains; only the last ones run all. Source: Karnin, Koren and Somekh,
    "Almost optimal exploration in multi-armed bandits", ICML 2013.

    Args:
        runner: runs the episodes.
        brains: at least one, each of a single team.
        episodes: the same for all brains; each round runs the next ones, in this order.
        first: number of episodes in the first round; with all of them there is only one round.

    Returns:
        The index of the brain with the best mean (the first of equals), and each brain's outcomes until it was dropped.
    """
    got: list[list[Outcomes]] = [[] for _ in brains]
    running, done, to = list(range(len(brains))), 0, min(first, len(episodes))
    while True:
        outcomes: Any = runner.run([brains[k] for k in running], episodes[done:to])
        for row, k in enumerate(running):
            got[k].append(Outcomes(*(figures[row : row + 1] for figures in outcomes[:4])))
        running.sort(key=lambda k: (-float(_joined(got[k]).fitness.mean()), k))
        if to == len(episodes):
            break
        running = sorted(running[: (len(running) + 1) // 2])
        done, to = to, min(2 * to, len(episodes))
    return running[0], [_joined(parts) for parts in got]


def _joined(parts: Sequence[Outcomes]) -> Outcomes:
    """All episodes of one brain."""
    figures: Any = [np.concatenate(each, axis=1) for each in zip(*(part[:4] for part in parts), strict=True)]
    return Outcomes(*figures)
