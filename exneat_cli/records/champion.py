"""champion.json and hall_of_fame.jsonl: teams as data, readable without exneat; what they hold is in docs/champion.md.

A champion may come from a stranger: nothing in it is run, and compiled code may trust what `read_champion` returns.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from exneat_cli.algorithms import ACTIVATIONS, ArrayGenome, Candidate
from exneat_cli.algorithms.neat.conversion import check_genes, check_genome
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE
from exneat_cli.brains import Brains, assemble
from exneat_cli.errors import ConfigError, ExneatError, check_real, check_whole
from exneat_cli.records.files import write_whole
from exneat_cli.records.manifest import Score
from exneat_cli.records.plain import Real, Word, build, converted, read_json
from exneat_cli.wiring import Pin, Plan

CHAMPION_FORMAT = 3
_LARGEST, _MOST_MODULES = 1_000_000, 1000
_UNSHOWN = r"\x00-\x1f\x7f-\xa0\u200b-\u200f\u2028-\u202f\u2060-\u206f\ud800-\udfff"
_Name = Annotated[str, Meta(pattern=rf"^[^{_UNSHOWN}]{{1,200}}\Z")]
"""The name of a part, a sensor or an actuator, without characters that control a terminal."""
_Id = Annotated[int, Meta(ge=0, le=2**62)]


class Node(Struct, frozen=True, forbid_unknown_fields=True):
    """An output, from 0 on, or a hidden node: activation(bias + response * sum of weighted inputs)."""

    id: _Id
    bias: Real
    response: Real
    activation: Annotated[str, Meta(pattern=rf"^({'|'.join(ACTIVATIONS)})\Z")]


class Connection(Struct, frozen=True, forbid_unknown_fields=True, rename={"source": "from", "target": "to"}):
    """From a node, or from pin k as -1 - k, to a node."""

    source: Annotated[int, Meta(ge=-_LARGEST, le=2**62)]
    target: _Id
    weight: Real
    enabled: bool
    innovation: _Id


class Genome(Struct, frozen=True, forbid_unknown_fields=True):
    """The network of all modules of one subpopulation."""

    id: _Id
    nodes: Annotated[tuple[Node, ...], Meta(min_length=1, max_length=_LARGEST)]
    connections: Annotated[tuple[Connection, ...], Meta(max_length=_LARGEST)]

    @classmethod
    def of(cls, genome: ArrayGenome) -> Genome:
        """The genome as data; `in_arrays` converts it back."""
        nodes = [Node(key, bias, response, ACTIVATIONS[a]) for key, bias, response, a in genome.nodes.tolist()]
        connections = [
            Connection(source, target, weight, bool(enabled), innovation)
            for target, source, innovation, weight, enabled in genome.connections.tolist()
        ]
        return cls(genome.key, tuple(nodes), tuple(connections))

    def in_arrays(self) -> ArrayGenome:
        """The genome as algorithms and brains know it.

        Raises:
            ValueError: a node or connection comes twice, or a connection has an end that does not exist.
        """
        nodes = [(each.id, each.bias, each.response, ACTIVATIONS.index(each.activation)) for each in self.nodes]
        connections = [(c.target, c.source, c.innovation, c.weight, c.enabled) for c in self.connections]
        genome = ArrayGenome(self.id, np.array(sorted(nodes), NODE), np.array(sorted(connections), CONNECTION))
        check_genes(genome)
        return genome


class Scores(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """The scores of a champion; one that was put together by hand may lack the first two."""

    training: dict[Word, Real] | None = None
    validation: Score | None = None
    test: Score


class Champion(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The team that a run produces: all that is needed to run it, one genome per subpopulation."""

    format: int = CHAMPION_FORMAT
    variant: Word
    task: dict[Word, Any]
    sensors: Annotated[tuple[_Name, ...], Meta(max_length=_LARGEST)]
    actuators: Annotated[tuple[_Name, ...], Meta(max_length=_LARGEST)]
    feed_forward: bool
    scores: Scores
    plan: Plan
    genomes: tuple[Genome, ...]

    def brain(self) -> Brains:
        """The runnable network."""
        return assemble(self.plan, [[genome.in_arrays() for genome in self.genomes]], feed_forward=self.feed_forward)

    def name_of(self, pin: Pin) -> str:
        """What a pin reads, in words, e.g. ``hip_1 position (rad)``, ``hidden 0 of front_left``."""
        if pin.is_sensor:
            return self.sensors[pin.index]
        return f"{self.plan.kind_of(pin)} {self.node_name(pin)} of {self.plan.modules[pin.module].name}"

    def node_name(self, pin: Pin) -> str:
        """The node that a link reads: an output by what it drives, if anything; others by number, each kind from 0."""
        source, index = self.plan.modules[pin.module], pin.index
        if index < len(source.drives):
            return self.actuators[source.drives[index]]
        return str(index - source.outputs if index >= source.outputs else index)


def read_champion(path: Path) -> Champion:
    """Read a champion, and check that its parts fit together.

    Raises:
        ExneatError: the file is missing or damaged, of another format, or a field is missing, unknown or unusable.
    """
    champion, content = read_json(path, Champion, CHAMPION_FORMAT)
    try:
        build(Plan, content["plan"], "plan.")  # msgspec knows its types, and lets unknown fields of dataclasses pass
        _check(champion)
    except (ExneatError, ValueError) as error:
        raise ExneatError(f"{path}: damaged: {error}") from error
    return champion


def _check(champion: Champion) -> None:
    """Refuse what types cannot express: sizes out of bounds, and parts that do not fit together."""
    plan, genomes = champion.plan, champion.genomes
    check_whole("plan.observation_size", plan.observation_size, 1, _LARGEST)
    check_whole("plan.observation_size", plan.observation_size, len(champion.sensors), len(champion.sensors))
    check_whole("plan.action_size", plan.action_size, len(champion.actuators), len(champion.actuators))
    check_whole("number of modules", len(plan.modules), 1, _MOST_MODULES)
    for k, module in enumerate(plan.modules):
        key = f"plan.modules[{k}]"
        converted(module.name, _Name, f"{key}.name")
        check_whole(f"{key}.outputs", module.outputs, 1, _LARGEST)
        check_whole(f"{key}.hidden", module.hidden, 0, _LARGEST)
        for coordinate in module.position:
            check_real(f"{key}.position", coordinate, -1e6, 1e6)
        for p, pin in enumerate(module.pins):
            check_whole(f"{key}.pins[{p}].module", pin.module, -1, len(plan.modules) - 1)
    plan.check()
    shapes = plan.subpopulation_shapes
    if len(genomes) != len(shapes):
        raise ConfigError("genomes", f"{len(shapes)} of them, one for each subpopulation", len(genomes))
    for genome, (inputs, _, outputs) in zip(genomes, shapes, strict=True):
        check_genome(genome.in_arrays(), inputs, outputs, feed_forward=champion.feed_forward)


def write_hall_of_fame(path: Path, entries: Sequence[Candidate], validation: Sequence[Score]) -> None:
    """Write one line per team, sorted by the number of validation episodes, then by mean fitness, largest first.

    Raises:
        ExneatError: the file cannot be written.
    """
    pairs = zip(entries, validation, strict=True)
    ranked = sorted(pairs, key=lambda pair: (-pair[1].episodes, -pair[1].fitness_mean))
    lines = [
        {
            "rank": rank,
            "generation": entry.generation + 1,
            "training_fitness": entry.fitness,
            "validation_fitness": score.fitness_mean,
            "validation_episodes": score.episodes,
            "genomes": [msgspec.to_builtins(Genome.of(genome)) for genome in entry.team.genomes],
        }
        for rank, (entry, score) in enumerate(ranked, start=1)
    ]
    write_whole(path, "".join(json.dumps(line, allow_nan=False) + "\n" for line in lines))
