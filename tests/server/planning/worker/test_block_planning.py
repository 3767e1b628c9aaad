"""Blocks of moves as the planning process plans them, on a UR5."""

import dataclasses
import json
import pickle
from collections.abc import Mapping

import numpy as np
import pytest
from rigs.cells.expectations import expect, known, only, refusal_from
from rigs.cells.server_rig import LIMITS
from rigs.data.program_samples import linked

from openpendant.motion.frames.frame_tree import BASE, FrameTree
from openpendant.motion.kinematics.ik.configuration import configuration_of
from openpendant.motion.paths.paths import plan_path
from openpendant.motion.paths.segments import Circ, Lin, Ptp, Spline, ThroughPoint
from openpendant.motion.pose import Array, Pose
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.cell.joint_slots import JointSlots
from openpendant.server.endpoints.ros.ros_trajectory import Collection
from openpendant.server.events.management_requests import MOST_ANSWER
from openpendant.server.planning.jobs import (
    BlockJob,
    DryRunFound,
    DryRunJob,
    DryRunSlice,
    RosPathJob,
)
from openpendant.server.planning.worker.block_planning import Places, plan_block, segments_of
from openpendant.server.planning.worker.dry_run_planning import (
    MOST_SAMPLES,
    MOST_VERDICTS,
    DryRuns,
    shortened,
)
from openpendant.server.planning.worker.job_planner import answer, kinematics_of, plan_ros_path
from openpendant.server.programs.execution.dry_run_service import dry_run_reply
from openpendant.server.programs.interpreter.control_flow import ControlFlow, Level
from openpendant.server.programs.interpreter.dry_run_results import (
    DryRunResult,
    HandOver,
    MoveFinding,
    PointFinding,
    StatementFinding,
)
from openpendant.server.programs.interpreter.motion_blocks import BlockMove, Gatherer, MotionBlock
from openpendant.server.programs.language.linking import Linked
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.point_poses import pose_of
from openpendant.server.programs.language.program import Program
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import JointTrajPt, joint_array
from openpendant.simplemsg.pendant.management.program_values import (
    ArmConfiguration,
    JointVector,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import Attach, Move, SetOutput, Way
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
    found = known(configuration_of(UR5, joints))
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
    before, after = (known(configuration_of(UR5, each)) for each in (point.joints, joints))
    assert dataclasses.replace(after, turns=before.turns) == before


def test_a_refusal_names_program_line_and_point() -> None:
    moves = block("move PTP b zone 1 deg\nmove PTP c\n")
    far = dataclasses.replace(moves.moves[1].target, joints=(0.0, -9.0, *AT_A[2:]))
    moves = MotionBlock((moves.moves[0], dataclasses.replace(moves.moves[1], target=far)))
    job = BlockJob(3, AT_A, moves, (8, 9), TREE, 1.0)
    result = refusal_from(answer("ur5", pickle.loads(pickle.dumps(job))).result)
    assert result.code is V.OUT_OF_RANGE
    assert result.text.startswith("main, line 9, point c: ")


def test_a_frame_that_is_not_there_is_refused_by_name() -> None:
    point = dataclasses.replace(taught(AT_A), name="b")
    moves = block("move PTP b\n")
    moves = MotionBlock((dataclasses.replace(moves.moves[0], target=point),))
    result = answer("ur5", BlockJob(3, AT_A, moves, (8,), FrameTree(), 1.0)).result
    assert refusal_from(result).code is V.UNKNOWN_FRAME


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
    assert found == expect(DryRunFound, whole)
    assert slices >= 3
    assert all(verdict.refusal is None for verdict in found.points)


def test_a_dry_run_judges_points_that_no_statement_moves_to() -> None:
    program = linked("move PTP a\n")
    main: Program = program.programs["main"]
    far = dataclasses.replace(main.points[2], joints=(0.0, -9.0, *AT_A[2:]))
    program.programs["main"] = dataclasses.replace(main, points=(*main.points[:2], far))  # type: ignore[index]
    job = DryRunJob(1, "cell 2", AT_A, program, TREE)
    found = expect(DryRunFound, DryRuns().slice(UR5, job, lambda: False))
    assert [each.point for each in found.points if each.refusal is not None] == ["c"]


LEVEL = (0.0, 0.0, 0.0, 1.0)
IN_BASE = TeachPoint("a", (0.1,) * 6, PointPose((0.4, 0.0, 0.3), LEVEL, "base", "flange"))
ON_TABLE = TeachPoint("b", (0.2,) * 6, PointPose((0.1, 0.0, 0.0), LEVEL, "table", "flange"))
BARE = TeachPoint("c", (0.3,) * 6)
TABLE = Pose.from_values((1.0, 0.0, 0.0), LEVEL)


def to_base(pose: PointPose) -> Pose:
    return TABLE.compose(pose_of(pose)) if pose.frame == "table" else pose_of(pose)


def forward(joints: JointVector) -> Pose:
    return Pose.from_values((joints[0], 0.0, 0.0), LEVEL)


def block_of(way: Way, target: TeachPoint, *via: TeachPoint, zone: float = 0.0) -> MotionBlock:
    move = Move(way, target.name, tuple(point.name for point in via), zone=zone)
    return MotionBlock((BlockMove("p", 0, move, target, via),))


def test_a_point_of_the_robots_own_frame_goes_to_its_joints() -> None:
    segment = only(Ptp, segments_of(block_of(Way.PTP, IN_BASE, zone=0.2), to_base, forward))
    assert (segment.target, segment.zone) == ((0.1,) * 6, 0.2)


def test_a_point_of_a_users_frame_goes_where_the_frame_is_now() -> None:
    segment = only(Lin, segments_of(block_of(Way.LIN, ON_TABLE), to_base, forward))
    assert expect(Pose, segment.target).position.tolist() == [1.1, 0.0, 0.0]


@pytest.mark.parametrize(("via", "x"), [(BARE, 0.3), (ON_TABLE, 1.1)])
def test_a_circle_goes_through_the_place_of_its_via_point(via: TeachPoint, x: float) -> None:
    segment = only(Circ, segments_of(block_of(Way.CIRC, IN_BASE, via), to_base, forward))
    assert np.asarray(expect(ThroughPoint, segment.way).via).tolist() == [x, 0.0, 0.0]


def test_a_spline_goes_through_all_its_points() -> None:
    block = block_of(Way.SPLINE, IN_BASE, BARE, IN_BASE)
    segment = only(Spline, segments_of(block, to_base, forward))
    assert list(segment.targets) == [(0.3,) * 6, (0.1,) * 6, (0.1,) * 6]


def test_the_planner_takes_a_block_with_zones_as_one_path() -> None:
    points = [TeachPoint(name, (angle, *AT_A[1:])) for name, angle in [("a", 0.3), ("b", 0.6)]]
    moves = tuple(
        BlockMove("p", index, Move(Way.LIN, point.name, zone=zone), point)
        for index, (point, zone) in enumerate(zip(points, (0.02, 0.0), strict=True))
    )
    segments = segments_of(MotionBlock(moves), to_base, UR5.forward)
    (path,) = plan_path(UR5, AT_A, segments)
    end = path.evaluate(np.array([path.length]))[0]
    assert end.ravel() == pytest.approx(points[1].joints, abs=1e-6)


START, GOAL = (0.0, 0.0), (0.5, 0.2)


def approach_time(duration: float, velocity: float = 1.0) -> float:
    collection = Collection(JointSlots(LIMITS), 100)
    assert collection.take(JointTrajPt(0, joint_array(GOAL), velocity, duration)) is None
    job = RosPathJob(1, START, tuple(collection.points), 0.1, 0.01)
    return float(plan_ros_path(job, LIMITS).duration)


@pytest.mark.parametrize("duration", [8.0, 12.0])
def test_a_real_duration_binds(duration: float) -> None:
    assert duration <= approach_time(duration) < duration + 0.1


def test_10_s_are_a_placeholder_and_10_percent_bind() -> None:
    free = approach_time(0.0)
    assert approach_time(10.0) == free
    assert approach_time(0.01) == pytest.approx(free)
    slowest = max(abs(b - a) / v for a, b, v in zip(START, GOAL, LIMITS.velocity, strict=True))
    assert slowest / 0.1 <= free < 8.0


def test_a_slower_point_is_approached_at_its_own_speed() -> None:
    assert approach_time(0.0, velocity=0.05) > 1.5 * approach_time(0.0)


def test_a_robot_that_stands_elsewhere_comes_to_rest_at_the_first_point_before_it_goes_on() -> None:
    collection = Collection(JointSlots(LIMITS), 100)
    for number, joints in enumerate((GOAL, (0.6, 0.2), (0.7, 0.2))):
        assert collection.take(JointTrajPt(number, joint_array(joints), 0.5, 0.0)) is None
    job = RosPathJob(1, START, tuple(collection.points), 0.1, 0.01)
    trajectory = plan_ros_path(job, LIMITS)
    gaps = abs(trajectory.position - np.array(GOAL)).max(axis=1)
    there = int(gaps.argmin())
    assert gaps[there] < 1e-9
    assert not trajectory.velocity[there].any()
    assert abs(trajectory.velocity[:there] / LIMITS.velocity).max() <= 0.1 + 1e-9


FAR = Refusal(V.UNREACHABLE)


def found(moves: int, refused_from: int) -> DryRunFound:
    verdicts = tuple(
        MoveFinding("main", number, "p", FAR if number >= refused_from else None, False)
        for number in range(moves)
    )
    path = tuple((float(number), 0.0, 0.0, 0.0) for number in range(10 * moves + 7))
    unreached = tuple(("main", number) for number in range(moves))
    run = DryRunResult(1.0, False, True, path, verdicts, unreached)
    return DryRunFound(run, (PointFinding("a", None), PointFinding("b", FAR)))


def test_a_short_one_comes_whole() -> None:
    whole = found(5, 5)
    told = shortened(whole)
    assert (told.run.moves, told.run.not_walked) == (whole.run.moves, whole.run.not_walked)
    assert told.run.path == whole.run.path
    assert [each.point for each in told.points] == ["b", "a"]


def test_of_a_long_one_what_is_refused_comes_first_and_all_of_it_is_counted() -> None:
    told = shortened(found(4_000, 3_800))
    assert told.refused == 201
    assert [each.index for each in told.run.moves] == list(range(3_800, 3_800 + MOST_VERDICTS))
    assert len(told.run.not_walked) == MOST_VERDICTS
    assert len(told.run.path) <= MOST_SAMPLES + 1
    assert told.run.path[-1][0] == 40_006.0


def test_an_answer_of_long_texts_fits_a_frame_and_cuts_none_of_them() -> None:
    name, count = "ü" * 32, 500
    text = f"something at fault that takes many words to say {'and more ' * 30}than 3.14 rad"
    far = Refusal(V.UNREACHABLE, text)
    head = f'openpendant-program/1\nprogram "{name}" robot ur5\n'
    program = parse(head + "wait 1 s\n" * count)
    linked = Linked(name, {name: program}, revisions={name: 1})
    keys = [(name, number) for number in range(count)]
    run = DryRunResult(
        duration=1.0,
        endless=False,
        complete=False,
        path=tuple((86_400.123456 + n, -1.123456, -1.123456, -1.123456) for n in range(5_000)),
        moves=tuple(MoveFinding(*key, name, far, False) for key in keys),
        not_walked=tuple(keys),
        hand_overs=tuple(HandOver(*key, Attach(name), far) for key in keys),
        statements=tuple(StatementFinding(*key, SetOutput(99, True), FAR) for key in keys),
        unchecked=tuple(keys),
    )
    points = tuple(PointFinding(name, far) for _ in keys)
    answer = dry_run_reply(linked, shortened(DryRunFound(run, points)), int)
    body = json.dumps(answer, ensure_ascii=False, separators=(",", ":")).encode()
    assert 40_000 < len(body) <= MOST_ANSWER
    assert answer["refused"] == 4 * count
    texts = {str(each["text"]) for kind in ("moves", "scene") for each in rows(answer, kind)}
    assert texts == {text}
    assert len(rows(answer, "statements")) == MOST_VERDICTS


def rows(answer: Mapping[str, object], kind: str) -> list[dict[str, object]]:
    return expect(list, answer[kind])


def test_statements_that_cannot_be_run_come_before_those_that_can() -> None:
    verdicts = tuple(
        StatementFinding("main", number, SetOutput(1, True), FAR if number > 90 else None)
        for number in range(200)
    )
    run = DryRunResult(1.0, False, True, (), (), (), statements=verdicts)
    found = shortened(DryRunFound(run, ()))
    assert found.refused == 109
    assert [each.index for each in found.run.statements] == list(range(91, 191))
