"""Trunk, parts and likeness of bodies against tables that were worked out by hand from their MJCF files."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.tasks.robots.body import Body, take_apart
from exneat_cli.tasks.robots.models import load, rules_of

# One line a part: name, class, what relates it to the first part of its class, where its first joint is, and each of
# its joints with its sign and its actuator, which has a sign as well. The reasons stand above each table.

# Leg k of Ant points to 45, 135, 225, 315 degrees. Hips turn about z. A quarter turn about z takes the axis of ankle 1,
# 90 degrees ahead of its leg, to (-1,-1), (1,-1), (1,1) on legs 2, 3, 4; those have (1,1), (-1,1), (1,1).
ANT_TURN = """
front_left  0 itself (0.2,0.2,0)   +hip_1=+a2 +ankle_1=+a3
front_right 0 turn   (0.2,-0.2,0)  +hip_4=+a0 +ankle_4=+a1
back_left   0 turn   (-0.2,0.2,0)  +hip_2=+a4 -ankle_2=-a5
back_right  0 turn   (-0.2,-0.2,0) +hip_3=+a6 -ankle_3=-a7
"""
# Mirrored, an axis (x, y, z) becomes (-x, y, -z): hips change sign, (-1,1,0) becomes (1,1,0), which ankle 4 has, and
# (1,1,0) of ankle 2 becomes (-1,1,0), which ankle 3 has. A front leg shifted backwards points the wrong way.
ANT_MIRROR = """
front_left  0 itself (0.2,0.2,0)   +hip_1=+a2 +ankle_1=+a3
front_right 0 mirror (0.2,-0.2,0)  -hip_4=-a0 +ankle_4=+a1
back_left   1 itself (-0.2,0.2,0)  +hip_2=+a4 +ankle_2=+a5
back_right  1 mirror (-0.2,-0.2,0) -hip_3=-a6 +ankle_3=+a7
"""
# Legs 0.25 m out at 30, -30, 90, -90, 150, -150 degrees, each modelled in axes of its own turned about z.
HEXAPOD_TURN = """
front_left   0 itself (0.217,0.125,0)   +front_left_hip=+a0 +front_left_knee=+a1
front_right  0 turn   (0.217,-0.125,0)  +front_right_hip=+a2 +front_right_knee=+a3
middle_left  0 turn   (0,0.25,0)        +middle_left_hip=+a4 +middle_left_knee=+a5
middle_right 0 turn   (0,-0.25,0)       +middle_right_hip=+a6 +middle_right_knee=+a7
back_left    0 turn   (-0.217,0.125,0)  +back_left_hip=+a8 +back_left_knee=+a9
back_right   0 turn   (-0.217,-0.125,0) +back_right_hip=+a10 +back_right_knee=+a11
"""
# The knee's axis at 30 + 90 = 120 degrees becomes one at 60 = -30 + 90.
HEXAPOD_MIRROR = """
front_left   0 itself (0.217,0.125,0)   +front_left_hip=+a0 +front_left_knee=+a1
front_right  0 mirror (0.217,-0.125,0)  -front_right_hip=-a2 +front_right_knee=+a3
middle_left  1 itself (0,0.25,0)        +middle_left_hip=+a4 +middle_left_knee=+a5
middle_right 1 mirror (0,-0.25,0)       -middle_right_hip=-a6 +middle_right_knee=+a7
back_left    2 itself (-0.217,0.125,0)  +back_left_hip=+a8 +back_left_knee=+a9
back_right   2 mirror (-0.217,-0.125,0) -back_right_hip=-a10 +back_right_knee=+a11
"""
# Thighs differ in range, stiffness, damping and shape.
HALF_CHEETAH = """
fthigh 0 itself (0.5,0,0)  +fthigh=+a3 +fshin=+a4 +ffoot=+a5
bthigh 1 itself (-0.5,0,0) +bthigh=+a0 +bshin=+a1 +bfoot=+a2
"""
HOPPER = "thigh 0 itself (0,0,-0.2) +thigh_joint=+a0 +leg_joint=+a1 +foot_joint=+a2"
SWIMMER = "mid 0 itself (0.5,0,0) +motor1_rot=+a0 +motor2_rot=+a1"
# Both legs hang at the same place: a shift by nothing.
WALKER = """
thigh      0 itself (0,0,-0.2) +thigh_joint=+a0 +leg_joint=+a1 +foot_joint=+a2
thigh_left 0 shift  (0,0,-0.2) +thigh_left_joint=+a3 +leg_left_joint=+a4 +foot_left_joint=+a5
"""
# Mirrored, shoulder 1 (2,-1,1) becomes (-2,-1,-1) and shoulder 2 (0,1,1) becomes (0,1,-1), the right ones' reversed;
# the elbow (0,-1,-1) becomes (0,-1,1), and the hips (-1,0,0), (0,0,-1), (0,1,0) the right ones' axes. Thighs are
# 0.26 + 0.165 + 0.04 m down and, for waist and pelvis lean back by 0.004 rad each, 0.01 - 0.0007 - 0.0003 m behind.
HUMANOID = """
left_upper_arm  0 itself (0,0.17,0.06)      +left_shoulder1=+a14 +left_shoulder2=+a15 +left_elbow=+a16
right_upper_arm 0 mirror (0,-0.17,0.06)     -right_shoulder1=-a11 -right_shoulder2=-a12 +right_elbow=+a13
left_thigh  1 itself (-0.009,0.1,-0.465)  +left_hip_x=+a7 +left_hip_z=+a8 +left_hip_y=+a9 +left_knee=+a10
right_thigh 1 mirror (-0.009,-0.1,-0.465) +right_hip_x=+a3 +right_hip_z=+a4 +right_hip_y=+a5 +right_knee=+a6
"""
BODIES = [
    ("ant", "turn", ANT_TURN, "torso", "turn mirror"),
    ("ant", None, ANT_MIRROR, "torso", "turn mirror"),
    ("hexapod", "turn", HEXAPOD_TURN, "trunk", "turn mirror"),
    ("hexapod", "mirror", HEXAPOD_MIRROR, "trunk", "turn mirror"),
    ("half_cheetah", None, HALF_CHEETAH, "torso", ""),
    ("hopper", None, HOPPER, "torso", ""),
    ("swimmer", None, SWIMMER, "torso", ""),
    ("walker2d", None, WALKER, "torso", "mirror"),
    ("humanoid", None, HUMANOID, "torso lwaist pelvis", "mirror"),
]


def table(model: mujoco.MjModel, body: Body) -> list[list[str]]:
    """What was found, in the tables' words."""
    lines = []
    for limb in body.limbs:
        relation, place = limb.relation, ",".join(f"{each + 0.0:.3g}" for each in (round(p, 3) for p in limb.position))
        joints = zip(relation.joint_signs, relation.joints, relation.actuator_signs, relation.actuators, strict=True)
        words = [f"{'-0+'[s + 1]}{model.joint(j).name}={'-0+'[t + 1]}a{a}" for s, j, t, a in joints]
        lines.append([limb.name, str(limb.likeness), relation.name, f"({place})", *words])
    return lines


def classes(model: mujoco.MjModel, **options: Any) -> dict[str, int]:
    return {limb.name: limb.likeness for limb in take_apart(model, **options).limbs}


@pytest.mark.parametrize(("name", "symmetry", "expected", "core", "symmetries"), BODIES)
def test_parts_are_those_worked_out_by_hand(
    name: str, symmetry: str | None, expected: str, core: str, symmetries: str
) -> None:
    model = load(name)
    body = take_apart(model, symmetry=symmetry, by_place=rules_of(name).named_by_place)
    assert table(model, body) == [line.split() for line in expected.strip().splitlines()]
    assert " ".join(model.body(number).name for number in body.core) == core
    assert " ".join(body.symmetries) == symmetries


def test_in_the_models_order_and_names_ants_front_pair_comes_first_and_last() -> None:
    found = classes(load("ant"), order="model")
    assert list(found.items()) == [
        ("front_left_leg", 0),
        ("front_right_leg", 1),
        ("back_leg", 1),
        ("right_back_leg", 0),
    ]


def robot(*limbs: str, root: str = "<freejoint/>", scene: str = "", more: str = "", drive: str = "") -> mujoco.MjModel:
    """A box with these limbs; each of them brings a motor for each of its joints."""
    bodies, motors = zip(*(each.split("|") for each in limbs), strict=True)
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco><compiler autolimits="true"/><worldbody><geom type="plane" size="9 9 1"/>{scene}
          <body name="trunk" pos="0 0 1">{root}<geom type="box" size=".3 .2 .1" mass="10"/>{"".join(bodies)}</body>
        </worldbody>{more}<actuator>{"".join(motors)}{drive}</actuator></mujoco>""")


def limb(
    name: str,
    x: float = 0.0,
    y: float = 0.0,
    *,
    turned: float = 0.0,
    top: str = "0 0 0",
    tip: str = "0 0 -0.5",
    mass: float = 1.0,
    axis: str = "0 1 0",
    limits: str = "-20 60",
    damping: float = 1.0,
    gear: float = 50.0,
    control: str = "-1 1",
    beyond: tuple[str, ...] = (),
) -> str:
    """A body with one hinge, turned about z by degrees, and the hinge's motor; other limbs may hang on it."""
    inner, motors = ("".join(each.split("|")[k] for each in beyond) for k in (0, 1))
    return f"""<body name="{name}" pos="{x} {y} 0" euler="0 0 {turned}">
        <joint name="{name}" axis="{axis}" range="{limits}" damping="{damping}"/>
        <geom type="capsule" size="0.03" fromto="{top} {tip}" mass="{mass}"/>{inner}</body>
        |<motor name="{name}" joint="{name}" gear="{gear}" ctrlrange="{control}"/>{motors}"""


def legs(**changes: Any) -> list[str]:
    """Four upright legs at the corners of the trunk, of which the last differs by `changes`."""
    corners = {
        "front_left": (0.3, 0.2),
        "front_right": (0.3, -0.2),
        "back_left": (-0.3, 0.2),
        "back_right": (-0.3, -0.2),
    }
    return [limb(name, x, y, **(changes if name == "back_right" else {})) for name, (x, y) in corners.items()]


def test_a_table_with_one_leg_longer_shares_only_the_equal_legs() -> None:
    body = take_apart(robot(*legs(tip="0 0 -0.55")))
    assert [part.likeness for part in body.limbs] == [0, 0, 0, 1]
    assert [part.relation.name for part in body.limbs] == ["itself", "mirror", "shift", "itself"]


def test_an_arm_shares_with_no_leg() -> None:
    model = robot(limb("arm", 0.2, beyond=(limb("hand", 0.1),)), *legs())
    assert classes(model) == {"front_left": 0, "front_right": 0, "arm": 1, "back_left": 0, "back_right": 0}


def test_what_branches_belongs_to_the_trunk_on_the_middle_plane_and_stays_one_part_beside_it() -> None:
    paw = limb("paw", 0.3, 0.2, beyond=(limb("claw_1", 0.1), limb("claw_2", 0.2)))
    head = limb("head", 0.4, beyond=(limb("ear_left", 0.0, 0.1), limb("ear_right", 0.0, -0.1)))
    assert classes(robot(paw, head)) == {"ear_left": 0, "ear_right": 0, "paw": 1}


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [
        ((0, 120, 240), [0, 0, 0]),  # even
        ((0, 120, 250), [0, 1, 2]),  # not quite
        ((30, 150, 210, 330), [0, 0, 1, 1]),  # a rectangle: the left ones mirror the right ones
        ((0, 180), [0, 1]),  # too few
    ],
)
def test_only_three_or_more_legs_that_stand_evenly_are_related_by_turns(
    degrees: tuple[float, ...], expected: list[int]
) -> None:
    hips = [(angle, 0.2 * math.cos(math.radians(angle)), 0.2 * math.sin(math.radians(angle))) for angle in degrees]
    model = robot(*(limb(f"at_{angle}", x, y, turned=angle, tip="0.4 0 -0.5") for angle, x, y in hips))
    turns = "turn" if not any(expected) else None
    assert list(classes(model, symmetry=turns).values()) == expected
    assert ("turn" in take_apart(model).symmetries) is bool(turns)


@pytest.mark.parametrize(
    ("name", "symmetry", "there"),
    [("walker2d", "turn", "mirror or null"), ("humanoid", "turn", "mirror or null"), ("hopper", "mirror", "null")],
)
def test_a_symmetry_that_a_body_has_not_is_refused_with_those_that_it_has(name: str, symmetry: str, there: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        take_apart(load(name), symmetry=symmetry)
    assert str(refusal.value) == f"task.symmetry: expected {there}, as this body is built, got '{symmetry}'"


# The left leg swings sideways about (1, 0, 0) between -20 and 60 degrees; mirrored, that is (-1, 0, 0).
@pytest.mark.parametrize(
    ("right", "signs"),
    [
        ({"limits": "-60 20"}, (-1, -1)),
        ({"axis": "-1 0 0"}, (1, 1)),
        ({"limits": "-60 20", "gear": -50.0}, (-1, 1)),
        ({"axis": "-1 0 0", "gear": -50.0}, (1, -1)),
        ({"axis": "-1 0 0", "damping": 0.85}, (1, 1)),
        ({"axis": "-1 0 0", "damping": 0.75}, None),
        ({"axis": "-1 0 0", "mass": 1.15}, (1, 1)),
        ({"axis": "-1 0 0", "mass": 1.5}, None),  # however heavy the trunk is
        ({"limits": "-20 60"}, None),
        ({"axis": "-1 0 0", "gear": 40.0}, None),
        ({"axis": "-1 0 0.1"}, None),
        ({"axis": "-1 0 0", "control": "-1 0.5"}, None),
        ({"axis": "-1 0 0", "x": 0.01}, (1, 1)),  # a shift along the trunk may go with a mirroring
        ({"axis": "-1 0 0", "y": -0.21}, None),
        ({"axis": "-1 0 0", "top": "-0.25 0 -0.25", "tip": "0.25 0 -0.25"}, None),
    ],
)
def test_legs_mirror_each_other_only_if_ranges_and_motors_agree_after_signs(
    right: dict[str, Any], signs: tuple[int, int] | None
) -> None:
    right = {"x": 0.0, "y": -0.2, "axis": "1 0 0", **right}
    first, second = take_apart(robot(limb("left", 0.0, 0.2, axis="1 0 0"), limb("right", **right))).limbs
    if signs is None:
        assert (first.likeness, second.likeness) == (0, 1)
    else:
        assert (second.likeness, second.relation.name) == (0, "mirror")
        assert (second.relation.joint_signs, second.relation.actuator_signs) == ((signs[0],), (signs[1],))


# The left leg's moments about its principal axes lie along x, y and z; a mirroring turns (1, 1, 0) into (1, -1, 0).
@pytest.mark.parametrize(
    ("left", "right", "likeness"),
    [
        ("0.02 0.025 0.01", "0.02 0.025 0.01", 0),
        ("0.02 0.025 0.01", "0.02 0.025 0.0085", 0),
        ("0.02 0.025 0.01", "0.02 0.025 0.012", 0),
        ("0.02 0.025 0.01", "0.02 0.025 0.013", 1),  # the smallest moment alone, by an eighth of the largest
        ("0.02 0.03 0.01", "0.03 0.02 0.01", 1),
        ("0.02 0.02 0.01 0.005 0 0", "0.02 0.02 0.01 -0.005 0 0", 0),
        ("0.02 0.02 0.01 0.005 0 0", "0.02 0.02 0.01 0.005 0 0", 1),
    ],
)
def test_legs_are_alike_only_if_their_moments_of_inertia_agree_after_the_mirroring(
    left: str, right: str, likeness: int
) -> None:
    def leg(name: str, y: float, moments: str) -> str:
        kind = "fullinertia" if len(moments.split()) == 6 else "diaginertia"
        inertial = f'<inertial pos="0 0 -0.25" mass="1" {kind}="{moments}"/>'
        return limb(name, 0.0, y).replace("<joint", inertial + "<joint")

    assert classes(robot(leg("left", 0.2, left), leg("right", -0.2, right)))["right"] == likeness


def test_legs_with_centres_of_mass_in_other_places_are_not_alike() -> None:
    def leg(name: str, y: float, depth: float) -> str:
        inertial = f'<inertial pos="0 0 {-depth}" mass="1" diaginertia="0.02 0.02 0.01"/>'
        return limb(name, 0.0, y).replace("<joint", inertial + "<joint")

    assert classes(robot(leg("left", 0.2, 0.25), leg("right", -0.2, 0.3)))["right"] == 1


def test_a_motors_lopsided_range_goes_with_its_sign() -> None:
    left = limb("left", 0.0, 0.2, axis="1 0 0", control="-1 0.5")
    alike, unlike = (
        classes(robot(left, limb("right", 0.0, -0.2, axis="1 0 0", limits="-60 20", control=control)))["right"]
        for control in ("-0.5 1", "-1 0.5")
    )
    assert (alike, unlike) == (0, 1)


def test_what_lies_about_is_not_taken_for_the_robot() -> None:
    ball = '<body name="ball" pos="2 0 1"><freejoint/><geom size=".1"/></body>'
    model = robot(*legs(), scene=ball)
    assert model.body(take_apart(model).trunk).name == "trunk"


def test_named_parts_bring_along_what_hangs_on_them_and_leave_the_rest_to_the_trunk() -> None:
    model = robot(limb("arm", 0.2, beyond=(limb("hand", 0.1),)), *legs())
    body = take_apart(model, parts={"right": ["back_right", "front_right"], "reach": ["arm"]})
    assert {part.name: [model.body(b).name for b in part.relation.bodies] for part in body.limbs} == {
        "right": ["back_right", "front_right"],
        "reach": ["arm", "hand"],
    }
    assert [model.body(number).name for number in body.core] == ["trunk", "front_left", "back_left"]


CORD = '<tendon><fixed name="cord"><joint joint="left" coef="1"/></fixed></tendon>'
LEFT = limb("left", 0.0, 0.2)


@pytest.mark.parametrize(
    ("model", "came"),
    [
        (robot(LEFT.split("|")[0] + "|"), "none"),
        (robot(LEFT, root=""), "none"),
        (robot(LEFT, root='<joint type="slide" axis="1 0 0"/>'), "none"),
        (robot(LEFT, more=CORD, drive='<motor name="pull" tendon="cord"/>'), "pull, which drives a tendon"),
    ],
    ids=["no actuators", "no root", "a root that does not turn", "an actuator on a tendon"],
)
def test_models_that_are_no_robots_are_refused(model: mujoco.MjModel, came: str) -> None:
    with pytest.raises(ConfigError, match=came) as refusal:
        take_apart(model)
    assert refusal.value.key == "task.model"


@pytest.mark.parametrize(
    ("parts", "key", "came"),
    [
        ({"a": ["arm"], "b": ["hand"]}, "task.parts", "hand in a and b"),
        ({"a": ["paw"]}, "task.parts.a", "paw"),
        ({"a": ["trunk"]}, "task.parts.a", "trunk"),
    ],
)
def test_parts_that_do_not_fit_the_model_are_refused(parts: dict[str, list[str]], key: str, came: str) -> None:
    model = robot(limb("arm", 0.2, beyond=(limb("hand", 0.1),)))
    with pytest.raises(ConfigError, match=came) as refusal:
        take_apart(model, parts=parts)
    assert refusal.value.key == key
    assert str(refusal.value).count("\n") <= 2
