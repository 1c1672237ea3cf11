"""Which genomes form a team: those at the same position in the orders of their subpopulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from numpy.random import Generator

PAIRINGS = ("rank", "parents", "index")
"""``rank`` pairs survivors in the order of their teams' fitness, so that the best team stays together, and offspring at
random; ``parents`` pairs offspring whose first parents formed a team, as far as possible; ``index`` pairs in
neat-python's own order."""


def by_rank(orders: Sequence[Sequence[int]], ranked: Sequence[tuple[int, ...]], rng: Generator) -> list[list[int]]:
    """Orders of genomes' ids: survivors first, in the order of the last teams, then offspring in random order.

    Args:
        orders: all ids of each subpopulation.
        ranked: ids of the last generation's teams, the best first.
        rng: generator of the random order.
    """
    changed = []
    for index, ids in enumerate(orders):
        there, before = set(ids), {team[index] for team in ranked}
        offspring = [key for key in ids if key not in before]
        shuffled = [offspring[i] for i in rng.permutation(len(offspring))]
        changed.append([team[index] for team in ranked if team[index] in there] + shuffled)
    return changed


def with_siblings(
    orders: Sequence[Sequence[int]], ranked: Sequence[tuple[int, ...]], first_parents: Sequence[Mapping[int, int]]
) -> list[list[int]]:
    """The same orders, except that offspring of later subpopulations move to the positions of siblings in the first.

    Siblings are genomes whose first parents formed a team; survivors keep their positions.

    Args:
        orders: from `by_rank`.
        ranked: ids of the last generation's teams, the best first.
        first_parents: for each subpopulation, offspring's ids -> ids of their first parents.
    """
    teams = [{ids[index]: k for k, ids in enumerate(ranked)} for index in range(len(orders))]
    lines = [
        {key: own[parent] for key, parent in parents.items()} for own, parents in zip(teams, first_parents, strict=True)
    ]
    wanted = [lines[0].get(key) for key in orders[0]]
    changed = [list(orders[0])]
    for own, line_of, order in zip(teams[1:], lines[1:], orders[1:], strict=True):
        offspring = [key for key in order if key not in own]
        first = len(order) - len(offspring)
        waiting: dict[int | None, list[int]] = {}
        for key in offspring:
            waiting.setdefault(line_of.get(key), []).append(key)
        placed = [waiting[line].pop(0) if waiting.get(line) else None for line in wanted[first:]]
        others = iter([key for key in offspring if key not in placed])
        changed.append([*order[:first], *(next(others) if key is None else key for key in placed)])
    return changed
