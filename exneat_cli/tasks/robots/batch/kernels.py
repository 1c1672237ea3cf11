"""Kernels of a batch of robots: what `dynamics` and `frames` do for one world, for W of them, in single precision.

Every sum within a world runs in a fixed order on one thread, so that results do not depend on other worlds.
"""

import warp as wp

from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

wp.set_module_options({"enable_backward": False})

LARGEST_STATE = wp.constant(1.0e10)
"""MuJoCo's mjMAXVAL: it warns of larger positions, velocities and accelerations, and resets the world."""
_RUNNING, _ENDED, _FAILED = wp.constant(RUNNING), wp.constant(ENDED), wp.constant(FAILED)


@wp.struct
class Sensors:
    """What is read: entries of positions and velocities, and bodies with their contact forces."""

    positions: wp.array(dtype=int)
    velocities: wp.array(dtype=int)
    bodies: wp.array(dtype=int)
    force_limit: float


@wp.struct
class View:
    """`exneat_cli.tasks.robots.frames.Frames`, but for the joints."""

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


@wp.struct
class Rules:
    """The rules of an episode, see `exneat_cli.tasks.robots.dynamics.RobotWorld`."""

    trunk: int
    along: int
    total_mass: float
    masses: wp.array(dtype=float)
    control_period: float
    height: int
    above: float
    lowest: float
    highest: float
    pitch: int
    steepest: float
    largest: float
    forward_weight: float
    healthy_reward: float
    control_weight: float
    contact_weight: float
    cost_limit: float
    largest_contact_cost: float
    max_steps: int
    progress: float
    patience: int


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
    """Put each world with begins >= 0 to that row of `starts`: qpos, qvel, acceleration, place and x of the trunk."""
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
    """Write what takes a sign only."""
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
    """Turn the action of each world into controls; a world fails where one is not finite, and others hold still."""
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


@wp.func
def _is_sound(values: wp.array2d(dtype=float), w: int):
    for i in range(values.shape[1]):
        if not (wp.abs(values[w, i]) <= LARGEST_STATE):
            return False
    return True


@wp.func
def _is_healthy(rules: Rules, qpos: wp.array2d(dtype=float), qvel: wp.array2d(dtype=float), w: int):
    if rules.height >= 0:
        height = qpos[w, rules.height] + rules.above
        if not (rules.lowest <= height and height <= rules.highest):
            return False
    if rules.pitch >= 0:
        if wp.abs(qpos[w, rules.pitch]) >= rules.steepest:
            return False
    if rules.largest < wp.inf:
        for i in range(2, qpos.shape[1]):
            if wp.abs(qpos[w, i]) >= rules.largest:
                return False
        for i in range(qvel.shape[1]):
            if wp.abs(qvel[w, i]) >= rules.largest:
                return False
    return True


@wp.func
def _place(
    rules: Rules,
    qpos: wp.array2d(dtype=float),
    xpos: wp.array2d(dtype=wp.vec3),
    xipos: wp.array2d(dtype=wp.vec3),
    w: int,
):
    if rules.along >= 0:
        return qpos[w, rules.along]
    if rules.total_mass == 0.0:
        return xpos[w, rules.trunk][0]
    moment = float(0.0)
    for body in range(rules.masses.shape[0]):
        moment += rules.masses[body] * xipos[w, body][0]
    return moment / rules.total_mass


@wp.func
def _contact_cost(rules: Rules, force: wp.array2d(dtype=wp.spatial_vector), w: int):
    squared = float(0.0)
    if rules.contact_weight != 0.0:
        for body in range(force.shape[1]):
            for i in range(6):
                each = wp.clamp(force[w, body][i], -rules.cost_limit, rules.cost_limit)
                squared += each * each
    return wp.min(rules.contact_weight * squared, rules.largest_contact_cost)


@wp.kernel
def judge(
    rules: Rules,
    qpos: wp.array2d(dtype=float),
    qvel: wp.array2d(dtype=float),
    qacc: wp.array2d(dtype=float),
    xpos: wp.array2d(dtype=wp.vec3),
    xipos: wp.array2d(dtype=wp.vec3),
    ctrl: wp.array2d(dtype=float),
    force: wp.array2d(dtype=wp.spatial_vector),
    place: wp.array(dtype=float),
    mark: wp.array(dtype=float),
    clock: wp.array2d(dtype=int),
    status: wp.array(dtype=int),
    terms: wp.array2d(dtype=float),
):
    """Write the reward terms of each running world, (W, 4), and how it stands now."""
    w = wp.tid()
    if status[w] != _RUNNING:
        return
    if not (_is_sound(qpos, w) and _is_sound(qvel, w) and _is_sound(qacc, w)):
        status[w] = _FAILED
        return
    now = _place(rules, qpos, xpos, xipos, w)
    healthy = _is_healthy(rules, qpos, qvel, w)
    effort = float(0.0)
    for i in range(ctrl.shape[1]):
        effort += ctrl[w, i] * ctrl[w, i]
    terms[w, 0] = rules.forward_weight * ((now - place[w]) / rules.control_period)
    terms[w, 1] = wp.where(healthy, rules.healthy_reward, 0.0)
    terms[w, 2] = -rules.control_weight * effort
    terms[w, 3] = -_contact_cost(rules, force, w)
    place[w] = now
    # The mark moves along with every bit of progress, and the count starts again.
    x = xpos[w, rules.trunk][0]
    if x >= mark[w] + rules.progress:
        mark[w] = x
        clock[w, 1] = 0
    else:
        clock[w, 1] += 1
    clock[w, 0] += 1
    stuck = rules.patience > 0 and clock[w, 1] >= rules.patience
    if not healthy or stuck or clock[w, 0] >= rules.max_steps:
        status[w] = _ENDED


@wp.kernel
def note_overflows(which: int, overflow: wp.array(dtype=int), flag: wp.array(dtype=int)):
    """Set the flag if one of these bits is set in some world."""
    if (overflow[wp.tid()] & which) != 0:
        flag[0] = 1
