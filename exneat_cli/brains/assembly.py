"""From a team and a wiring plan to one brain."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import neat
import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains.brain import Brain
from exneat_cli.brains.expression import express
from exneat_cli.wiring import Module, Plan


def assemble(plan: Plan, genomes: Sequence[neat.DefaultGenome], *, feed_forward: bool) -> Brain:
    """Compile one genome per subpopulation into the brain that `plan` wires.

    Args:
        plan: who senses and drives what; must have at least one module.
        genomes: indexed by subpopulation; sharing modules each get a copy of the network.
        feed_forward: whether the modules are feed-forward networks, else recurrent ones.

    Raises:
        ExneatError: a genome uses an activation or aggregation that is not supported.
    """
    linked = {m.subpopulation: plan.hidden_is_linked(k) for k, m in enumerate(plan.modules)}
    networks = [
        express(genome, shape, feed_forward=feed_forward, hidden_is_linked=linked[index])
        for index, (genome, shape) in enumerate(zip(genomes, plan.subpopulation_shapes, strict=True))
    ]
    expressions = [networks[module.subpopulation] for module in plan.modules]
    bases = list(itertools.accumulate((each.slots for each in expressions), initial=plan.observation_size))
    links = _Links(plan, bases, first_slot=bases[-1], copies=feed_forward)
    node_slot: list[int] = []
    edge_source: list[int] = []
    for module, base, expression in zip(plan.modules, bases, expressions, strict=False):
        slot_of = [*links.pin_slots(module), *range(base, base + expression.slots)]
        node_slot += [slot_of[k] for k in expression.node_slot]
        edge_source += [slot_of[k] for k in expression.edge_source]
    size = bases[-1] + len(links.sources) + 1
    edge_counts = [count for expression in expressions for count in expression.edge_count]
    return Brain(
        observation_size=plan.observation_size,
        size=size,
        recurrent=not feed_forward,
        node_slot=np.array(node_slot, np.int64),
        edge_start=np.array([*itertools.accumulate(edge_counts, initial=0)], np.int64),
        edge_source=np.array(edge_source, np.int64),
        edge_weight=np.array([weight for each in expressions for weight in each.edge_weight], np.float64),
        bias=np.array([bias for each in expressions for bias in each.bias], np.float64),
        response=np.array([response for each in expressions for response in each.response], np.float64),
        activation=np.array([code for each in expressions for code in each.activation], np.int64),
        link_slot=np.arange(bases[-1], bases[-1] + len(links.sources), dtype=np.int64),
        link_source=np.array(links.sources, np.int64),
        output_slot=_output_slots(plan, bases, silent=size - 1),
    )


class _Links:
    """The slots that pins read.

    In a feed-forward brain a delayed pin reads a copy that is made at the step's start; in a recurrent
    one every slot still holds the previous step's value anyway.
    """

    def __init__(self, plan: Plan, bases: list[int], first_slot: int, copies: bool) -> None:
        self._plan = plan
        self._bases = bases
        self._first_slot = first_slot
        self._copies = copies
        self.sources: list[int] = []

    def pin_slots(self, module: Module) -> list[int]:
        slots = []
        for pin in module.pins:
            if pin.kind == "sensor":
                slots.append(pin.index)
                continue
            offset = pin.index if pin.kind == "output" else self._plan.modules[pin.module].outputs + pin.index
            source = self._bases[pin.module] + offset
            if pin.delayed and self._copies:
                slots.append(self._first_slot + len(self.sources))
                self.sources.append(source)
            else:
                slots.append(source)
        return slots


def _output_slots(plan: Plan, bases: list[int], silent: int) -> NDArray[np.int64]:
    slots = [silent] * plan.action_size
    for module, base in zip(plan.modules, bases, strict=False):
        for output, actuator in enumerate(module.drives):
            slots[actuator] = base + output
    return np.array(slots, np.int64)
