"""Whether a shift, a turn or mirroring maps one part of a MuJoCo body to another, and with which signs.

A hinge's axis is a pseudovector: mirroring left and right reverses hinges about x and z, but not those about y.
A joint's sign is 1 if the move maps the other part's axis to its own, -1 if to the opposite; ranges and actuators
follow it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

_PLACES = 1e-3
"""Share of the model's extent: closer places count as the same, and so do directions (as sines)."""
_SHARE = 0.2
"""Masses, moments of inertia about any axis, damping, friction loss and armature may differ by this share of the
larger one, stiffness by this share of the body's largest: the armature of Humanoid's hips differs by 20%, and one of
its knees has a spring of 1 N m/rad and the other none, while its hips have 20."""
_ROUND_OFF = 1e-6
"""Relative tolerance for values that must be equal: ranges, gears, sizes, friction."""
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_SHAPED_AXES: dict[int, list[int]] = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): [],
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): [2],
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): [2],
}
"""Axes of a geom whose direction its shape shows; all three for shapes not named here."""
MIRROR = np.diag([1.0, -1.0, 1.0])
"""Exchanges left and right."""


class Relation(NamedTuple):
    """How a class' first part maps to an alike one, whose members are listed in the first part's order.

    Attributes:
        name: ``itself``, ``shift``, ``turn`` or ``mirror``.
        move: (3, 3) orthogonal matrix that maps vectors in the trunk's axes.
        bodies: their numbers in the model, as for joints and actuators.
        joints: hinges and slides.
        joint_signs: 1 or -1 for each.
        actuators: those of the joints.
        actuator_signs: 1 or -1 for each.
    """

    name: str
    move: NDArray[np.float64]
    bodies: tuple[int, ...]
    joints: tuple[int, ...]
    joint_signs: tuple[int, ...]
    actuators: tuple[int, ...]
    actuator_signs: tuple[int, ...]


class Pose:
    """Where a model's bodies, joints and geoms are in its initial pose, in its trunk's axes, in m and kg m^2."""

    def __init__(self, model: mujoco.MjModel, trunk: int) -> None:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        origin, axes = data.xpos[trunk], data.xmat[trunk].reshape(3, 3)
        self.model = model
        self.height = float(origin[2])
        self.tolerance = _PLACES * float(model.stat.extent)
        self.bodies = (data.xpos - origin) @ axes
        self.mass_centres = (data.xipos - origin) @ axes
        principal = axes.T @ data.ximat.reshape(-1, 3, 3)
        self.inertias = (principal * model.body_inertia[:, None]) @ principal.transpose(0, 2, 1)
        self.anchors = (data.xanchor - origin) @ axes
        self.axes = data.xaxis @ axes
        self.geoms = (data.geom_xpos - origin) @ axes
        self.geom_axes = axes.T @ data.geom_xmat.reshape(-1, 3, 3)

    def joints_of(self, body: int) -> range:
        """Numbers of the joints that move a body."""
        first = int(self.model.body_jntadr[body])
        return range(first, first + int(self.model.body_jntnum[body]))

    def geoms_of(self, body: int) -> range:
        """Numbers of a body's geoms."""
        first = int(self.model.body_geomadr[body])
        return range(first, first + int(self.model.body_geomnum[body]))

    def actuators_of(self, joint: int) -> list[int]:
        """Numbers of the actuators that drive a joint."""
        return [int(a) for a in np.flatnonzero(self.model.actuator_trnid[:, 0] == joint)]

    def place(self, part: Sequence[int]) -> NDArray[np.float64]:
        """(3,) position of the first joint of these bodies, or of the first body if they have no joints."""
        joints = [joint for body in part for joint in self.joints_of(body)]
        return np.asarray(self.anchors[joints[0]] if joints else self.bodies[part[0]])


def relate(
    pose: Pose, name: str, move: NDArray[np.float64], one: Sequence[int], other: Sequence[int]
) -> Relation | None:
    """Compare two parts after a move and, unless it is a turn, a shift along x; None if they are not alike.

    Args:
        pose: of the body.
        name: of the move, for the relation.
        move: (3, 3) orthogonal.
        one: bodies of the first part, parents before children.
        other: bodies of the part to which the first one may map.
    """
    shift = pose.place(other) - move @ pose.place(one)
    if len(one) != len(other) or np.abs(shift if name == "turn" else shift[1:]).max() > pose.tolerance:
        return None
    comparison = _Comparison(pose, move, shift)
    parents = pose.model.body_parentid
    found = {int(parents[one[0]]): int(parents[other[0]])}
    joints: list[tuple[int, int, int]] = []
    for body in one:
        for match in other:
            is_free = match not in found.values() and parents[match] == found.get(int(parents[body]))
            if is_free and comparison.same_body(body, match):
                found[body] = match
                joints += comparison.joints(body, match)
                break
        else:
            return None
    if not all(sign for *_, sign in joints):
        return None
    actuators = [each for joint in joints for each in comparison.actuators(*joint)]
    if not all(sign for _, sign in actuators):
        return None
    return Relation(
        name,
        move,
        bodies=tuple(found[body] for body in one),
        joints=tuple(joint for _, joint, _ in joints),
        joint_signs=tuple(sign for *_, sign in joints),
        actuators=tuple(actuator for actuator, _ in actuators),
        actuator_signs=tuple(sign for _, sign in actuators),
    )


class _Comparison(NamedTuple):
    """Compares the members of one part, after a move, with those of another."""

    pose: Pose
    move: NDArray[np.float64]
    shift: NDArray[np.float64]

    def same_place(self, one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
        return bool(np.abs(self.move @ one + self.shift - other).max() <= self.pose.tolerance)

    def same_body(self, one: int, other: int) -> bool:
        pose = self.pose
        alike = (
            self.same_place(pose.bodies[one], pose.bodies[other])
            and self.same_place(pose.mass_centres[one], pose.mass_centres[other])
            and _near(*pose.model.body_mass[[one, other]])
            and _near_about_any_axis(self.move @ pose.inertias[one] @ self.move.T, pose.inertias[other])
        )
        geoms, left = self.pose.geoms_of(one), list(self.pose.geoms_of(other))
        for geom in geoms:
            match = next((g for g in left if self.same_geom(geom, g)), None)
            if match is None:
                return False
            left.remove(match)
        joints = len(self.pose.joints_of(one)) == len(self.pose.joints_of(other))
        return bool(alike and joints and not left)

    def same_geom(self, one: int, other: int) -> bool:
        model, pose = self.pose.model, self.pose
        kind = int(model.geom_type[one])
        if kind != model.geom_type[other] or not self.same_place(pose.geoms[one], pose.geoms[other]):
            return False
        shown = _SHAPED_AXES.get(kind, [0, 1, 2])
        moved = np.abs(np.sum((self.move @ pose.geom_axes[one]) * pose.geom_axes[other], axis=0))[shown]
        equal = (model.geom_size, model.geom_friction, model.geom_contype, model.geom_conaffinity, model.geom_condim)
        return bool(np.all(moved > 1.0 - _PLACES**2)) and all(_equal(values[one], values[other]) for values in equal)

    def joints(self, one: int, other: int) -> list[tuple[int, int, int]]:
        """Each joint of a body, the other body's joint, and the sign; 0 if they differ."""
        pairs = zip(self.pose.joints_of(one), self.pose.joints_of(other), strict=True)
        return [(a, b, self.joint_sign(a, b)) for a, b in pairs]

    def joint_sign(self, one: int, other: int) -> int:
        model, pose = self.pose.model, self.pose
        hinge = model.jnt_type[one] == _HINGE
        if model.jnt_type[one] != model.jnt_type[other] or model.jnt_type[one] not in (_HINGE, _SLIDE):
            return 0
        along = float((self.move @ pose.axes[one]) @ pose.axes[other]) * (np.linalg.det(self.move) if hinge else 1.0)
        sign = 1 if along > 0.0 else -1
        position, speed = (address[[one, other]] for address in (model.jnt_qposadr, model.jnt_dofadr))
        alike = [
            abs(along) > 1.0 - _PLACES**2,
            self.same_place(pose.anchors[one], pose.anchors[other]),
            model.jnt_limited[one] == model.jnt_limited[other],
            _equal(_signed(model.jnt_range[one], sign), model.jnt_range[other]),
            *(_equal(sign * values[position[0]], values[position[1]]) for values in (model.qpos0, model.qpos_spring)),
            *(_near(*values[speed]) for values in (model.dof_damping, model.dof_armature, model.dof_frictionloss)),
            _near(model.jnt_stiffness[one], model.jnt_stiffness[other], model.jnt_stiffness.max()),
        ]
        return sign if all(alike) else 0

    def actuators(self, one: int, other: int, sign: int) -> list[tuple[int, int]]:
        """The actuators of joint `other` with their signs; 0 if they differ from those of joint `one`."""
        model = self.pose.model
        ours, others = self.pose.actuators_of(one), self.pose.actuators_of(other)
        if len(ours) != len(others):
            return [(-1, 0)]
        found = []
        for a, b in zip(ours, others, strict=True):
            gears = float(model.actuator_gear[a, 0]), float(model.actuator_gear[b, 0])
            own = sign if gears[0] * gears[1] > 0.0 else -sign
            equal = (
                *(model.actuator_gaintype, model.actuator_biastype, model.actuator_dyntype, model.actuator_ctrllimited),
                *(model.actuator_gainprm, model.actuator_biasprm, model.actuator_dynprm),
            )
            alike = all(_equal(values[a], values[b]) for values in equal) and _equal(abs(gears[0]), abs(gears[1]))
            ranges = (model.actuator_ctrlrange, model.actuator_forcerange)
            alike = alike and all(_equal(_signed(values[a], own), values[b]) for values in ranges)
            found.append((b, own if alike else 0))
        return found


def _signed(limits: NDArray[np.float64], sign: int) -> NDArray[np.float64]:
    """(2,) lower and upper limit after multiplication by the sign."""
    return limits if sign > 0 else -limits[::-1]


def _equal(one: Any, other: Any) -> bool:
    return bool(np.allclose(one, other, rtol=_ROUND_OFF, atol=_ROUND_OFF))


def _near(one: float, other: float, largest: float = 0.0) -> bool:
    """Whether two positive numbers differ little, relative to the larger of them or to a still larger one."""
    return bool(abs(one - other) <= _SHARE * max(one, other, largest) + 1e-12)


def _near_about_any_axis(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """The same for (3, 3) inertias: compares the moments u' I u about all directions u."""
    least = [np.linalg.eigvalsh(a - (1.0 - _SHARE) * b)[0] for a, b in ((one, other), (other, one))]
    return bool(min(least) >= -1e-6 * max(np.trace(one), np.trace(other)))
