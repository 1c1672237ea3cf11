"""From a team and a wiring plan to one brain."""

from __future__ import annotations

from collections.abc import Sequence

import neat
import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains.brain import Brain
from exneat_cli.brains.expression import Expression, express
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
    ends = plan.observation_size + np.cumsum([expression.slots for expression in expressions])
    bases = [int(end) - expression.slots for end, expression in zip(ends, expressions, strict=True)]
    links = _Links(plan, bases, first_slot=int(ends[-1]), copies=feed_forward)
    local_to_slot = [
        np.array([*links.pin_slots(module), *range(base, base + expression.slots)], dtype=np.int64)
        for module, base, expression in zip(plan.modules, bases, expressions, strict=True)
    ]
    size = int(ends[-1]) + len(links.sources) + 1
    edge_counts = np.concatenate([expression.edge_count for expression in expressions])
    return Brain(
        observation_size=plan.observation_size,
        size=size,
        recurrent=not feed_forward,
        node_slot=_joined(expressions, local_to_slot, "node_slot"),
        edge_start=np.concatenate([[0], np.cumsum(edge_counts)]).astype(np.int64),
        edge_source=_joined(expressions, local_to_slot, "edge_source"),
        edge_weight=np.concatenate([expression.edge_weight for expression in expressions]),
        bias=np.concatenate([expression.bias for expression in expressions]),
        response=np.concatenate([expression.response for expression in expressions]),
        activation=np.concatenate([expression.activation for expression in expressions]),
        link_slot=int(ends[-1]) + np.arange(len(links.sources), dtype=np.int64),
        link_source=np.array(links.sources, dtype=np.int64),
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


def _joined(expressions: list[Expression], local_to_slot: list[NDArray[np.int64]], field: str) -> NDArray[np.int64]:
    parts = [slots[getattr(e, field)] for e, slots in zip(expressions, local_to_slot, strict=True)]
    return np.concatenate(parts)


def _output_slots(plan: Plan, bases: list[int], silent: int) -> NDArray[np.int64]:
    slots = np.full(plan.action_size, silent, dtype=np.int64)
    for module, base in zip(plan.modules, bases, strict=True):
        for output, actuator in enumerate(module.drives):
            slots[actuator] = base + output
    return slots
