"""A champion as an ONNX graph in double precision: frames and signs are inside; its memory is an input and an output.

Inputs are ``observation``, (N, readings), for N robots at once, and, if the networks remember, ``state``, (N, values),
all 0 when an episode begins. Outputs are ``controls``, (N, actuators), and ``next_state``, the ``state`` of the next
step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.errors import ExneatError
from exneat_cli.records.champion import Champion
from exneat_cli.records.exports.portable import Plain, adapter_of, portable
from exneat_cli.tasks import Task

OPSET, IR_VERSION = 17, 8
"""From 2022, so that older runtimes support them."""


def files(champion: Champion, task: Task, evolution: EvolutionSettings) -> dict[str, bytes]:
    """The file's content; see `exneat_cli.records.exports.exported`.

    Raises:
        ExneatError: onnx is not installed.
    """
    try:
        import onnx
    except ImportError as error:
        raise ExneatError(f"format=onnx: expected onnx, got: {error}\n  pip install 'exneat[onnx]'") from error
    data, graph = portable(champion, task), _Graph(onnx)
    state = _remembered(data, champion.plan.observation_size)
    controls, values = _step(graph, data, state)
    outputs = {"controls": (graph.node("Identity", controls, name="controls"), len(data["output_slots"]))}
    inputs = {"observation": data["observation_size"]}
    if state:
        inputs["state"] = len(state)
        kept = graph.picked(values.joined(), [values.places[slot] for slot in state])
        outputs["next_state"] = graph.node("Identity", kept, name="next_state"), len(state)
    info = [(name, size) for name, (_, size) in outputs.items()]
    model = graph.model(list(inputs.items()), info)
    notes = {"readings": adapter_of(task).readings, "actuators": task.actuator_names}
    onnx.helper.set_model_props(model, {key: "\n".join(names) for key, names in notes.items()})
    onnx.checker.check_model(model, full_check=True)
    return {"": model.SerializeToString()}


def _remembered(data: Plain, sensed: int) -> list[int]:
    """Slots whose values of the previous step are read in this one: of links, and all nodes of a recurrent network."""
    written: set[int] = set()
    read = set(data["link_sources"])
    for layer in data["layers"]:
        read |= {slot for slot in layer["source"] if slot >= sensed and slot not in written}
        written |= set(layer["slots"])
    return sorted((read - set(data["link_slots"])) & written)


class _Graph:
    """The nodes and constants of a graph so far; values go by name."""

    def __init__(self, onnx: Any) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def node(self, operator: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        """Add an operator; returns what it gives."""
        name = name or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(self.onnx.helper.make_node(operator, list(inputs), [name], **attributes))
        return name

    def constant(self, values: ArrayLike, kind: Any = np.float64) -> str:
        """Add numbers; returns their name."""
        name = f"constant_{len(self.constants)}"
        self.constants.append(self.onnx.numpy_helper.from_array(np.array(values, kind), name))
        return name

    def picked(self, values: str, entries: Sequence[int] | NDArray[np.int64], axis: int = 1) -> str:
        """Entries of values along an axis."""
        return self.node("Gather", values, self.constant(entries, np.int64), axis=axis)

    def columns(self, values: str, first: int, count: int = 1) -> str:
        """(N, count) neighbours among the columns of values."""
        return self.picked(values, np.arange(first, first + count))

    def shaped(self, values: str, *shape: int) -> str:
        """Values in another shape; the first size is that of the batch."""
        return self.node("Reshape", values, self.constant([-1, *shape], np.int64))

    def model(self, inputs: Sequence[tuple[str, int]], outputs: Sequence[tuple[str, int]]) -> Any:
        """The whole, from so many numbers of each input to those of each output."""
        helper, double = self.onnx.helper, self.onnx.TensorProto.DOUBLE
        ends = [
            [helper.make_tensor_value_info(name, double, ["N", size]) for name, size in each]
            for each in (inputs, outputs)
        ]
        graph = helper.make_graph(self.nodes, "champion", *ends, self.constants)
        opset = [helper.make_opsetid("", OPSET)]
        return helper.make_model(graph, opset_imports=opset, ir_version=IR_VERSION, producer_name="exneat")


class _Values:
    """What nodes can read at the moment: pieces, each (N, size), side by side, and the column of each slot."""

    def __init__(self, graph: _Graph, sensed: str, size: int) -> None:
        self.graph, self.pieces, self.width = graph, [sensed], size
        self.places = {slot: slot for slot in range(size)}

    def add(self, piece: str, slots: Sequence[int]) -> None:
        """Put values beside the others; slots that had values have these from now on."""
        self.pieces.append(piece)
        self.places |= {slot: self.width + k for k, slot in enumerate(slots)}
        self.width += len(slots)

    def joined(self) -> str:
        """All of them, (N, width)."""
        if len(self.pieces) > 1:
            self.pieces = [self.graph.node("Concat", *self.pieces, axis=1)]
        return self.pieces[0]


def _step(graph: _Graph, data: Plain, state: Sequence[int]) -> tuple[str, _Values]:
    """The controls of a step, and all values at its end."""
    observation = "observation"
    if data["limits"]:
        observation = graph.node("Clip", observation, *map(graph.constant, data["limits"]))
    sensed = _sensed(graph, data["frames"], observation)
    size = len(data["frames"]["pick"]) if data["frames"] else data["observation_size"]
    values = _Values(graph, sensed, size)
    # A slot that is never written holds 0, such as that of an actuator that nothing drives.
    zero = graph.node("Mul", graph.columns(observation, 0), graph.constant(0.0))
    values.add(zero, [-1])
    if state:
        values.add("state", state)
    nothing = values.places[-1]
    links = zip(data["link_slots"], data["link_sources"], strict=True)
    values.places |= {slot: values.places.get(source, nothing) for slot, source in links}
    for layer in data["layers"]:
        _add_layer(graph, values, layer, nothing)
    action = graph.picked(values.joined(), [values.places.get(slot, nothing) for slot in data["output_slots"]])
    action = graph.node("Mul", action, graph.constant(data["action_signs"]))
    if data["bounded"]:
        action = graph.node("Clip", action, graph.constant(-1.0), graph.constant(1.0))
    scaled = graph.node("Mul", action, graph.constant(data["span"]))
    return graph.node("Add", scaled, graph.constant(data["middle"])), values


def _add_layer(graph: _Graph, values: _Values, layer: Plain, nothing: int) -> None:
    """Evaluate a layer's nodes, those of each activation together."""
    source, width = values.joined(), values.width
    weights = np.zeros((width, len(layer["slots"])))
    for target, slot, weight in zip(layer["target"], layer["source"], layer["weight"], strict=True):
        weights[values.places.get(slot, nothing), target] += weight
    names, response, bias = np.array(layer["activation"]), np.array(layer["response"]), np.array(layer["bias"])
    added = []
    for name in np.unique(names):
        chosen = np.flatnonzero(names == name)
        total = graph.node("MatMul", source, graph.constant(weights[:, chosen] * response[chosen]))
        added.append((_activated(graph, name, graph.node("Add", total, graph.constant(bias[chosen]))), chosen))
    for piece, chosen in added:
        values.add(piece, [layer["slots"][k] for k in chosen])


def _activated(graph: _Graph, name: str, z: str) -> str:
    """neat-python's functions, see `exneat_cli.brains.brain`."""
    if name == "identity":
        return z
    if name == "relu":
        return graph.node("Relu", z)
    if name == "clamped":
        return graph.node("Clip", z, graph.constant(-1.0), graph.constant(1.0))
    steep = graph.node("Mul", z, graph.constant(2.5 if name == "tanh" else 5.0))
    steep = graph.node("Clip", steep, graph.constant(-60.0), graph.constant(60.0))
    return graph.node("Tanh" if name == "tanh" else "Sigmoid", steep)


def _sensed(graph: _Graph, frames: Plain | None, readings: str) -> str:
    """(N, sensed) from readings, as `Champion.sense` of `exneat_cli.records.exports.standalone` does it."""
    if frames is None:
        return readings
    count, moves = len(frames["moves"]), np.array(frames["moves"])
    back = moves.transpose(0, 2, 1)
    rotation = _rotation(graph, frames, readings)  # (N, 3, 3) from the trunk's axes to the world's
    world = graph.shaped(graph.node("Transpose", rotation, perm=[0, 2, 1]), 1, 3, 3)
    turn = graph.node("MatMul", graph.constant(back[None]), world)  # (N, frames, 3, 3)
    velocity = graph.node("MatMul", graph.picked(readings, frames["velocities"]), graph.constant(frames["axes"]))
    if frames["free"]:
        spin = graph.columns(readings, frames["spin"], 3)
    else:
        spin = graph.node("Mul", graph.columns(readings, frames["spin"]), graph.constant([frames["hinge"]]))
    along = graph.node("MatMul", turn, graph.shaped(velocity, 1, 3, 1))
    # (3, 3 frames): each column is an axis of a frame, seen from the trunk.
    handed = (back * np.array(frames["handedness"])[:, None, None]).reshape(3 * count, 3).T
    height = graph.columns(readings, frames["height"])
    seen = [
        readings,
        graph.node("Add", height, graph.constant(frames["above"])),
        graph.node("Neg", graph.shaped(graph.picked(turn, [2], axis=3), 3 * count)),
        graph.shaped(graph.picked(turn, [0], axis=3), 3 * count),
        graph.shaped(along, 3 * count),
        graph.node("MatMul", spin, graph.constant(handed)),
    ]
    if vectors := len(frames["vector_from"]):
        entries = (np.array(frames["vector_from"])[:, None] + np.arange(3)).ravel()
        turned = graph.picked(turn, frames["vector_frame"])
        own = graph.node("MatMul", turned, graph.shaped(graph.picked(readings, entries), vectors, 3, 1))
        signs = graph.constant(np.repeat(frames["vector_sign"], 3))
        seen.append(graph.node("Mul", graph.shaped(own, 3 * vectors), signs))
    picked = graph.picked(graph.node("Concat", *seen, axis=1), frames["pick"])
    return graph.node("Mul", picked, graph.constant(frames["sign"]))


def _rotation(graph: _Graph, frames: Plain, readings: str) -> str:
    """(N, 3, 3) from the trunk's axes to the world's: R = 1 + 2 w [v] + 2 [v]^2, [v] being v's cross product."""
    if frames["free"]:
        quaternion = graph.columns(readings, frames["orientation"], 4)
        squares = graph.node("Mul", quaternion, quaternion)
        sum_of_squares = graph.node("ReduceSum", squares, graph.constant([1], np.int64), keepdims=1)
        length = graph.node("Sqrt", sum_of_squares)
        is_none = graph.node("Equal", length, graph.constant(0.0))
        length = graph.node("Where", is_none, graph.constant(1.0), length)
        unit = graph.node("Div", quaternion, length)
        w, v = graph.columns(unit, 0), graph.columns(unit, 1, 3)  # without a direction R is 1, whatever w
    else:
        half = graph.node("Mul", graph.columns(readings, frames["orientation"]), graph.constant(0.5))
        w, v = graph.node("Cos", half), graph.node("Mul", graph.node("Sin", half), graph.constant([frames["hinge"]]))
    cross = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[i, k, j], cross[i, j, k] = 1.0, -1.0
    product = graph.shaped(graph.node("MatMul", v, graph.constant(cross.reshape(3, 9))), 3, 3)
    doubled = graph.node("Mul", product, graph.constant(2.0))
    linear = graph.node("Mul", doubled, graph.shaped(w, 1, 1))
    return graph.node(
        "Add", graph.constant(np.eye(3)[None]), graph.node("Add", linear, graph.node("MatMul", doubled, product))
    )
