"""Blocks of moves as the planning process plans them, on a UR5."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest
from rigs.data.program_samples import linked

from openpendant.motion.frames.frame_tree import BASE, FrameTree
from openpendant.motion.kinematics.ik.configuration import configuration_of
from openpendant.motion.pose import Array, Pose
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.planning.jobs import BlockJob, DryRunFound, DryRunJob, DryRunSlice
from openpendant.server.planning.worker.block_planning import Places, plan_block
from openpendant.server.planning.worker.dry_run_planning import DryRuns
from openpendant.server.planning.worker.job_planner import answer, kinematics_of
from openpendant.server.programs.interpreter.control_flow import ControlFlow, Level
from openpendant.server.programs.interpreter.motion_blocks import Gatherer, MotionBlock
from openpendant.server.programs.language.point_poses import pose_of
from openpendant.server.programs.language.program import Program
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.points import ArmConfiguration, PointPose, TeachPoint
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = kinematics_of("ur5")
AT_A = (0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0)
FIXTURE = Pose.from_rpy((0.4, 0.1, 0.2), (0.0, 0.0, 0.3))
TREE = (
    FrameTree().add("fixture", FIXTURE).add_tool("gripper", Pose.from_rpy((0, 0, 0.15), (0, 0, 0)))
)


def block(statements: str, first: int = 0) -> MotionBlock:
    gatherer = Gatherer(ControlFlow(linked(statements)))
    return gatherer.block((Level("main", first, ((-1, 1),)),), lambda _: False).block


def planned(statements: str, cap: float | None = None, speed: float = 1.0) -> Trajectory:
    return plan_block(UR5, AT_A, block(statements), TREE, speed, cap)[0]


def speeds(trajectory: Trajectory) -> Array:
    """The speed of the flange between samples [m/s]."""
    places = np.array([UR5.forward(joints).position for joints in trajectory.position])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    rates: Array = steps / np.diff(trajectory.times)
    return rates


def taught(joints: tuple[float, ...], frame: str = "fixture", tool: str = "gripper") -> TeachPoint:
    pose = Places(UR5, TREE).forward(joints, frame, tool)
    found = configuration_of(UR5, joints)
    assert found is not None
    x, y, z = pose.position.tolist()
    a, b, c, d = pose.quaternion.tolist()
    return TeachPoint(
        "p",
        joints,
        PointPose((x, y, z), (a, b, c, d), frame, tool),
        ArmConfiguration(found.shoulder.value, found.elbow.value, found.wrist.value, found.turns),
    )


def test_each_move_of_a_block_keeps_its_own_tool_speed() -> None:
    text = "move LIN b speed 100 mm/s zone 5 mm\nmove LIN c speed 40 mm/s\n"
    trajectory = planned(text)
    corner = trajectory.waypoint_times[1]
    before = trajectory.times[:-1] < corner - 0.011
    rates = speeds(trajectory)
    assert rates[before].max() == pytest.approx(0.1, rel=0.01)
    assert rates[~before][2:].max() == pytest.approx(0.04, rel=0.01)


def test_the_fraction_of_the_run_slows_fractions_and_tool_speeds() -> None:
    text = "move LIN b speed 100 mm/s\n"
    assert speeds(planned(text, speed=0.5)).max() == pytest.approx(0.05, rel=0.01)
    assert planned("move PTP c\n", speed=0.1).duration > planned("move PTP c\n").duration


def test_reduced_speed_caps_the_tool_that_the_point_names() -> None:
    moves = block("move PTP c\n")
    point = dataclasses.replace(taught(moves.moves[0].target.joints), name="c")
    moves = MotionBlock((dataclasses.replace(moves.moves[0], target=point),))
    trajectory, certificate = plan_block(UR5, AT_A, moves, TREE, 1.0, 0.25)
    tip = [Places(UR5, TREE).forward(tuple(q), BASE, "gripper") for q in trajectory.position]
    places = np.array([pose.position for pose in tip])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() / 0.01 <= 0.2501
    assert {point.point for point in certificate.tool_speed} == {"tool", "elbow"}


def test_a_point_whose_pose_agrees_goes_to_its_joints() -> None:
    point = taught((0.2, -1.2, 1.4, -1.7, -1.5, 0.3))
    assert Places(UR5, TREE).joints(point) == point.joints


def test_moving_a_user_frame_moves_the_points_taught_in_it_in_their_configuration() -> None:
    point = taught((0.2, -1.2, 1.4, -1.7, -1.5, 0.3))
    shift = Pose.from_rpy((0.03, -0.02, 0.05), (0.0, 0.0, 0.1))
    moved = TREE.move("fixture", FIXTURE.compose(shift))
    joints = Places(UR5, moved).joints(point)
    assert point.pose is not None
    reached = Places(UR5, moved).forward(joints, "fixture", "gripper")
    assert reached.position_distance(pose_of(point.pose)) < 1e-6
    assert max(abs(np.subtract(joints, point.joints))) > 0.01
    before, after = configuration_of(UR5, point.joints), configuration_of(UR5, joints)
    assert before is not None
    assert after is not None
    assert (before.shoulder, before.elbow, before.wrist) == (
        after.shoulder,
        after.elbow,
        after.wrist,
    )


def test_a_refusal_names_program_line_and_point() -> None:
    moves = block("move PTP b zone 1 deg\nmove PTP c\n")
    far = dataclasses.replace(moves.moves[1].target, joints=(0.0, -9.0, *AT_A[2:]))
    moves = MotionBlock((moves.moves[0], dataclasses.replace(moves.moves[1], target=far)))
    job = BlockJob(3, AT_A, moves, (8, 9), TREE, 1.0)
    result = answer("ur5", pickle.loads(pickle.dumps(job))).result
    assert isinstance(result, Refusal)
    assert result.code is V.OUT_OF_RANGE
    assert result.text.startswith("main, line 9, point c: ")


def test_a_frame_that_is_not_there_is_refused_by_name() -> None:
    point = dataclasses.replace(taught(AT_A), name="b")
    moves = block("move PTP b\n")
    moves = MotionBlock((dataclasses.replace(moves.moves[0], target=point),))
    result = answer("ur5", BlockJob(3, AT_A, moves, (8,), FrameTree(), 1.0)).result
    assert isinstance(result, Refusal)
    assert result.code is V.UNKNOWN_FRAME


def test_a_dry_run_in_slices_finds_what_one_in_one_piece_finds() -> None:
    program = linked(
        "move PTP a\nmove LIN b zone 5 mm\nmove LIN c\nloop 3\nmove PTP b\nmove PTP a\nend\n"
    )
    job = DryRunJob(1, "cell 1", AT_A, program, TREE)
    whole = DryRuns().slice(UR5, job, lambda: False)
    sliced = DryRuns()
    slices = 0
    while isinstance(found := sliced.slice(UR5, job, lambda: True), DryRunSlice):
        slices += 1
        assert found.planned == slices
    assert isinstance(found, DryRunFound)
    assert found == whole
    assert slices >= 3
    assert all(verdict.refusal is None for verdict in found.points)


def test_a_dry_run_judges_points_that_no_statement_moves_to() -> None:
    program = linked("move PTP a\n")
    main: Program = program.programs["main"]
    far = dataclasses.replace(main.points[2], joints=(0.0, -9.0, *AT_A[2:]))
    program.programs["main"] = dataclasses.replace(main, points=(*main.points[:2], far))  # type: ignore[index]
    found = DryRuns().slice(UR5, DryRunJob(1, "cell 2", AT_A, program, TREE), lambda: False)
    assert isinstance(found, DryRunFound)
    assert [each.point for each in found.points if each.refusal is not None] == ["c"]
