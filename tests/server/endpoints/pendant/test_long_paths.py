"""Paths of many waypoints: checked at once, with the words that one waypoint alone would get."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.expectations import only
from rigs.cells.server_rig import ready

from openpendant.motion.description.limits import JointLimits, float32_ceiling
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Pose
from openpendant.server.cell.joint_slots import JointSlots
from openpendant.server.endpoints.pendant.motion_requests import (
    LARGEST_COORDINATE,
    path_fault,
    pose_fault,
    table_of,
)
from openpendant.server.planning.jobs import JointPathJob, PoseGoal, PoseJob
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import PENDANT, Message, codec_for, joint_array
from openpendant.simplemsg.pendant import (
    JointPath,
    JointWaypoint,
    PosePath,
    PoseWaypoint,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

LOWER, UPPER = (-2.1, -0.7), (2.1, 0.7)
"""Bounds that are no 4-byte reals."""
ONES = (1.0, 1.0)
SLOTS = JointSlots(JointLimits(("a", "b"), LOWER, UPPER, ONES, ONES, (False, True)))
GOOD = joint_array((0.25, -0.5))
UPRIGHT = (0.0, 0.0, 0.0, 1.0)

JOINTS = st.sampled_from(
    [
        *(0.0, -0.0, 1e-40, -1e-40, 0.5, LOWER[0], UPPER[0], LOWER[1], UPPER[1]),
        *(float32_ceiling(UPPER[0]), -float32_ceiling(-LOWER[0]), UPPER[0] + 1e-3, 1e9),
        *(math.nan, math.inf, -math.inf),
    ]
)
ROWS = st.lists(
    st.one_of(
        st.just(GOOD),
        st.tuples(JOINTS, JOINTS).map(joint_array),
        st.tuples(st.integers(0, 9), JOINTS).map(
            lambda at: (*GOOD[: at[0]], at[1], *GOOD[at[0] + 1 :])
        ),
    ),
    min_size=1,
    max_size=4,
)


def one_by_one(rows: list[tuple[float, ...]]) -> list[tuple[float, ...]] | Refusal:
    found = []
    for row in rows:
        position = SLOTS.position(row)
        if isinstance(position, Refusal):
            return position
        found.append(position)
    return found


@given(ROWS)
def test_many_joint_positions_are_judged_as_each_alone(rows: list[tuple[float, ...]]) -> None:
    at_once = SLOTS.positions(np.array(rows))
    alone = one_by_one(rows)
    if isinstance(at_once, Refusal):
        assert repr(at_once) == repr(alone)
    else:
        assert list(map(tuple, at_once.tolist())) == alone
        assert not np.signbit(at_once[at_once == 0.0]).any()


def test_many_positions_rounded_beyond_a_limit_are_taken_as_the_limit() -> None:
    beyond = [*map(float32_ceiling, UPPER)], [-float32_ceiling(-each) for each in LOWER]
    assert beyond[0][0] > UPPER[0]
    assert beyond[1][0] < LOWER[0]
    at_once = SLOTS.positions(np.array([joint_array(each) for each in beyond]))
    assert not isinstance(at_once, Refusal)
    assert at_once.tolist() == [[*UPPER], [*LOWER]]


PARTS = st.sampled_from(
    [
        *(0.0, 0.5, -LARGEST_COORDINATE, LARGEST_COORDINATE, LARGEST_COORDINATE * (1 + 1e-15)),
        *(math.nan, math.inf, -math.inf, 1e300),
    ]
)
ROTATIONS = st.one_of(
    st.just(UPRIGHT),
    st.floats(-2e-16, 2e-16).map(lambda off: (0.0, 0.0, 0.0, 1.01 + off)),
    st.floats(-2e-16, 2e-16).map(lambda off: (0.495, -0.495, 0.495 + off, 0.495)),
    st.tuples(PARTS, PARTS, PARTS, PARTS),
)
GOALS = st.lists(
    st.one_of(
        st.just(PoseGoal((0.5, 0.0, 0.25), UPRIGHT)),
        st.builds(PoseGoal, st.tuples(PARTS, PARTS, PARTS), ROTATIONS),
        st.builds(PoseGoal, st.just((0.5, 0.0, 0.25)), ROTATIONS),
    ),
    min_size=1,
    max_size=4,
)


@given(GOALS)
def test_many_poses_are_judged_as_each_alone(goals: list[PoseGoal]) -> None:
    table = np.array([(*goal.position, *goal.orientation) for goal in goals])
    faults = (pose_fault(goal, number) for number, goal in enumerate(goals, start=1))
    first = next(filter(None, faults), None)
    assert repr(path_fault(table)) == repr(first)


def sent(message: Message) -> Any:
    """Return a message as it comes over a wire."""
    codec = codec_for(PENDANT)
    return codec.decode(codec.encode(message))


def test_a_table_of_records_that_came_is_that_of_records_that_were_made() -> None:
    made = tuple(PoseWaypoint((at / 8, -0.5, math.nan), UPRIGHT) for at in range(3))
    came = sent(PosePath(1, 1, 0.5, "base", made)).waypoints
    assert table_of(came).dtype == np.float64
    np.testing.assert_array_equal(table_of(came), table_of(made))
    np.testing.assert_array_equal(table_of(made)[2], (0.25, -0.5, math.nan, *UPRIGHT))


def test_a_signalling_number_that_is_none_is_refused_without_a_warning() -> None:
    frame = bytearray(codec_for(PENDANT).encode(JointPath(1, 0.5, 2, (JointWaypoint(GOOD),) * 2)))
    frame[-40:-36] = b"\x01\x00\xa0\x7f"
    message = codec_for(PENDANT).decode(bytes(frame))
    assert isinstance(message, JointPath)
    refusal = SLOTS.positions(table_of(message.waypoints))
    assert isinstance(refusal, Refusal)
    assert (refusal.code, refusal.joint) == (V.NOT_FINITE, 0)


@pytest.mark.parametrize("bad", [0, 1, 799, 1_599])
def test_the_first_waypoint_that_is_wrong_is_the_one_that_is_told(bad: int) -> None:
    waypoints = [PoseWaypoint((0.5, 0.0, 0.25), UPRIGHT)] * 1_600
    waypoints[bad:] = [PoseWaypoint((0.5, 0.0, 2_000.0), UPRIGHT)] * (1_600 - bad)
    rig = ready(plans_at_once=False)
    answers = rig.holder().send(sent(PosePath(9, 1, 0.5, "base", tuple(waypoints))))
    verdict = only(Verdict, answers)
    assert (verdict.request_id, verdict.code) == (9, V.BAD_ARGUMENT)
    assert f"pose {bad + 1} lies at 2000 m" in verdict.text
    assert rig.jobs == []


def test_a_pose_path_is_planned_in_base() -> None:
    place = Pose.from_rpy((0.5, -1.0, 0.25), (0.3, -0.7, 2.0))
    rig = ready(plans_at_once=False)
    rig.robot.frames = FrameTree().add("table", place)
    waypoints = tuple(
        PoseWaypoint((0.1 * at, 0.2, -0.3), (0.0, math.sin(at / 2), 0.0, math.cos(at / 2)))
        for at in range(8)
    )
    rig.holder().send(sent(PosePath(9, 1, 0.5, "table", waypoints)))
    job = only(PoseJob, rig.jobs)
    assert (job.frame, len(job.goals)) == ("base", 8)
    for goal, at in zip(job.goals, sent(PosePath(9, 1, 0.5, "", waypoints)).waypoints, strict=True):
        wanted = place.compose(Pose.from_values(at.position, at.orientation))
        assert goal.position == pytest.approx(wanted.position.tolist(), abs=1e-14)
        assert goal.orientation == pytest.approx(wanted.quaternion.tolist(), abs=1e-14)


@pytest.mark.parametrize(
    ("frame", "code"), [("tool", V.BAD_ARGUMENT), ("nowhere", V.UNKNOWN_FRAME)]
)
def test_a_path_in_a_frame_that_moves_or_is_none_is_refused(frame: str, code: V) -> None:
    rig = ready(plans_at_once=False)
    waypoints = (PoseWaypoint((0.5, 0.0, 0.25), UPRIGHT),) * 2
    answers = rig.holder().send(sent(PosePath(9, 1, 0.5, frame, waypoints)))
    assert only(Verdict, answers).code == code


def test_a_joint_path_is_planned_through_its_waypoints() -> None:
    rig = ready(plans_at_once=False)
    waypoints = tuple(JointWaypoint(joint_array((at / 64, -at / 64))) for at in range(1, 65))
    rig.holder().send(sent(JointPath(9, 0.5, 2, waypoints)))
    job = only(JointPathJob, rig.jobs)
    assert job.waypoints == tuple((at / 64, -at / 64) for at in range(1, 65))


def test_slots_of_a_robot_with_all_ten_joints_are_all_positions() -> None:
    ten = (1.0,) * 10
    limits = JointLimits(
        tuple(map(str, range(10))), tuple(-x for x in ten), ten, ten, ten, (False,) * 10
    )
    at_once = JointSlots(limits).positions(np.full((3, 10), 0.5))
    assert not isinstance(at_once, Refusal)
    assert at_once.tolist() == [[0.5] * 10] * 3
