"""The kernel that judges control steps: rewards, health and the ends of episodes, as in `dynamics` for one world."""

import warp as wp

from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

wp.set_module_options({"enable_backward": False})

LARGEST_STATE = wp.constant(1.0e10)
"""MuJoCo's mjMAXVAL: beyond it, positions, velocities and accelerations cause a warning and a reset of the world."""
_RUNNING, _ENDED, _FAILED = wp.constant(RUNNING), wp.constant(ENDED), wp.constant(FAILED)


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
    """Write the reward terms, (W, 4), and the status of each running world."""
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
    # With sufficient progress the mark moves along and the count starts again.
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
