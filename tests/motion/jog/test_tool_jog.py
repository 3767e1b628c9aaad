"""Tool jogs: lines, turns, frames, singularities, arms of few and of many axes, the platform."""

import math
from pathlib import Path

import numpy as np
import pytest
from rigs.data.foreign_robots import FEW_AXES
from rigs.data.urdf_files import SOUND, written
from rigs.motion.jog_referee import Referee, cause_of, joints_out, line_error, referee
from rigs.motion.jogged_robots import FAST, REDUCED, UR5_BENT, model, random_place, robot
from rigs.motion.loaded_robots import arm
from rigs.motion.refusals import Refusal, refusals
from rigs.motion.stewart_poses import PLATFORM

from openpendant.motion.description.robot import robot_from_content
from openpendant.motion.errors import BadArgument, NotFinite
from openpendant.motion.jog import (
    JogCaps,
    Jogger,
    JogModel,
    JogSetpoint,
    JogSlowdown,
    JointJog,
    ToolJog,
    jog_model,
)
from openpendant.motion.orientation import rotation_of_vector, vector_of_quaternion
from openpendant.motion.paths.mechanism import Mechanism, mechanism
from openpendant.motion.pose import Pose, quaternion_product
from openpendant.motion.robot_import.decisions import Decisions
from openpendant.motion.robot_import.new_robot import Wishes, configure
from openpendant.motion.robot_import.urdf import read_urdf
from openpendant.motion.robot_import.urdf_tree import chain_to

X, Y, Z = np.eye(3)


def turn_between(before: Pose, after: Pose) -> np.ndarray:
    back = before.quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
    return vector_of_quaternion(quaternion_product(after.quaternion, back))


@pytest.mark.parametrize("axis", range(3))
def test_the_tool_goes_straight_along_a_base_axis(axis: int) -> None:
    direction = np.eye(3)[axis]
    watched = referee()
    for step in [watched.run(ToolJog(tuple(direction)), 5) for _ in range(12)]:
        off, turned = line_error(robot("ur5"), UR5_BENT, direction, step)
        assert max(off, turned) < 1e-5
    way = robot("ur5").forward(step.position).position - robot("ur5").forward(UR5_BENT).position
    assert way @ direction > 0.1


@pytest.mark.parametrize("axis", range(3))
def test_the_tool_turns_about_its_centre_point(axis: int) -> None:
    direction = np.eye(3)[axis]
    watched = referee()
    step = watched.run(ToolJog(angular=tuple(direction)), 60)
    before, after = robot("ur5").forward(UR5_BENT), robot("ur5").forward(step.position)
    assert before.position_distance(after) < 1e-5
    turn = turn_between(before, after)
    assert turn @ direction > 0.2
    assert np.linalg.norm(turn - (turn @ direction) * direction) < 1e-5


def test_a_user_frame_turns_the_directions() -> None:
    axes = Pose.from_rpy((0.0, 0.0, 0.0), (0.4, -0.7, 1.1))
    x, y, z, w = axes.quaternion.tolist()
    watched = referee()
    step = watched.run(ToolJog((0.0, 1.0, 0.0), axes=(x, y, z, w)), 40)
    off, _ = line_error(robot("ur5"), UR5_BENT, axes.rotation @ Y, step)
    assert off < 1e-5


def test_the_tools_own_axes_move_along() -> None:
    watched = referee(caps=JogCaps(tool_speed=0.1, rotation_speed=0.4))
    step = watched.run(ToolJog((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), axes=None), 100)
    before, after = robot("ur5").forward(UR5_BENT), robot("ur5").forward(step.position)
    # A screw of pitch zero: the tool goes round a circle of radius v/ω in its own x-y plane.
    centre = before.position + before.rotation @ np.array([0.0, 0.25, 0.0])
    assert np.linalg.norm(after.position - centre) == pytest.approx(0.25, abs=1e-5)
    angle = before.rotation_distance(after)
    assert angle > 0.3
    turned = before.rotation @ rotation_of_vector(angle * Z)
    assert np.abs(turned - after.rotation).max() < 1e-5


def test_a_tool_offset_moves_the_point_that_stays() -> None:
    tcp = Pose.from_rpy((0.02, -0.05, 0.15), (0.3, 0.1, 0.0))
    jogger = Jogger(JogModel(arm("ur5"), tcp), UR5_BENT, REDUCED)
    jogger.aim(ToolJog(angular=(0.0, 1.0, 0.0)))
    for _ in range(60):
        step = jogger.step(0.01)
    before, after = (arm("ur5").forward(q).compose(tcp) for q in (UR5_BENT, step.position))
    assert before.position_distance(after) < 1e-5
    assert before.rotation_distance(after) > 0.2


def test_two_keys_at_once_keep_their_direction_and_the_tools_speed() -> None:
    watched = referee()
    step = watched.run(ToolJog((1.0, -1.0, 0.0)), 60)
    off, _ = line_error(robot("ur5"), UR5_BENT, np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0), step)
    assert off < 1e-5
    assert step.reason is JogSlowdown.TOOL_SPEED
    assert step.scale == pytest.approx(1.0 / math.sqrt(2.0), rel=0.01)
    assert watched.fastest_point > 0.24


def test_half_a_stick_is_half_the_speed() -> None:
    watched = referee()
    watched.run(ToolJog((0.5, 0.0, 0.0)), 60)
    assert watched.fastest_point == pytest.approx(0.125, rel=1e-3)


def test_promise_14_a_line_slows_and_halts_before_a_singularity() -> None:
    watched = referee()
    step = watched.rest(ToolJog((0.0, 0.0, 1.0)))
    assert step.reason is JogSlowdown.SINGULARITY
    assert cause_of(step).limit == 30.0
    assert 29.0 < model("ur5").arm.condition(step.position) < 30.1
    assert step.retreat is not None
    assert (step.retreat.singularity, step.retreat.reverse) == ("elbow", True)
    for each in watched.steps[:: len(watched.steps) // 20]:
        off, turned = line_error(robot("ur5"), UR5_BENT, Z, each)
        assert max(off, turned) < 1e-5
    assert watched.run(ToolJog((0.0, 0.0, -1.0)), 50).scale == 1.0


@pytest.mark.parametrize(
    "wrist",
    [
        1e-3,
        -0.05,
        *(pytest.param(each, marks=pytest.mark.soak) for each in (-1e-3, 5e-3, 0.02)),
    ],
)
def test_promise_14_a_tool_jog_leads_out_of_a_wrist_singularity(wrist: float) -> None:
    start = [*robot("kuka_kr5_arc").home_position[:4], wrist, 0.3]
    found = model("kuka_kr5_arc")
    assert found.arm.condition(start) > 30.0
    free = 0
    for axis in range(6):
        for sign in (1.0, -1.0):
            rates = [sign * float(each == axis) for each in range(6)]
            watched = referee("kuka_kr5_arc", start, FAST)
            step = watched.run(ToolJog(tuple(rates[:3]), tuple(rates[3:])), 100)
            free += not step.at_rest or found.arm.condition(step.position) < 30.1
    # Of two opposite directions one leads out, but where both keep the wrist as it is.
    assert free >= 4


def test_the_suggested_joints_lead_out_of_a_doubly_singular_position_of_the_puma() -> None:
    stretched_up = [0.0, math.pi / 2, -math.pi / 2, 0.0, 0.0, 0.0]
    watched = referee("puma560", stretched_up, FAST)
    named = []
    for _ in range(2):
        step = watched.run(ToolJog((1.0, 0.0, 0.0)), 2)
        assert (step.at_rest, step.reason) == (True, JogSlowdown.SINGULARITY)
        assert step.retreat is not None
        named.append(step.retreat.singularity)
        watched.run(JointJog(joints_out(step)), 35)
        watched.rest(None)
    assert sorted(named) == ["shoulder", "wrist"]
    assert not watched.run(ToolJog((1.0, 0.0, 0.0)), 20).at_rest
    assert len(watched.steps) < 250


@pytest.mark.parametrize("name", ["mitsubishi_rh6frh5520", "fanuc_m410ib"])
def test_four_axes_jog_what_they_can_and_refuse_the_rest(name: str) -> None:
    start = [0.4, 1.2, 0.2, 0.3] if name.startswith("m") else [0.4, 0.3, -0.1, 0.3]
    able = ToolJog((0.0, 1.0, 0.0)), ToolJog((0.0, 0.0, -1.0)), ToolJog(angular=(0.0, 0.0, 1.0))
    for target in able:
        watched = referee(name, start)
        step = watched.run(target, 40)
        assert not step.at_rest
        before, after = robot(name).forward(start), robot(name).forward(step.position)
        assert abs((before.rotation.T @ after.rotation)[2, 2]) == pytest.approx(1.0, abs=1e-9)
    for angular in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.5, 1.0)):
        step = referee(name, start).run(ToolJog(angular=angular), 10)
        assert (step.position, step.reason) == (start, JogSlowdown.DIRECTION)
        assert step.at_rest


@pytest.mark.parametrize("name", ["kuka_iiwa14", "rail_kr5_arc"])
def test_seven_axes_keep_the_line(name: str) -> None:
    random = np.random.default_rng(3)
    for _ in range(4):
        start = random_place(name, random)
        watched = referee(name, start)
        step = watched.run(ToolJog((0.0, 0.0, 1.0)), 80)
        off, turned = line_error(robot(name), start, Z, step)
        assert max(off, turned) < 1e-4


def test_the_rail_moves_along_when_the_arm_jogs_along_it() -> None:
    start = list(robot("rail_kr5_arc").home_position)
    step = referee("rail_kr5_arc", start).run(ToolJog((0.0, 1.0, 0.0)), 100)
    assert not step.at_rest
    assert max(abs(a - b) for a, b in zip(start, step.position, strict=True)) > 0.01


@refusals(
    ("two rates", lambda: ToolJog((1.0, 0.0)), BadArgument, "3 numbers"),
    ("a rate above 1", lambda: ToolJog((2.0, 0.0, 0.0)), BadArgument, "-1 to 1"),
    ("a turn without end", lambda: ToolJog(angular=(math.inf, 0.0, 0.0)), NotFinite, ""),
    ("a short quaternion", lambda: ToolJog(axes=(0.0, 0.0, 0.0, 0.5)), BadArgument, "quaternion"),
    ("three numbers", lambda: ToolJog(axes=(0.0, 0.0, 1.0)), BadArgument, "quaternion"),  # type: ignore[arg-type]  # is refused
    ("NaN", lambda: ToolJog(axes=(math.nan, 0.0, 0.0, 1.0)), BadArgument, "quaternion"),
)
def test_a_malformed_tool_jog_is_refused(refusal: Refusal) -> None:
    refusal.check()


KEYS = "xyzABC"

TILTED = [0.3, 0.2, 0.9, -0.1, 0.2]
STRETCHED = [0.0, math.pi / 2.0, -math.pi / 2.0, 0.0, 0.0]
ALMOST_STRETCHED = [0.0, math.pi / 2.0, 0.02 - math.pi / 2.0, -0.02, 0.0]
"""Places of the five-axis arm: its tool aslant; its elbow straight; its elbow nearly so."""


def imported(urdf: str, tip: str, folder: Path) -> Mechanism:
    chain = chain_to(read_urdf(written(folder, urdf)), tip)
    content = configure(chain, Wishes(), Decisions("tiny.urdf", lambda _: None, None, False))
    return mechanism(robot_from_content(content, "tiny.yaml"))


@pytest.fixture(scope="module")
def five_axes(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    foreign = FEW_AXES["five_axes"]
    return imported(foreign.urdf, foreign.tool, tmp_path_factory.mktemp("five_axes"))


def pressed(robot: Mechanism, start: list[float], key: str, ticks: int = 30) -> JogSetpoint:
    axis = tuple(np.eye(3)[KEYS.index(key) % 3])
    jog = ToolJog(axis) if key in "xyz" else ToolJog(angular=axis)
    return Referee(robot, Jogger(jog_model(robot), start, REDUCED)).run(jog, ticks)


@pytest.mark.parametrize("key", "xyABC")
def test_what_too_few_axes_cannot_do_has_no_way_out(five_axes: Mechanism, key: str) -> None:
    step = pressed(five_axes, TILTED, key)
    assert (step.position, step.reason, step.retreat) == (TILTED, JogSlowdown.DIRECTION, None)
    asked = REDUCED.tool_speed if key in "xy" else REDUCED.rotation_speed
    assert (cause_of(step).value, cause_of(step).limit) == pytest.approx((asked, 0.0))


def test_what_is_left_to_few_axes_moves(five_axes: Mechanism) -> None:
    step = pressed(five_axes, TILTED, "z")
    way = five_axes.forward(step.position).position - five_axes.forward(TILTED).position
    assert way[2] > 0.02


@pytest.mark.parametrize("start", [STRETCHED, ALMOST_STRETCHED], ids=["at", "near"])
@pytest.mark.parametrize(
    ("key", "reason"), [("x", JogSlowdown.SINGULARITY), ("y", JogSlowdown.DIRECTION)]
)
def test_at_a_singularity_only_the_direction_that_is_lost_there_is_told_as_singular(
    five_axes: Mechanism, start: list[float], key: str, reason: JogSlowdown
) -> None:
    assert jog_model(five_axes).arm.condition(start) > 30.0
    step = pressed(five_axes, start, key)
    assert (step.position, step.reason) == (start, reason)
    assert (step.retreat is not None) == (reason is JogSlowdown.SINGULARITY)


def test_a_way_that_few_axes_can_only_begin_ends_for_that_reason(tmp_path: Path) -> None:
    robot = imported(SOUND, "d", tmp_path)
    # The tool is at the elbow, right above the shoulder: it sets out along x, but on a circle.
    start = [0.0, math.atan2(-0.1, 0.2), 0.3]
    assert jog_model(robot).arm.forbids(start, np.array([0.25, 0.0, 0.0, 0.0, 0.0, 0.0])) is None
    step = pressed(robot, start, "x")
    assert step.at_rest
    assert step.position == pytest.approx(start, abs=1e-3)
    assert step.reason is JogSlowdown.DIRECTION


def test_the_axes_of_a_gantry_are_the_tools(tmp_path: Path) -> None:
    foreign = FEW_AXES["gantry"]
    robot = imported(foreign.urdf, foreign.tool, tmp_path)
    assert jog_model(robot).arm.condition(foreign.joints) == pytest.approx(1.0)
    for joint, (key, sign) in enumerate(zip("xyz", (1.0, 1.0, -1.0), strict=True)):
        step = pressed(robot, foreign.joints, key)
        moved = np.array(step.position) - np.array(foreign.joints)
        assert step.scale == 1.0
        assert moved[joint] * sign > 0.02
        assert np.delete(moved, joint) == pytest.approx([0.0, 0.0], abs=1e-9)


NAME = "stewart_classroom"
CAPS = JogCaps(tool_speed=0.1, rotation_speed=0.5, joint_fraction=1.0)


def on_platform(caps: JogCaps = CAPS) -> Referee:
    return referee(NAME, robot(NAME).home_position, caps, 0.02)


def stopped_inside(step: JogSetpoint) -> bool:
    PLATFORM.workspace.check(PLATFORM.forward(step.position))
    return step.reason in (JogSlowdown.WORKSPACE, JogSlowdown.JOINT_LIMIT)


@pytest.mark.parametrize(
    "axis", [0, 2, 4, *(pytest.param(axis, marks=pytest.mark.soak) for axis in (1, 3, 5))]
)
def test_a_pose_jog_goes_straight_to_the_border_and_back(axis: int) -> None:
    rates = [float(each == axis) for each in range(6)]
    watched = on_platform()
    step = watched.rest(ToolJog(tuple(rates[:3]), tuple(rates[3:])))
    assert stopped_inside(step)
    assert PLATFORM.workspace.usage(PLATFORM.forward(step.position)) > 0.5
    if axis < 3:
        start = robot(NAME).home_position
        assert max(line_error(robot(NAME), start, np.eye(3)[axis], step)) < 1e-6
    back = ToolJog(tuple(-rate for rate in rates[:3]), tuple(-rate for rate in rates[3:]))
    assert not watched.run(back, 50).at_rest


@pytest.mark.parametrize(
    ("leg", "sign"),
    [
        (0, 1.0),
        (3, -1.0),
        *(
            pytest.param(leg, sign, marks=pytest.mark.soak)
            for leg in range(6)
            for sign in (1.0, -1.0)
            if (leg, sign) not in ((0, 1.0), (3, -1.0))
        ),
    ],
)
def test_a_leg_jog_stays_inside_and_is_left_by_what_is_suggested(leg: int, sign: float) -> None:
    rates = [sign * float(each == leg) for each in range(6)]
    watched = on_platform()
    step = watched.rest(JointJog(tuple(rates)), 1000)
    assert stopped_inside(step)
    assert not watched.run(JointJog(joints_out(step)), 50).at_rest


def test_all_legs_together_lift_the_platform() -> None:
    step = on_platform(REDUCED).run(JointJog((1.0,) * 6), 30)
    platform = robot(NAME)
    way = platform.forward(step.position).position
    way = way - platform.forward(platform.home_position).position
    assert way[2] > 0.003
    assert np.abs(way[:2]).max() < 1e-6
