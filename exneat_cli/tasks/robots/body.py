"""The trunk and the parts of a MuJoCo body, which parts are alike, and how they are related.

Two parts are alike if one becomes the other by a shift along the trunk, by a turn about the trunk's vertical axis (if
three or more such parts are spaced evenly around it), or by mirroring left and right. Parts that are alike may share a
network: Valsalam and Miikkulainen, "Evolving symmetry for modular system design", 2011, found that symmetric legs are
learned faster on flat ground; Su et al., "Leveraging symmetry in RL-based legged locomotion control", 2024.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from exneat_cli.errors import ConfigError, check_section
from exneat_cli.tasks.robots.likeness import MIRROR, Pose, Relation, relate

SYMMETRIES = ("turn", "mirror")
LONGEST_NAME = 100
"""Maximum number of characters of a model's names that are shown."""
_JOINT_ACTUATORS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


class Limb(NamedTuple):
    """A part of a body.

    Attributes:
        name: the name of its first body in the model, or its position in words.
        likeness: number of its class of alike parts.
        relation: how the first part of its class maps to it; also lists its bodies, joints and actuators.
        position: (x, y, z) of its first joint from the trunk, x ahead, y to the left, z up, in metres.
    """

    name: str
    likeness: int
    relation: Relation
    position: tuple[float, float, float]


class Body(NamedTuple):
    """A robot, divided into its trunk and parts.

    Attributes:
        trunk: the body that carries the root joints.
        root: the root joints: a free one, or the slides and the hinge of a planar body.
        core: bodies of the trunk, including all that belong to no part.
        limbs: the parts in the requested order.
        symmetries: those in `SYMMETRIES` that relate some of its parts.
    """

    trunk: int
    root: tuple[int, ...]
    core: tuple[int, ...]
    limbs: tuple[Limb, ...]
    symmetries: tuple[str, ...]


def take_apart(
    model: mujoco.MjModel,
    *,
    order: str = "position",
    symmetry: str | None = None,
    parts: Mapping[str, Sequence[str]] | None = None,
    by_place: bool = False,
) -> Body:
    """Find the trunk and the parts of a robot.

    Args:
        model: of the robot.
        order: ``position``: from front to back, left before right; ``model``: in the order of the model's bodies.
        symmetry: ``turn`` or ``mirror``, the relation between parts that no shift relates; None takes mirroring where
            possible.
        parts: names of each part's bodies, each of which includes all of its descendants; None finds the parts.
        by_place: name parts by their position even if their first bodies have names.

    Raises:
        ConfigError: the model has no root, no actuators, or actuators that do not drive joints, or `parts` or
            `symmetry` do not fit it.
    """
    trunk, root = find_root(model)
    pose = Pose(model, trunk)
    named = (
        _named_parts(model, trunk, parts) if parts else {tuple(subtree(model, b)): "" for b in _outermost(pose, trunk)}
    )
    bodies = sorted(named, key=lambda part: _from_front_to_back(pose, part) if order == "position" else part)
    names = [named[part] or ("" if by_place else printable(model.body(part[0]).name)) for part in bodies]
    names = _unique_names(names, pose, bodies)
    turns = {(a, b): r for a in bodies for b in bodies if (r := _turn(pose, a, b, bodies))}
    mirrorings = {(a, b): r for a in bodies for b in bodies if a != b and (r := relate(pose, "mirror", MIRROR, a, b))}
    there = tuple(name for name, found in zip(SYMMETRIES, (turns, mirrorings), strict=True) if found)
    if symmetry is not None and symmetry not in there:
        raise ConfigError("task.symmetry", f"{' or '.join((*there, 'null'))}, as this body is built", symmetry)
    moves = turns if symmetry == "turn" or not mirrorings else {}
    limbs: list[Limb] = []
    references: list[tuple[int, ...]] = []
    for name, part in zip(names, bodies, strict=True):
        x, y, z = (float(each) for each in pose.place(part))
        ways = [
            relate(pose, "shift", np.eye(3), first, part) or moves.get((first, part)) or mirrorings.get((first, part))
            for first in references
        ]
        likeness = next((k for k, relation in enumerate(ways) if relation), len(references))
        if likeness == len(references):
            references.append(part)
        limbs.append(Limb(name, likeness, [*ways, None][likeness] or _itself(pose, part), (x, y, z)))
    in_parts = {body for part in bodies for body in part}
    core = tuple(body for body in subtree(model, trunk) if body not in in_parts)
    return Body(trunk, root, core, tuple(limbs), there)


def find_root(model: mujoco.MjModel) -> tuple[int, tuple[int, ...]]:
    """The body from which the whole robot descends, and its root joints; of several, the one with most driven joints.

    Raises:
        ConfigError: no body moves freely or in a plane, or an actuator drives something other than a joint.
    """
    if not model.nu:
        raise ConfigError("task.model", "a model with actuators", "none", "add motors in its <actuator> section")
    for actuator in range(model.nu):
        if model.actuator_trntype[actuator] not in _JOINT_ACTUATORS:
            kind = mujoco.mjtTrn(model.actuator_trntype[actuator]).name.removeprefix("mjTRN_").lower()
            name = model.actuator(actuator).name or f"actuator {actuator}"
            raise ConfigError("task.model", "actuators that drive joints", f"{name}, which drives a {kind}")
    driven = set(model.actuator_trnid[:, 0].tolist())
    found = []
    for body in np.flatnonzero(model.body_parentid == 0)[1:].tolist():
        joints = [j for j in range(model.njnt) if model.jnt_bodyid[j] == body and j not in driven]
        is_free = [int(model.jnt_type[j]) for j in joints] == [int(mujoco.mjtJoint.mjJNT_FREE)]
        if is_free or _is_planar(model, body, joints):
            bodies = subtree(model, body)
            found.append((sum(model.jnt_bodyid[j] in bodies for j in driven), body, tuple(joints)))
    if not found or max(found)[0] == 0:
        fix = "give its trunk a <freejoint/>; or two slides along the world's axes and then a hinge at its origin"
        raise ConfigError("task.model", "a body that moves freely or in a plane and has actuators", "none", fix)
    _, trunk, root = max(found, key=lambda each: each[0])
    return trunk, root


def _is_planar(model: mujoco.MjModel, body: int, joints: Sequence[int]) -> bool:
    """Whether the joints are two slides and a hinge along the world's axes, at 0 for an upright trunk."""
    slide, hinge = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
    if [int(model.jnt_type[j]) for j in joints] != [slide, slide, hinge]:
        return False
    about = joints[2]
    axes = model.jnt_axis[list(joints)]
    in_line = np.all(np.isclose(np.abs(axes).max(axis=1), 1.0)) and np.all(axes[:2].sum(axis=1) > 0.0)
    upright = np.allclose(model.body_quat[body], [1.0, 0.0, 0.0, 0.0]) and model.qpos0[model.jnt_qposadr[about]] == 0.0
    return bool(in_line and upright and np.allclose(model.jnt_pos[about], 0.0))


def subtree(model: mujoco.MjModel, root: int) -> list[int]:
    """A body and all of its descendants, parents before children."""
    bodies = [root]
    for body in range(root + 1, model.nbody):  # a model numbers children after their parents
        if model.body_parentid[body] in bodies:
            bodies.append(body)
    return bodies


def _outermost(pose: Pose, trunk: int) -> list[int]:
    """The first bodies of the parts; bodies in the middle plane with several driven subtrees belong to the trunk."""
    model = pose.model
    driven = {int(model.jnt_bodyid[joint]) for joint in model.actuator_trnid[:, 0]}

    def limbs_on(body: int) -> list[int]:
        children = np.flatnonzero(model.body_parentid == body).tolist()
        return [child for child in children if driven & set(subtree(model, child))]

    def is_trunk(body: int) -> bool:
        if abs(pose.bodies[body][1]) > pose.tolerance:
            return False
        branches = limbs_on(body)
        return len(branches) > 1 or any(is_trunk(branch) for branch in branches)

    outermost, waiting = [], limbs_on(trunk)
    while waiting:
        body = waiting.pop()
        if is_trunk(body):
            waiting += limbs_on(body)
        else:
            outermost.append(body)
    return outermost


def check_parts(parts: object) -> None:
    """Refuse parts that do not name their bodies with a `ConfigError`; None stands for no choice."""
    for name, bodies in check_section("task.parts", {} if parts is None else parts).items():
        if not isinstance(bodies, list | tuple) or not bodies or not all(isinstance(body, str) for body in bodies):
            raise ConfigError(f"task.parts.{name}", "a list of names of bodies, e.g. [thigh]", bodies)


def _named_parts(model: mujoco.MjModel, trunk: int, parts: Mapping[str, Sequence[str]]) -> dict[tuple[int, ...], str]:
    known = {model.body(body).name: body for body in subtree(model, trunk)[1:]}
    named: dict[tuple[int, ...], str] = {}
    taken: dict[int, str] = {}
    for name, roots in parts.items():
        bodies: list[int] = []
        for root in roots:
            if root not in known:
                raise ConfigError(f"task.parts.{name}", f"bodies of the model: {', '.join(known)}", root)
            bodies += [body for body in subtree(model, known[root]) if body not in bodies]
        for body in bodies:
            if body in taken:
                both = f"{model.body(body).name} in {taken[body]} and {name}"
                raise ConfigError(
                    "task.parts", "parts that do not overlap", both, "a body brings along all that hangs on it"
                )
            taken[body] = name
        named[tuple(bodies)] = name
    return named


def _from_front_to_back(pose: Pose, part: Sequence[int]) -> tuple[float, ...]:
    x, y, z = (round(float(each / pose.tolerance)) for each in pose.place(part))
    return (-x, -y, -z, part[0])


def _unique_names(names: list[str], pose: Pose, parts: Sequence[Sequence[int]]) -> list[str]:
    """The names, if all exist and differ; else the parts' positions in words, numbered where they repeat."""
    if all(names) and len(set(names)) == len(names):
        return names
    words = [place_in_words(pose, part) for part in parts]
    return [word if words.count(word) == 1 else f"{word}_{words[:k].count(word) + 1}" for k, word in enumerate(words)]


def place_in_words(pose: Pose, part: Sequence[int]) -> str:
    """A part's position in words, e.g. ``front_left``; ``middle`` if it is above or below the trunk's origin."""
    x, y, _ = pose.place(part)
    ahead = "front" if x > pose.tolerance else "back" if x < -pose.tolerance else ""
    aside = "left" if y > pose.tolerance else "right" if y < -pose.tolerance else ""
    return "_".join(filter(None, (ahead, aside))) or "middle"


def _turn(
    pose: Pose, one: tuple[int, ...], other: tuple[int, ...], parts: Sequence[tuple[int, ...]]
) -> Relation | None:
    """The turn from a part to another, if all parts that it turns into are spaced evenly around the trunk."""
    related = {part: r for part in parts if (r := _turned(pose, one, part))}
    if len(related) < 3 or one == other or other not in related:
        return None
    angles = np.sort([_angle(pose, part) for part in related])
    steps = np.diff(angles, append=angles[0] + 2.0 * math.pi)
    return related[other] if np.ptp(steps) < 1e-3 else None


def _turned(pose: Pose, one: Sequence[int], other: Sequence[int]) -> Relation | None:
    angle = _angle(pose, other) - _angle(pose, one)
    sine, cosine = math.sin(angle), math.cos(angle)
    return relate(pose, "turn", np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]), one, other)


def _angle(pose: Pose, part: Sequence[int]) -> float:
    x, y, _ = pose.place(part)
    return math.atan2(y, x)


def _itself(pose: Pose, part: Sequence[int]) -> Relation:
    joints = tuple(joint for body in part for joint in pose.joints_of(body))
    actuators = tuple(actuator for joint in joints for actuator in pose.actuators_of(joint))
    ones = (1,) * len(joints), (1,) * len(actuators)
    return Relation("itself", np.eye(3), tuple(part), joints, ones[0], actuators, ones[1])


def printable(name: str) -> str:
    """The printable part of a model's name: files may contain line breaks and names of any length."""
    return "".join(filter(str.isprintable, name))[:LONGEST_NAME]
