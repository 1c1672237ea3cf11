"""Assembles brains from teams and a wiring plan, a whole generation in one compiled call.

A genome is expressed as neat-python's own network classes would build it. Within a network, local index k below the
number of pins is a pin. The others are the slots of node values: outputs first, then the initial hidden nodes if other
modules read them, then all other nodes that are evaluated, then one slot that stays 0 and stands for the remaining
nodes.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import ArrayGenome
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE, end_to_end, mark_sources, node_row, row_of
from exneat_cli.brains.brain import Brains
from exneat_cli.compiling import compiled
from exneat_cli.wiring import Plan

NETWORK = np.dtype([("inputs", np.int64), ("read_outside", np.int64)])
"""For each subpopulation: the number of pins of a module, and how many of its first nodes are read from outside (the
outputs and, if they are linked, the initial hidden nodes)."""
PIN = np.dtype([("index", np.int64), ("module", np.int64), ("delayed", np.bool_)], align=True)
"""As in `exneat_cli.wiring.Pin`."""
ACTUATOR = np.dtype([("module", np.int64), ("output", np.int64)])
"""The module that sets the actuator, -1 for none, and the number of its output."""
Place = tuple[int, int]
"""A module, and the key of a node in its genome, or -1 - k for its pin k."""


@functools.lru_cache(maxsize=16)
def wiring_tables(plan: Plan) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """A plan for compiled code: (S,) networks, (M,) subpopulations of modules, (P,) all pins, (A,) actuators."""
    networks = np.zeros(len(plan.subpopulation_shapes), NETWORK)
    actuators = np.array([(-1, 0)] * plan.action_size, ACTUATOR)
    for m, module in enumerate(plan.modules):
        read_outside = module.outputs + (module.hidden if plan.hidden_is_linked(m) else 0)
        networks[module.subpopulation] = len(module.pins), read_outside
        for output, actuator in enumerate(module.drives):
            actuators[actuator] = m, output
    subpopulation = np.array([module.subpopulation for module in plan.modules], np.int64)
    pins = [(pin.index, pin.module, pin.delayed) for module in plan.modules for pin in module.pins]
    return networks, subpopulation, np.array(pins, PIN), actuators


def assemble(plan: Plan, teams: Sequence[Sequence[ArrayGenome]], *, feed_forward: bool) -> Brains:
    """Compile each team into a brain wired according to `plan`.

    Args:
        plan: the wiring, with at least one module.
        teams: at least one, each with a genome per subpopulation; modules that share one each get a copy of its
            network.
        feed_forward: whether the modules are feed-forward networks; otherwise they are recurrent.

    Raises:
        ValueError: a connection of a genome has an end that does not exist, or the number of genomes is wrong.
    """
    wiring = wiring_tables(plan)
    networks, subpopulation, pins, _ = wiring
    members = len(networks)
    if any(len(team) != members for team in teams):
        raise ValueError(f"assemble: expected {members} genomes per team, got {sorted({len(team) for team in teams})}")
    genomes = [genome for team in teams for genome in team]
    nodes = end_to_end((genome.nodes for genome in genomes), NODE)
    connections = end_to_end((genome.connections for genome in genomes), CONNECTION)
    first_node = np.cumsum([0] + [len(genome.nodes) for genome in genomes])
    first_connection = np.cumsum([0] + [len(genome.connections) for genome in genomes])
    # Space for every gene of every module; unused space is cut off at the end.
    room_for_nodes, room_for_edges = (
        int(np.diff(first).reshape(-1, members)[:, subpopulation].sum()) for first in (first_node, first_connection)
    )
    brains = _room(plan, len(teams), room_for_nodes, room_for_edges, len(teams) * len(pins))
    brains.recurrent[:] = not feed_forward
    _assemble(wiring, nodes, first_node, connections, first_connection, feed_forward, brains)
    return brains.part(0, len(teams))


def _room(plan: Plan, teams: int, nodes: int, edges: int, links: int) -> Brains:
    """Brains to be filled in."""
    counts = {"size": teams, "first_node": teams + 1, "first_link": teams + 1}
    counts |= {"node_slot": nodes, "edge_start": nodes + 1, "activation": nodes}
    counts |= {"edge_source": edges, "link_slot": links, "link_source": links}
    return Brains(
        observation_size=plan.observation_size,
        recurrent=np.zeros(teams, np.bool_),
        edge_weight=np.zeros(edges),
        bias=np.zeros(nodes),
        response=np.zeros(nodes),
        output_slot=np.zeros((teams, plan.action_size), np.int64),
        **{name: np.zeros(count, np.int64) for name, count in counts.items()},
    )


def places_in_memory(plan: Plan, genomes: Sequence[ArrayGenome], *, feed_forward: bool) -> dict[Place, int]:
    """The slot of each value in a team's brain from `assemble`, except for nodes that are never evaluated.

    A delayed pin of a recurrent brain has the slot that it reads, which still holds that value before the step.
    """
    wiring = wiring_tables(plan)
    networks, subpopulation, pins, _ = wiring
    slots, found = [], []
    for genome, network in zip(genomes, networks, strict=True):
        order, slot_of = np.zeros((2, len(genome.nodes)), np.int64)
        source_of = np.zeros(len(genome.connections), np.int64)
        evaluated, count = _express(network, genome.nodes, genome.connections, feed_forward, order, slot_of, source_of)
        slots.append(count)
        found.append(
            {int(genome.nodes[row]["key"]): int(slot_of[row] - network["inputs"]) for row in order[:evaluated]}
        )
    base, pin_slot = np.zeros(len(subpopulation) + 1, np.int64), np.zeros(len(pins), np.int64)
    _give_slots(wiring, 0, np.array(slots), feed_forward, base, pin_slot, _room(plan, 1, 0, 0, len(pins)))
    nodes = {(m, key): int(base[m] + k) for m, s in enumerate(subpopulation) for key, k in found[s].items()}
    inputs = [(m, -1 - k) for m, module in enumerate(plan.modules) for k in range(len(module.pins))]
    return nodes | dict(zip(inputs, pin_slot.tolist(), strict=True))


@compiled
def _assemble(wiring, nodes, first_node, connections, first_connection, feed_forward, brains):  # type: ignore[no-untyped-def]
    """Fill in the brains of T teams of S genomes each.

    Genomes come team by team, each in the order of the subpopulations: genome g has the `nodes` from first_node[g] to
    first_node[g + 1], and `connections` likewise.
    """
    networks, subpopulation, pins, _ = wiring
    members, modules = networks.size, subpopulation.size
    # For the genes of all networks: rows in the order of evaluation, local indices of nodes and of connections'
    # sources.
    order, slot_of = np.zeros(nodes.size, np.int64), np.zeros(nodes.size, np.int64)
    source_of = np.zeros(connections.size, np.int64)
    evaluated, slots = np.zeros(members, np.int64), np.zeros(members, np.int64)
    # For one team: the first slot of each module, and the slot that each pin reads.
    base, pin_slot = np.zeros(modules + 1, np.int64), np.zeros(pins.size, np.int64)
    for t in range(brains.size.size):
        # 1. One network per genome.
        for s in range(members):
            g = t * members + s
            a, b, c, d = first_node[g], first_node[g + 1], first_connection[g], first_connection[g + 1]
            evaluated[s], slots[s] = _express(
                networks[s], nodes[a:b], connections[c:d], feed_forward, order[a:b], slot_of[a:b], source_of[c:d]
            )
        # 2. Consecutive slots for each module.
        _give_slots(wiring, t, slots, feed_forward, base, pin_slot, brains)
        # 3. Nodes and edges; modules that share a genome each get a copy.
        brains.first_node[t + 1] = brains.first_node[t]
        first_pin = 0
        for m in range(modules):
            s = subpopulation[m]
            g = t * members + s
            a, c, d = first_node[g], first_connection[g], first_connection[g + 1]
            rows, read = order[a : a + evaluated[s]], pin_slot[first_pin : first_pin + networks[s].inputs]
            _write_module(t, nodes[a:], connections[c:d], rows, slot_of[a:], source_of[c:d], read, base[m], brains)
            first_pin += networks[s].inputs


@compiled
def _give_slots(wiring, t, slots, feed_forward, base, pin_slot, brains):  # type: ignore[no-untyped-def]
    """Assign slots to the values of team `t`, and write its links and actuators.

    Network s has `slots[s]` values. Overwrites `base`, (M + 1,), with the first slot of each module, behind the sensed
    values, and `pin_slot`, (P,), with the slot that each pin reads.
    """
    _, subpopulation, pins, actuators = wiring
    base[0] = brains.observation_size
    for m in range(subpopulation.size):
        base[m + 1] = base[m] + slots[subpopulation[m]]
    # In a feed-forward brain a delayed pin reads a copy that is made at the start of the step; in a recurrent one every
    # slot still holds the previous step's value. Copies lie behind the modules.
    link, end = brains.first_link[t], base[-1]
    for p in range(pin_slot.size):
        pin_slot[p] = pins[p].index
        if pins[p].module >= 0:
            pin_slot[p] += base[pins[p].module]
        if feed_forward and pins[p].delayed:
            brains.link_slot[link], brains.link_source[link] = end, pin_slot[p]
            pin_slot[p] = end
            link += 1
            end += 1
    brains.first_link[t + 1] = link
    # The last slot stays 0, for actuators that no module drives.
    brains.size[t] = end + 1
    for k in range(actuators.size):
        module = actuators[k].module
        brains.output_slot[t, k] = end if module < 0 else base[module] + actuators[k].output


@compiled
def _write_module(t, nodes, connections, rows, slot_of, source_of, pins, base, brains):  # type: ignore[no-untyped-def]
    """Add the nodes and edges of one module to those of team `t`.

    Tables and local indices are those of its genome, `rows` are the nodes to evaluate, in order, `pins` are the slots
    that its pins read, and `base` is its first slot.
    """
    node = brains.first_node[t + 1]
    edge = brains.edge_start[node]
    for row in rows:
        gene = nodes[row]
        brains.node_slot[node] = base + slot_of[row] - pins.size
        brains.bias[node] = gene.bias
        brains.response[node] = gene.response
        brains.activation[node] = gene.activation
        i = row_of(connections, gene.key, -pins.size)
        while i < connections.size and connections[i].target == gene.key:
            if connections[i].enabled:
                local = source_of[i] - pins.size
                brains.edge_source[edge] = pins[source_of[i]] if local < 0 else base + local
                brains.edge_weight[edge] = connections[i].weight
                edge += 1
            i += 1
        node += 1
        brains.edge_start[node] = edge
    brains.first_node[t + 1] = node


@compiled
def _express(network, nodes, connections, feed_forward, order, slot_of, source_of):  # type: ignore[no-untyped-def]
    """Make the network of one genome; returns the numbers of nodes that it evaluates and of its value slots.

    Overwrites `order` with the rows of the nodes to evaluate, in order, `slot_of` with the local index of each node's
    value, and `source_of` with that of the value that each connection reads.
    """
    inputs, read_outside = network.inputs, network.read_outside
    # First, the row of the node that each connection reads, or -1 - k for pin k.
    for i in range(connections.size):
        source = connections[i].source
        source_of[i] = source if source < 0 else node_row(nodes, source)
        missing = source < -inputs or (source >= 0 and source_of[i] < 0)
        if missing or node_row(nodes, connections[i].target) < 0:
            raise ValueError("a connection of a genome has an end that does not exist")
    evaluated = _order(nodes, connections, source_of, read_outside, feed_forward, order)
    slots = read_outside
    for row in range(nodes.size):
        slot_of[row] = inputs + nodes[row].key if nodes[row].key < read_outside else -1
    for row in order[:evaluated]:
        if slot_of[row] < 0:
            slot_of[row] = inputs + slots
            slots += 1
    for row in range(nodes.size):
        if slot_of[row] < 0:
            slot_of[row] = inputs + slots
    for i in range(connections.size):
        source_of[i] = -1 - source_of[i] if source_of[i] < 0 else slot_of[source_of[i]]
    return evaluated, slots + 1


@compiled
def _order(nodes, connections, source_of, read_outside, feed_forward, order):  # type: ignore[no-untyped-def]
    """Write the rows of the nodes to evaluate to the start of `order`; returns their number.

    Wanted are the existing nodes that other modules or actuators read, and all nodes that lead to them. In a recurrent
    network, the wanted nodes that have an input are evaluated; in a feed-forward one all wanted nodes, each after those
    that it reads, except for nodes on or behind a cycle.
    """
    wanted = nodes["key"] < read_outside
    mark_sources(nodes, connections, wanted, True)
    placed = np.zeros(nodes.size, np.bool_)
    count, before = 0, -1
    while count > before:  # until a pass over all nodes places none
        before = count
        edge = 0
        for row in range(nodes.size):
            fed, ready = False, wanted[row] and not placed[row]
            while edge < connections.size and connections[edge].target == nodes[row].key:
                if connections[edge].enabled:
                    fed = True
                    ready = ready and (not feed_forward or source_of[edge] < 0 or placed[source_of[edge]])
                edge += 1
            if ready and (fed or feed_forward):
                placed[row] = True
                order[count] = row
                count += 1
    return count
