"""From teams and a wiring plan to brains, a whole generation at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import ArrayGenome
from exneat_cli.algorithms.neat.structure import row_of
from exneat_cli.brains.brain import Brain, Brains
from exneat_cli.brains.expression import express
from exneat_cli.brains.wiring_arrays import WiringArrays, wiring_arrays
from exneat_cli.compiling import compiled
from exneat_cli.wiring import Plan


def assemble(plan: Plan, genomes: Sequence[ArrayGenome], *, feed_forward: bool) -> Brain:
    """Compile one genome per subpopulation into the brain that `plan` wires.

    Args:
        plan: who senses and drives what; must have at least one module.
        genomes: indexed by subpopulation; sharing modules each get a copy of the network.
        feed_forward: whether the modules are feed-forward networks, else recurrent ones.

    Raises:
        ValueError: a connection of a genome has an end that does not exist, or the number of genomes is wrong.
    """
    return assemble_all(plan, [genomes], feed_forward=feed_forward).first()


def assemble_all(plan: Plan, teams: Sequence[Sequence[ArrayGenome]], *, feed_forward: bool) -> Brains:
    """The brains of several teams, at least one; see `assemble`."""
    wiring = wiring_arrays(plan)
    members = len(wiring.shapes)
    if any(len(team) != members for team in teams):
        raise ValueError(f"assemble: expected {members} genomes per team, got {sorted({len(team) for team in teams})}")
    networks = express(wiring, [genome for team in teams for genome in team], feed_forward=feed_forward)
    slots, evaluated, connections = (
        each.reshape(-1, members)[:, wiring.subpopulation]
        for each in (networks.slots, networks.evaluated, np.diff(networks.first_connection))
    )
    bases = np.full((len(teams), len(wiring.subpopulation) + 1), wiring.observation_size)
    bases[:, 1:] += np.cumsum(slots, axis=1)
    # In a feed-forward brain a delayed pin reads a copy that is made at the step's start; in a recurrent one every
    # slot still holds the previous step's value anyway.
    copied = wiring.pin_delayed & feed_forward
    pin_slot, link_slot, link_source = _pin_slots(wiring, bases, copied)
    size = bases[:, -1] + link_slot.shape[1] + 1
    output_slot = np.where(wiring.driver < 0, size[:, None] - 1, bases[:, wiring.driver] + wiring.driver_output)
    nodes, most_edges = int(evaluated.sum()), int(connections.sum())
    brains = Brains(
        observation_size=plan.observation_size,
        size=size,
        recurrent=np.full(len(teams), not feed_forward),
        first_node=np.cumsum([0, *evaluated.sum(axis=1)]),
        first_link=np.arange(len(teams) + 1) * link_slot.shape[1],
        node_slot=np.zeros(nodes, np.int64),
        edge_start=np.zeros(nodes + 1, np.int64),
        edge_source=np.zeros(most_edges, np.int64),
        edge_weight=np.zeros(most_edges),
        bias=np.zeros(nodes),
        response=np.zeros(nodes),
        activation=np.zeros(nodes, np.int64),
        link_slot=link_slot.ravel(),
        link_source=link_source.ravel(),
        output_slot=np.ascontiguousarray(output_slot),
    )
    edges = _fill(wiring, networks, bases, pin_slot, brains)
    return brains._replace(edge_source=brains.edge_source[:edges], edge_weight=brains.edge_weight[:edges])


def _pin_slots(
    wiring: WiringArrays, bases: NDArray[np.int64], copied: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The slot that each pin reads, (T, P), and those that copies are made into and of, (T, L) each."""
    # One memory layout, whatever the number of teams: compiled code is compiled for each.
    pin_slot = np.ascontiguousarray(np.where(wiring.pin_module < 0, 0, bases[:, wiring.pin_module]) + wiring.pin_index)
    link_source = pin_slot[:, copied]
    link_slot = bases[:, -1:] + np.arange(np.count_nonzero(copied))
    pin_slot[:, copied] = link_slot
    return pin_slot, link_slot, link_source


@compiled
def _fill(wiring, networks, bases, pin_slot, brains):  # type: ignore[no-untyped-def]
    """Write nodes and edges of `brains`; returns the number of edges.

    Args:
        wiring: the plan, of M modules and P pins.
        networks: of all teams.
        bases: (T, M + 1) the first slot of each module.
        pin_slot: (T, P) the slot that each pin reads.
        brains: whose other fields are filled, with room for all edges.
    """
    node = edge = 0
    for t in range(bases.shape[0]):
        for m in range(wiring.subpopulation.size):
            g = t * wiring.hidden_is_linked.size + wiring.subpopulation[m]
            pins = pin_slot[t, wiring.first_pin[m] : wiring.first_pin[m + 1]]
            first_node, first_connection = networks.first_node[g], networks.first_connection[g]
            connections = networks.connections[first_connection : networks.first_connection[g + 1]]
            base = bases[t, m] - pins.size
            for row in networks.order[first_node : first_node + networks.evaluated[g]]:
                gene = networks.nodes[first_node + row]
                brains.node_slot[node] = base + networks.slot_of[first_node + row]
                brains.bias[node] = gene.bias
                brains.response[node] = gene.response
                brains.activation[node] = gene.activation
                i = row_of(connections, gene.key, -pins.size)
                while i < connections.size and connections[i].target == gene.key:
                    if connections[i].enabled:
                        source = networks.source_of[first_connection + i]
                        brains.edge_source[edge] = pins[source] if source < pins.size else base + source
                        brains.edge_weight[edge] = connections[i].weight
                        edge += 1
                    i += 1
                node += 1
                brains.edge_start[node] = edge
    return edge
