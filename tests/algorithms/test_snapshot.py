"""A co-evolution that goes on from a snapshot does what it would have done."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import (
    Coevolution,
    EvolutionSettings,
    HallOfFame,
    Snapshot,
    Team,
    neat_config,
    pack,
    unpack,
)
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import genes_of

SHAPE, POPULATION = (3, 2, 2), 20


def configs(settings: EvolutionSettings, subpopulations: int) -> list[Any]:
    return [neat_config(settings, POPULATION, SHAPE) for _ in range(subpopulations)]


def begun(
    settings: EvolutionSettings, subpopulations: int, generations: int
) -> tuple[Coevolution, np.random.Generator]:
    """A co-evolution that was told the fitness of so many generations, and what draws the next."""
    seeds = [stream(4, "evolution", index) for index in range(subpopulations)]
    evolution, rng = (
        Coevolution(configs(settings, subpopulations), seeds, stream(4, "pairing")),
        np.random.default_rng(0),
    )
    for _ in range(generations):
        evolution.tell(rng.integers(0, 9, len(evolution.ask())).astype(float).tolist())
    return evolution, rng


def go_on(evolution: Coevolution, rng: np.random.Generator) -> list[object]:
    """Everything that can be seen of three more generations."""
    seen: list[object] = []
    for _ in range(3):
        teams = evolution.ask()
        seen.append([[genes_of(genome) for genome in team.genomes] for team in teams])
        seen.append((evolution.species_count, evolution.extinctions))
        evolution.tell(rng.normal(size=len(teams)).tolist())
    return seen


def through_json(snapshot: Snapshot) -> Snapshot:
    return Snapshot(json.loads(json.dumps(snapshot.plain)), snapshot.genomes)


@pytest.mark.parametrize("genome", ["array", "stock"])
@pytest.mark.parametrize("stagnation", [1, 20], ids=["with extinctions", "without"])
@pytest.mark.parametrize("subpopulations", [1, 3])
def test_going_on_from_a_snapshot_is_going_on(
    ant_settings: EvolutionSettings, genome: str, stagnation: int, subpopulations: int
) -> None:
    changes = {"genome": genome, "max_stagnation": stagnation, "species_elitism": 0, "compatibility_threshold": 1.0}
    settings = EvolutionSettings(**{**vars(ant_settings), **changes, "node_add_prob": 0.4})
    for generations in (1, 2, 6):
        evolution, rng = begun(settings, subpopulations, generations)
        snapshot = through_json(evolution.snapshot())
        restored = Coevolution.restored(configs(settings, subpopulations), snapshot)
        assert go_on(restored, copy.deepcopy(rng)) == go_on(evolution, rng)


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_taking_a_snapshot_changes_nothing(ant_settings: EvolutionSettings, genome: str) -> None:
    settings = EvolutionSettings(**{**vars(ant_settings), "genome": genome})
    undisturbed, watched = begun(settings, 2, 3), begun(settings, 2, 3)
    for _ in range(3):
        watched[0].snapshot()
    assert go_on(*watched) == go_on(*undisturbed)


def test_no_snapshot_is_taken_of_a_generation_without_fitness(ant_settings: EvolutionSettings) -> None:
    evolution, _ = begun(ant_settings, 1, 1)
    evolution.ask()
    with pytest.raises(RuntimeError, match="expected ask"):
        evolution.snapshot()


def spoilt(plain: dict[str, Any], **changes: Any) -> dict[str, Any]:
    (own,) = plain["subpopulations"]
    return {**plain, "subpopulations": [{**own, **changes}]}


def test_a_snapshot_that_does_not_fit_together_is_refused(ant_settings: EvolutionSettings) -> None:
    evolution, _ = begun(ant_settings, 1, 2)
    plain, genomes = through_json(evolution.snapshot())
    (own,) = plain["subpopulations"]
    head, *others = own["species"]
    bad = [
        {**plain, "teams": plain["teams"][1:]},
        {**plain, "fitness": [*plain["fitness"][1:], float("nan")]},
        {**plain, "teams": [[0] for _ in plain["teams"]]},
        {key: value for key, value in plain.items() if key != "pairing"},
        spoilt(plain, random=[3, [1, 2, 3], None]),
        spoilt(plain, generator={"bit_generator": "MT19937"}),
        spoilt(plain, species=others),
        spoilt(plain, species=[{**head, "representative": -5}, *others]),
        spoilt(plain, species=[{**head, "members": [*head["members"], 10**6]}, *others]),
        spoilt(plain, next_node=None),
    ]
    for damaged in bad:
        with pytest.raises((AttributeError, KeyError, TypeError, ValueError)):
            Coevolution.restored(configs(ant_settings, 1), Snapshot(damaged, genomes))
    with pytest.raises(ValueError, match="expected 21 genomes, got 20"):
        Coevolution.restored([neat_config(ant_settings, 21, SHAPE)], Snapshot(plain, genomes))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("id", lambda column: np.zeros_like(column)),
        ("nodes", lambda column: column - 100),
        ("nodes", lambda column: column + 1),
        ("connections", lambda column: column[1:]),
        ("node.bias", lambda column: np.full_like(column, np.inf)),
        ("node.key", lambda column: column * 0),
        ("node.activation", lambda column: column + 4),
        ("connection.weight", lambda column: column.astype(np.float32)),
        ("connection.source", lambda column: column + 1000),
        ("connection.target", lambda column: column[::-1].copy()),
        ("connection.innovation", lambda column: column.reshape(1, -1)),
    ],
)
def test_columns_that_make_no_genomes_are_refused(ant_settings: EvolutionSettings, name: str, value: Any) -> None:
    evolution, _ = begun(ant_settings, 1, 3)
    (columns,) = evolution.snapshot().genomes
    with pytest.raises(ValueError):
        unpack({**columns, name: value(columns[name])})


def test_a_missing_column_is_refused_by_its_name(ant_settings: EvolutionSettings) -> None:
    (columns,) = begun(ant_settings, 1, 1)[0].snapshot().genomes
    del columns["connection.weight"]
    with pytest.raises(KeyError, match=r"connection\.weight"):
        unpack(columns)


def test_packed_genomes_come_back_whole(ant_settings: EvolutionSettings) -> None:
    genomes = [team.genomes[0] for team in begun(ant_settings, 1, 5)[0].ask()]
    assert [genes_of(genome) for genome in unpack(pack(genomes))] == [genes_of(genome) for genome in genomes]


def test_a_hall_of_fame_goes_on_from_its_entries() -> None:
    offers = [(key, float(100 - key % 7), key) for key in range(60)]
    one = HallOfFame()
    for number, offer in enumerate(offers):
        other = HallOfFame(one.entries)
        for hall in (one, other):
            hall.add(Team((), (offer[0] % 30,)), offer[1], number)
        assert other.entries == one.entries
