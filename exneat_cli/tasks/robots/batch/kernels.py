"""Kernels for a batch of W robots: the functions of `dynamics` and `frames`, in single precision.

Every sum within a world runs in a fixed order on one thread, so that results do not depend on other worlds.
"""

import warp as wp

from exneat_cli.tasks.task import FAILED, RUNNING

wp.set_module_options({"enable_backward": False})

_RUNNING, _FAILED = wp.constant(RUNNING), wp.constant(FAILED)


@wp.struct
class Sensors:
    """The readings: entries of positions and velocities, and bodies whose contact forces are read."""

    positions: wp.array(dtype=int)
    velocities: wp.array(dtype=int)
    bodies: wp.array(dtype=int)
    force_limit: float


@wp.struct
class View:
    """`exneat_cli.tasks.robots.frames.Frames`, without the joints."""

    height: int
    above: float
    orientation: int
    free: int
    hinge: wp.vec3
    velocities: wp.array(dtype=int)
    axes: wp.array(dtype=wp.vec3)
    spin: int
    moves: wp.array(dtype=wp.mat33)
    views: wp.array2d(dtype=int)
    vector_from: wp.array(dtype=int)
    vector_to: wp.array(dtype=int)
    vector_frame: wp.array(dtype=int)
    vector_is_pseudo: wp.array(dtype=int)


@wp.kernel
def reset(
    begins: wp.array(dtype=int),
    starts: wp.array2d(dtype=float),
    qpos: wp.array2d(dtype=float),
    qvel: wp.array2d(dtype=float),
    warmstart: wp.array2d(dtype=float),
    act: wp.array2d(dtype=float),
    ctrl: wp.array2d(dtype=float),
    force: wp.array2d(dtype=wp.spatial_vector),
    place: wp.array(dtype=float),
    mark: wp.array(dtype=float),
    clock: wp.array2d(dtype=int),
):
    """Reset each world with begins >= 0 to that row of `starts`: qpos, qvel, acceleration, place and x of the trunk."""
    w = wp.tid()
    row = begins[w]
    if row < 0:
        return
    k = int(0)
    for i in range(qpos.shape[1]):
        qpos[w, i] = starts[row, k]
        k += 1
    for i in range(qvel.shape[1]):
        qvel[w, i] = starts[row, k]
        k += 1
    for i in range(qvel.shape[1]):
        warmstart[w, i] = starts[row, k]
        k += 1
    place[w] = starts[row, k]
    mark[w] = starts[row, k + 1]
    for i in range(act.shape[1]):
        act[w, i] = 0.0
    for i in range(ctrl.shape[1]):
        ctrl[w, i] = 0.0
    for body in range(force.shape[1]):
        force[w, body] = wp.spatial_vector()
    clock[w, 0] = 0
    clock[w, 1] = 0


@wp.kernel
def observe(
    sensors: Sensors,
    qpos: wp.array2d(dtype=float),
    qvel: wp.array2d(dtype=float),
    force: wp.array2d(dtype=wp.spatial_vector),
    readings: wp.array2d(dtype=float),
):
    """Write one reading of one world."""
    w, k = wp.tid()
    first_velocity = sensors.positions.shape[0]
    first_force = first_velocity + sensors.velocities.shape[0]
    if k < first_velocity:
        readings[w, k] = qpos[w, sensors.positions[k]]
    elif k < first_force:
        readings[w, k] = qvel[w, sensors.velocities[k - first_velocity]]
    else:
        entry = k - first_force
        body = sensors.bodies[entry / 6]
        readings[w, k] = wp.clamp(force[w, body][entry % 6], -sensors.force_limit, sensors.force_limit)


@wp.kernel
def sense_joints(
    source: wp.array(dtype=int),
    target: wp.array(dtype=int),
    sign: wp.array(dtype=float),
    readings: wp.array2d(dtype=float),
    sensed: wp.array2d(dtype=float),
):
    """Write the sensed values that only take a sign."""
    w, k = wp.tid()
    sensed[w, target[k]] = sign[k] * readings[w, source[k]]


@wp.func
def _rotation(view: View, readings: wp.array2d(dtype=float), w: int):
    """From the trunk's axes to the world's."""
    a, b, c, d = float(1.0), float(0.0), float(0.0), float(0.0)
    if view.free != 0:
        a = readings[w, view.orientation]
        b = readings[w, view.orientation + 1]
        c = readings[w, view.orientation + 2]
        d = readings[w, view.orientation + 3]
        length = wp.sqrt(a * a + b * b + c * c + d * d)
        if length == 0.0:
            a = 1.0
            length = 1.0
        a, b, c, d = a / length, b / length, c / length, d / length
    else:
        half = 0.5 * readings[w, view.orientation]
        a = wp.cos(half)
        b = wp.sin(half) * view.hinge[0]
        c = wp.sin(half) * view.hinge[1]
        d = wp.sin(half) * view.hinge[2]
    return wp.mat33(
        1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c),
        2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b),
        2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c),
    )  # fmt: skip


@wp.kernel
def sense_trunk(view: View, readings: wp.array2d(dtype=float), sensed: wp.array2d(dtype=float)):
    """Write the trunk and the contact forces as seen from one frame of one world."""
    w, f = wp.tid()
    velocity = wp.vec3(0.0)
    for k in range(view.velocities.shape[0]):
        velocity += view.axes[k] * readings[w, view.velocities[k]]
    spin = view.hinge * readings[w, view.spin]
    if view.free != 0:
        spin = wp.vec3(readings[w, view.spin], readings[w, view.spin + 1], readings[w, view.spin + 2])
    move = view.moves[f]
    turn = wp.transpose(move) * wp.transpose(_rotation(view, readings, w))
    handedness = wp.determinant(move)
    along = turn * velocity
    turning = handedness * (wp.transpose(move) * spin)
    if view.views[f, 0] >= 0:
        sensed[w, view.views[f, 0]] = readings[w, view.height] + view.above
    for i in range(3):
        if view.views[f, 1 + i] >= 0:
            sensed[w, view.views[f, 1 + i]] = -turn[i, 2]
        if view.views[f, 4 + i] >= 0:
            sensed[w, view.views[f, 4 + i]] = turn[i, 0]
        if view.views[f, 7 + i] >= 0:
            sensed[w, view.views[f, 7 + i]] = along[i]
        if view.views[f, 10 + i] >= 0:
            sensed[w, view.views[f, 10 + i]] = turning[i]
    for v in range(view.vector_from.shape[0]):
        if view.vector_frame[v] == f:
            first = view.vector_from[v]
            seen = turn * wp.vec3(readings[w, first], readings[w, first + 1], readings[w, first + 2])
            if view.vector_is_pseudo[v] != 0:
                seen = handedness * seen
            for i in range(3):
                sensed[w, view.vector_to[v] + i] = seen[i]


@wp.kernel
def drive(
    signs: wp.array(dtype=float),
    middle: wp.array(dtype=float),
    span: wp.array(dtype=float),
    action: wp.array2d(dtype=float),
    status: wp.array(dtype=int),
    ctrl: wp.array2d(dtype=float),
):
    """Turn the action of each world into controls; it fails if one is not finite, and idle worlds hold still."""
    w = wp.tid()
    acts = status[w] == _RUNNING
    for i in range(ctrl.shape[1]):
        if acts and not wp.isfinite(action[w, i]):
            status[w] = _FAILED
            acts = False
    for i in range(ctrl.shape[1]):
        ctrl[w, i] = middle[i]
        if acts:
            ctrl[w, i] = middle[i] + span[i] * signs[i] * action[w, i]


@wp.kernel
def note_overflows(which: int, overflow: wp.array(dtype=int), flag: wp.array(dtype=int)):
    """Set `flag`, (1,), if a bit of `which` is set for any world."""
    if (overflow[wp.tid()] & which) != 0:
        flag[0] = 1
