"""A champion as plain lists that need no exneat: what is sensed, networks layer by layer, and what is driven."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import ACTIVATIONS
from exneat_cli.brains import Brains
from exneat_cli.errors import ExneatError
from exneat_cli.records.champion import Champion
from exneat_cli.tasks import Adapter, HasAdapter, Task

Plain = dict[str, Any]


def portable(champion: Champion, task: Task) -> Plain:
    """Everything that `exneat_cli.records.exports.standalone.Champion` needs, as numbers, texts and lists of them.

    Values live in a vector of ``size`` entries, as in `Brains`. The nodes of a layer read what earlier layers of this
    step wrote, or the previous step; they never read each other.

    Raises:
        ExneatError: the task transforms readings or actions with code of its own.
    """
    brain, adapter = champion.brain(), adapter_of(task)
    bounded = np.isfinite(task.observation_limits[1])
    return {
        "observation_size": task.observation_size,
        "limits": [float(limit) for limit in task.observation_limits] if bounded else None,
        "frames": None if adapter.frames is None else _frames(adapter.frames, task),
        "size": int(brain.size[0]),
        "link_slots": brain.link_slot.tolist(),
        "link_sources": brain.link_source.tolist(),
        "layers": _layers(brain),
        "output_slots": brain.output_slot[0].tolist(),
        "action_signs": adapter.signs.tolist(),
        "bounded": adapter.bounded,
        "middle": adapter.middle.tolist(),
        "span": adapter.span.tolist(),
    }


def adapter_of(task: Task) -> Adapter:
    """What stands between a task's simulator and a brain; raises what `portable` raises."""
    if isinstance(task, HasAdapter):
        return task.adapter()
    simulation = task.open(training=False)
    if simulation.sense is not None or simulation.drive is not None:
        fix = "give its class a method adapter() that says as data what they do, see exneat_cli.tasks.HasAdapter"
        raise ExneatError(f"task {task.name}: has functions sense or drive, which a file cannot hold\n  {fix}")
    ones = np.ones(len(task.actuator_names))
    return Adapter(task.sensor_names, None, signs=ones, middle=0.0 * ones, span=ones, bounded=False)


def _layers(brain: Brains) -> list[Plain]:
    """The nodes of a brain in as few layers as their order allows."""
    count = len(brain.node_slot)
    depths: dict[int, int] = {}  # of the slots that this step has written so far
    depth = np.zeros(count, np.int64)
    for node in range(count):
        read = brain.edge_source[brain.edge_start[node] : brain.edge_start[node + 1]].tolist()
        if not brain.recurrent[0]:
            depth[node] = max((depths[slot] + 1 for slot in read if slot in depths), default=0)
            depths[int(brain.node_slot[node])] = int(depth[node])
    return [_layer(brain, np.flatnonzero(depth == level)) for level in range(int(depth.max(initial=-1)) + 1)]


def _layer(brain: Brains, nodes: NDArray[np.int64]) -> Plain:
    edges = [np.arange(brain.edge_start[node], brain.edge_start[node + 1]) for node in nodes]
    all_edges = np.concatenate(edges)
    return {
        "slots": brain.node_slot[nodes].tolist(),
        "activation": [ACTIVATIONS[code] for code in brain.activation[nodes]],
        "bias": brain.bias[nodes].tolist(),
        "response": brain.response[nodes].tolist(),
        "target": [row for row, own in enumerate(edges) for _ in own],
        "source": brain.edge_source[all_edges].tolist(),
        "weight": brain.edge_weight[all_edges].tolist(),
    }


def _frames(frames: Any, task: Task) -> Plain:
    """How readings become what is sensed: entry k is ``sign[k] * seen[pick[k]]``.

    What is seen: the readings, the trunk's height, then from each frame the directions of gravity and of travel and the
    trunk's velocities, then the vectors, see `exneat_cli.tasks.robots.frames.Frames`.
    """
    count, pick, sign = len(frames.moves), np.zeros(task.sensed_size, np.int64), np.ones(task.sensed_size)
    pick[frames.scalar_to], sign[frames.scalar_to] = frames.scalar_from, frames.scalar_sign
    height = task.observation_size
    for frame, places in enumerate(frames.views):
        # The height is the same in every frame; each of the four triples comes once per frame.
        seen = [height, *(height + 1 + 3 * (count * kind + frame) + axis for kind in range(4) for axis in range(3))]
        pick[places[places >= 0]] = np.array(seen)[places >= 0]
    for vector, first in enumerate(frames.vector_to):
        pick[first : first + 3] = height + 1 + 12 * count + 3 * vector + np.arange(3)
    handedness = np.sign(np.linalg.det(frames.moves))
    pseudo = frames.vector_is_pseudo
    as_they_are = ("hinge", "velocities", "axes", "moves", "vector_from", "vector_frame")
    return {
        "free": bool(frames.free),
        "orientation": int(frames.orientation),
        "height": max(0, int(frames.height)),
        "above": float(frames.above),
        "spin": int(frames.spin),
        **{name: getattr(frames, name).tolist() for name in as_they_are},
        "handedness": handedness.tolist(),
        "vector_sign": np.where(pseudo, handedness[frames.vector_frame], 1.0).tolist(),
        "pick": pick.tolist(),
        "sign": sign.tolist(),
    }
