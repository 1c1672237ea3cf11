"""What each part senses in its own frame: its joints with their signs, and the trunk as seen from the part.

Readings are in the world's axes, except for the angular velocity of a free trunk, which MuJoCo gives in the trunk's
axes. Alike parts that share a network must see the same numbers in the same situation: joints take the signs that
`likeness` finds, vectors are turned or mirrored into the part's frame, and pseudovectors (torques, angular velocities)
also change their sign if the frame is mirrored.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.compiling import compiled

VIEW = (
    ("trunk height", "m", -1, False),
    *(("direction of gravity", "", axis, False) for axis in range(3)),
    *(("direction of travel", "", axis, False) for axis in range(3)),
    *(("trunk velocity", "m/s", axis, False) for axis in range(3)),
    *(("trunk angular velocity", "rad/s", axis, True) for axis in range(3)),
)
"""The 13 numbers of a view of the trunk: name, unit, axis (-1: none), whether it belongs to a pseudovector."""


class Frames(NamedTuple):
    """Which readings become which sensed values, for compiled code.

    S readings only take a sign, V triples are vectors in the world's axes, and the trunk is seen from F frames.
    """

    height: int  #: reading of the trunk's height; -1 if it has none
    above: float  #: m to add to it
    orientation: int  #: reading of a free trunk's quaternion, or of a planar trunk's angle
    free: bool
    hinge: NDArray[np.float64]  #: (3,) axis that a planar trunk turns about
    velocities: NDArray[np.int64]  #: readings of the trunk's velocities along `axes`
    axes: NDArray[np.float64]  #: (velocities, 3) in the world
    spin: int  #: first reading of the angular velocity
    moves: NDArray[np.float64]  #: (F, 3, 3) from each frame's axes to the trunk's
    views: NDArray[np.int64]  #: (F, 13) sensed value of each number in `VIEW`; -1: none
    scalar_from: NDArray[np.int64]  #: (S,)
    scalar_to: NDArray[np.int64]
    scalar_sign: NDArray[np.float64]
    vector_from: NDArray[np.int64]  #: (V,) first of three
    vector_to: NDArray[np.int64]
    vector_frame: NDArray[np.int64]
    vector_is_pseudo: NDArray[np.bool_]
    action_signs: NDArray[np.float64]  #: (A,)


@compiled
def sense_in_frames(frames: Frames, readings: NDArray[np.float64], sensed: NDArray[np.float64]) -> None:
    """Write the values that all parts sense in their own frames."""
    for k in range(frames.scalar_from.size):
        sensed[frames.scalar_to[k]] = frames.scalar_sign[k] * readings[frames.scalar_from[k]]
    rotation = np.empty((3, 3))  # from the trunk's axes to the world's
    _write_rotation(frames, readings, rotation)
    velocity, spin = np.zeros(3), np.zeros(3)
    for k in range(frames.velocities.size):
        for i in range(3):
            velocity[i] += frames.axes[k, i] * readings[frames.velocities[k]]
    for i in range(3):
        spin[i] = readings[frames.spin + i] if frames.free else frames.hinge[i] * readings[frames.spin]
    turn = np.empty((frames.moves.shape[0], 3, 3))  # from the world's axes to each frame's
    for f in range(frames.moves.shape[0]):
        move = frames.moves[f]
        for i in range(3):
            for j in range(3):
                turn[f, i, j] = 0.0
                for k in range(3):
                    turn[f, i, j] += move[k, i] * rotation[j, k]
        _write_view(frames, f, readings, turn[f], velocity, spin, sensed)
    for v in range(frames.vector_from.size):
        f = frames.vector_frame[v]
        sign = _handedness(frames.moves[f]) if frames.vector_is_pseudo[v] else 1.0
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += turn[f, i, j] * readings[frames.vector_from[v] + j]
            sensed[frames.vector_to[v] + i] = sign * total


@compiled
def _write_rotation(frames, readings, rotation):  # type: ignore[no-untyped-def]
    if frames.free:
        o = frames.orientation
        w, x, y, z = readings[o], readings[o + 1], readings[o + 2], readings[o + 3]
        length = np.sqrt(w * w + x * x + y * y + z * z)  # not 1 with sensor noise
        if length == 0.0:
            w, length = 1.0, 1.0
        w, x, y, z = w / length, x / length, y / length, z / length
    else:
        half = 0.5 * readings[frames.orientation]
        w = np.cos(half)
        x, y, z = np.sin(half) * frames.hinge[0], np.sin(half) * frames.hinge[1], np.sin(half) * frames.hinge[2]
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


@compiled
def _write_view(frames, f, readings, turn, velocity, spin, sensed):  # type: ignore[no-untyped-def]
    places, move = frames.views[f], frames.moves[f]
    if places[0] >= 0:
        sensed[places[0]] = readings[frames.height] + frames.above
    for i in range(3):
        along, turning = 0.0, 0.0
        for j in range(3):
            along += turn[i, j] * velocity[j]
            turning += move[j, i] * spin[j]
        if places[1 + i] >= 0:
            sensed[places[1 + i]] = -turn[i, 2]
        if places[4 + i] >= 0:
            sensed[places[4 + i]] = turn[i, 0]
        if places[7 + i] >= 0:
            sensed[places[7 + i]] = along
        if places[10 + i] >= 0:
            sensed[places[10 + i]] = _handedness(move) * turning


@compiled
def _handedness(move):  # type: ignore[no-untyped-def]
    """1 or -1: the determinant of an orthogonal matrix."""
    first = move[0, 0] * (move[1, 1] * move[2, 2] - move[1, 2] * move[2, 1])
    second = move[0, 1] * (move[1, 0] * move[2, 2] - move[1, 2] * move[2, 0])
    third = move[0, 2] * (move[1, 0] * move[2, 1] - move[1, 1] * move[2, 0])
    return first - second + third
