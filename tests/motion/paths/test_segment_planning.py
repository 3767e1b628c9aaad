import math
from collections.abc import Sequence

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.loaded_robots import SERIAL, arm
from rigs.motion.robot_families import one_of_each_family

from openpendant.motion import errors
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.paths.blending import JointPolyline
from openpendant.motion.paths.paths import MOST_SEGMENTS, linear_path, plan_path
from openpendant.motion.paths.segments import (
    AboutCentre,
    Circ,
    CircleWay,
    FullAboutCentre,
    FullThroughPoints,
    Lin,
    Ptp,
    Segment,
    Spline,
    SplineSpace,
    ThroughPoint,
)
from openpendant.motion.paths.tool_curves import ToolTurn
from openpendant.motion.pose import Array, Pose
from openpendant.motion.timing.parameterization import time_legs
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointLine, Path

START = [0.3, -1.4, 1.6, -1.2, -1.3, 0.4]


UR5 = arm("ur5")
HERE = UR5.forward(START)


def joints(*changes: float) -> list[float]:
    moved = [value + change for value, change in zip(START, changes, strict=False)]
    return moved + START[len(changes) :]


def at(x: float, y: float, z: float) -> Pose:
    """The start's orientation, moved along the base's axes."""
    return Pose(HERE.position + np.array([x, y, z]), HERE.quaternion)


TURN = rotation_of_vector(np.array([0.0, 0.0, 0.2]))
TURNED = Pose.from_matrix(TURN @ HERE.rotation, HERE.position)


def point(x: float, y: float, z: float) -> list[float]:
    values: list[float] = at(x, y, z).position.tolist()
    return values


CENTRE = point(0.0, 0.05, 0.0)


def ends(paths: Sequence[Path]) -> list[Array]:
    return [path.evaluate(np.array([path.length]))[0] for path in paths]


def test_segments_without_zones_are_a_path_each() -> None:
    segments: list[Segment] = [Ptp(joints(0.2)), Lin(HERE), Spline([joints(0.1), joints(0.1, 0.1)])]
    paths = plan_path(UR5, START, segments)
    assert len(paths) == 3
    assert isinstance(paths[0], JointLine)
    trajectory = time_legs(paths, UR5.limits)
    certify(trajectory, UR5.limits, start=START)
    assert trajectory.final == tuple(joints(0.1, 0.1))


def test_segments_joined_by_zones_are_one_path() -> None:
    segments: list[Segment] = [
        Ptp(joints(0.2), zone=0.05),
        Ptp(joints(0.2, 0.2)),
        Lin(at(0.0, 0.1, 0.0), zone=0.02),
        Circ(ThroughPoint(point(0.05, 0.15, 0.0)), at(0.1, 0.1, 0.0), zone=0.02),
        Lin(at(0.1, 0.1, 0.1)),
    ]

    paths = plan_path(UR5, START, segments)

    assert len(paths) == 2
    assert isinstance(paths[0], JointPolyline)
    assert len(paths[1].waypoint_knots) == 4
    trajectory = time_legs(paths, UR5.limits)
    certify(trajectory, UR5.limits, start=START)
    assert (np.diff(trajectory.waypoint_times) > 0.0).all()
    assert UR5.forward(trajectory.final).position_distance(at(0.1, 0.1, 0.1)) <= 1e-5


def test_a_pose_and_a_joint_position_are_both_targets_of_every_kind() -> None:
    goal = joints(0.1, 0.05)
    for segment in (Ptp(UR5.forward(goal)), Lin(goal), Lin(UR5.forward(goal)), Spline([goal])):
        (path,) = plan_path(UR5, START, [segment])
        assert ends([path])[0] == pytest.approx(goal, abs=1e-4)


def test_a_target_in_the_root_frame_is_the_same_place() -> None:
    kinematics = arm("kawasaki_ra10n")
    start = [0.2, 0.2, -1.2, 0.3, -0.8, 0.2]
    goal = [value + 0.05 for value in start]
    in_root = kinematics.forward(goal, "root")
    for segment in (Ptp(in_root, "root"), Lin(in_root, "root"), Spline([in_root], frame="root")):
        (path,) = plan_path(kinematics, start, [segment])
        assert ends([path])[0] == pytest.approx(goal, abs=1e-4)


def test_a_circle_in_the_root_frame_is_the_same_circle() -> None:
    kinematics = arm("kawasaki_ra10n")
    start = [0.2, 0.2, -1.2, 0.3, -0.8, 0.2]
    goals = {}
    for frame in ("base", "root"):
        here, corner = (
            kinematics.forward([value + change for value in start], frame) for change in (0, 0.05)
        )
        centre = (here.position + corner.position) / 2.0
        up = kinematics.forward(start, frame).rotation @ [0.3, 0.5, 1.0]
        along = (corner.position - here.position) / here.position_distance(corner)
        normal = up - (up @ along) * along
        circ = Circ(AboutCentre(centre, normal), corner, frame=frame)
        (path,) = plan_path(kinematics, start, [circ])
        goals[frame] = path.evaluate(np.array([path.length / 2.0]))[0]

    assert goals["base"] == pytest.approx(goals["root"], abs=1e-6)


@pytest.mark.parametrize(
    ("way", "target", "length"),
    [
        (ThroughPoint(point(0.05, 0.05, 0.0)), at(0.0, 0.1, 0.0), math.pi * 0.05),
        (AboutCentre(CENTRE, [0, 0, 1]), at(0.0, 0.1, 0.0), math.pi * 0.05),
        (AboutCentre(CENTRE), at(0.0, 0.05, 0.05), math.pi * 0.025),
        (AboutCentre(CENTRE, more_than_half=True), at(0.0, 0.05, 0.05), math.pi * 0.075),
        (FullAboutCentre(CENTRE, [0, 0, 1]), None, math.pi * 0.1),
        (FullThroughPoints(point(0.05, 0.05, 0.0), point(0.0, 0.1, 0.0)), None, math.pi * 0.1),
    ],
    ids=["via", "half", "less", "more", "full about", "full through"],
)
def test_every_circle_has_its_length(way: CircleWay, target: Pose | None, length: float) -> None:
    (path,) = plan_path(UR5, START, [Circ(way, target)])
    places = path.evaluate(np.linspace(0.0, path.length, 500))
    positions = np.array([UR5.forward(place).position for place in places])
    run = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    assert run == pytest.approx(length, rel=1e-3)


def test_a_tool_that_turns_with_the_path_keeps_its_angle_to_it() -> None:
    way = AboutCentre(CENTRE, [0, 0, 1])
    (path,) = plan_path(UR5, START, [Circ(way, at(0.0, 0.1, 0.0), ToolTurn.WITH_THE_PATH)])
    for pose in map(UR5.forward, path.evaluate(np.linspace(0.0, path.length, 20))):
        spoke = HERE.rotation.T @ (HERE.position - CENTRE)
        found = pose.rotation.T @ (pose.position - CENTRE)
        assert found == pytest.approx(spoke, abs=1e-4)


def test_a_spline_of_the_tool_passes_its_poses() -> None:
    poses = [at(0.0, 0.05, 0.0), at(0.03, 0.1, 0.0), at(0.0, 0.1, 0.05)]
    (path,) = plan_path(UR5, START, [Spline(poses, SplineSpace.TOOL)])
    passing = path.evaluate(path.knots[path.waypoint_knots])
    for place, pose in zip(passing[1:], poses, strict=True):
        assert UR5.forward(place).position_distance(pose) <= 1e-5


def test_a_line_alone_is_the_same_path_as_linear_path() -> None:
    (path,) = plan_path(UR5, START, [Lin(at(0.0, 0.1, 0.05))])
    line = linear_path(UR5, START, at(0.0, 0.1, 0.05))
    assert path.length == pytest.approx(line.length, rel=1e-12)
    assert ends([path])[0] == pytest.approx(line.goal, abs=1e-12)


def test_segments_to_where_the_robot_stands_add_nothing() -> None:
    still: list[Segment] = [Ptp(START), Lin(HERE), Lin(START)]
    assert len(plan_path(UR5, START, [*still, Ptp(joints(0.1)), Ptp(joints(0.1))])) == 1
    with pytest.raises(errors.NoMotion):
        plan_path(UR5, START, still)


@pytest.mark.parametrize(
    ("segments", "waypoint", "largest"),
    [
        ([Ptp(joints(0.1), zone=0.1)], 0, 0.0),
        ([Ptp(joints(0.1), zone=0.1), Spline([START])], 0, 0.0),
        ([Lin(at(0, 0.1, 0), zone=0.01), Spline([START])], 0, 0.0),
        ([Ptp(joints(0.1), zone=0.11), Lin(at(0, 0.2, 0))], 0, 0.1),
        ([Ptp(joints(0.3)), Ptp(joints(0.1), zone=0.21), Lin(at(0, 0.3, 0))], 1, 0.2),
        ([Lin(at(0, 0.1, 0), zone=0.11), Ptp(joints(0.9))], 0, 0.1),
        ([Ptp(joints(0.2), zone=0.11), Ptp(joints(0.2, 0.2), zone=0.05), Lin(HERE)], 0, 0.1),
        ([Lin(TURNED, zone=0.01), Ptp(joints(0.3))], 0, 0.0),
        ([Ptp(joints(0.3), zone=0.05), Lin(joints(0.3))], 0, 0.0),
        ([Ptp(START, zone=0.05), Lin(at(0, 0.1, 0))], 0, 0.0),
        ([Ptp(joints(0.1), zone=0.11), Ptp(joints(0.1, 0.3))], 0, 0.1),
        ([Ptp(joints(0.3)), Ptp(joints(0.1), zone=0.05), Ptp(joints(0.1, 0.04))], 1, 0.04),
        ([Ptp(joints(0.3), zone=0.1), Ptp(joints(0.3, 0.1), zone=0.06), Ptp(START)], 0, 0.05),
        ([Lin(at(0, 0.1, 0), zone=0.03), Lin(at(0, 0.1, 0.02))], 0, 0.02),
        ([Lin(at(0, 0.1, 0), zone=0.03), Lin(at(0, 0.1, 0))], 0, 0.0),
        ([Ptp(joints(0.1), zone=0.03), Ptp(joints(0.1))], 0, 0.0),
        ([Ptp(START), Lin(HERE, zone=0.03), Lin(at(0, 0.1, 0))], 1, 0.0),
    ],
)
def test_a_zone_that_cannot_be_is_refused_with_its_waypoint_and_the_largest_that_works(
    segments: list[Segment], waypoint: int, largest: float
) -> None:
    with pytest.raises(errors.ZoneTooLarge) as refusal:
        plan_path(UR5, START, segments)
    assert refusal.value.waypoint == waypoint
    assert refusal.value.largest == pytest.approx(largest)


CORNER = joints(0.2, 0.1)
BESIDE = UR5.forward(CORNER).position + np.array([0.0, 0.05, 0.0])
MIXED: dict[str, list[Segment]] = {
    "PTP LIN": [Ptp(CORNER, zone=0.1), Lin(HERE)],
    "LIN PTP": [Lin(at(0.0, 0.1, 0.0), zone=0.05), Ptp(CORNER)],
    "PTP CIRC": [Ptp(CORNER, zone=0.1), Circ(FullAboutCentre(BESIDE, [0, 0, 1]))],
    "PTP LIN PTP": [Ptp(CORNER, zone=0.1), Lin(HERE, zone=0.03), Ptp(joints(-0.3))],
    "all": [
        Ptp(joints(0.2), zone=0.05),
        Ptp(CORNER, zone=0.05),
        Lin(at(0.0, 0.1, 0.0), zone=0.02),
        Circ(ThroughPoint(point(0.05, 0.15, 0.0)), at(0.1, 0.1, 0.0), zone=0.02),
        Ptp(joints(0.3), zone=0.1),
        Lin(at(0.1, 0.1, 0.1)),
    ],
    "there and back": [Ptp(joints(0.1), zone=0.1), Lin(HERE)],
}


@pytest.mark.parametrize("name", MIXED)
def test_joint_and_tool_segments_are_joined_by_zones_into_one_certified_motion(name: str) -> None:
    segments = MIXED[name]
    (path,) = plan_path(UR5, START, segments)
    assert len(path.waypoint_knots) == len(segments) + 1
    trajectory = time_legs([path], UR5.limits)
    certify(trajectory, UR5.limits, start=START)
    assert (np.diff(trajectory.waypoint_times) > 0.0).all()


def test_a_zone_between_lin_and_ptp_begins_that_far_from_the_corner() -> None:
    corner = at(0.0, 0.1, 0.0)
    (line,) = plan_path(UR5, START, [Lin(corner)])
    (path,) = plan_path(UR5, START, [Lin(corner, zone=0.04), Ptp(joints(0.3, 0.2))])
    s = np.linspace(0.0, line.length, 4000)
    off = np.abs(path.evaluate(s) - line.evaluate(s)).max(axis=1)
    leaving = UR5.forward(line.evaluate(s[[int(np.argmax(off > 1e-9))]])[0])
    assert leaving.position_distance(corner) == pytest.approx(0.04, rel=0.02)


def test_a_zone_saves_the_stop_between_ptp_and_lin() -> None:
    last = Lin(at(-0.3, 0.3, 0.0))
    stopping, rounded = (
        plan_path(UR5, START, [Ptp(joints(1.0, 0.2), zone=zone), last]) for zone in (0.0, 0.3)
    )
    saved = time_legs(stopping, UR5.limits).duration - time_legs(rounded, UR5.limits).duration
    assert saved > 0.05


BAD = math.nan


@pytest.mark.parametrize(
    ("segment", "reason"),
    [
        (Ptp([0.0] * 5), errors.WrongJointCount),
        (Ptp([BAD] * 6), errors.NotFinite),
        (Ptp([7.0, *START[1:]]), errors.OutOfRange),
        (Ptp(HERE, frame="moon"), errors.FrameUnknown),
        (Lin(HERE, frame="moon"), errors.FrameUnknown),
        (Lin([0.0] * 5), errors.WrongJointCount),
        (Lin([BAD] * 6), errors.NotFinite),
        (Lin(at(3.0, 0.0, 0.0)), errors.PoseUnreachable),
        (Ptp(at(3.0, 0.0, 0.0)), errors.PoseUnreachable),
        (Circ(ThroughPoint(point(0.0, 0.1, 0.0)), at(0.0, 0.1, 0.0)), errors.BadCircle),
        (Circ(ThroughPoint([BAD, 0.0, 0.0]), at(0.0, 0.1, 0.0)), errors.NotFinite),
        (Circ(ThroughPoint(point(0.0, 0.05, 0.0))), errors.BadArgument),
        (Circ(FullAboutCentre(point(0.0, 0.1, 0.0), [0, 0, 1]), HERE), errors.BadArgument),
        (Circ(AboutCentre(CENTRE), at(0.0, 0.11, 0.0)), errors.BadCircle),
        (Ptp(joints(0.1), zone=BAD), errors.NotFinite),
        (Ptp(joints(0.1), zone=-0.1), errors.BadArgument),
        (Ptp(joints(0.1), zone=1e-5), errors.BadArgument),
        (Spline([]), errors.BadArgument),
        (Spline([[BAD] * 6]), errors.NotFinite),
        (Spline([at(3.0, 0.0, 0.0)], SplineSpace.TOOL), errors.PoseUnreachable),
    ],
)
def test_a_segment_that_is_refused_is_named(segment: Segment, reason: type[Exception]) -> None:
    with pytest.raises(errors.SegmentRefused, match="segment 1: ") as refusal:
        plan_path(UR5, START, [Ptp(joints(0.1)), segment, Ptp(joints(0.2))])
    assert refusal.value.segment == 1
    assert isinstance(refusal.value.reason, reason)


def test_a_refusal_on_the_way_counts_the_fraction_of_its_own_segment() -> None:
    alone = [Lin(at(0.0, 0.1, 0.0)), Lin(at(2.0, 0.1, 0.0))]
    rounded = [Lin(at(0.0, 0.1, 0.0), zone=0.02), Lin(at(2.0, 0.1, 0.0))]

    fractions = []
    for segments in (alone, rounded):
        with pytest.raises(errors.SegmentRefused) as refusal:
            plan_path(UR5, START, segments)
        assert refusal.value.segment == 1
        assert isinstance(refusal.value.reason, errors.PoseUnreachable | errors.OutOfRange)
        fractions.append(refusal.value.reason.fraction)

    assert fractions[0] == pytest.approx(fractions[1], abs=0.005)


@pytest.mark.parametrize("count", [0, MOST_SEGMENTS + 1])
def test_no_segments_and_too_many_are_refused(count: int) -> None:
    with pytest.raises(errors.BadArgument, match="segments"):
        plan_path(UR5, START, [Ptp(START)] * count)


@pytest.mark.parametrize(
    ("start", "error"),
    [
        ([7.0, *START[1:]], errors.OutOfRange),
        ([BAD] * 6, errors.NotFinite),
        (START[:5], errors.WrongJointCount),
    ],
)
def test_a_start_that_is_none_is_refused(start: list[float], error: type[Exception]) -> None:
    with pytest.raises(error):
        plan_path(UR5, start, [Ptp(joints(0.1))])


def mixed(kinematics: Kinematics, random: np.random.Generator) -> tuple[Array, list[Segment]]:
    """A random start and a list of segments, each about a twentieth of the arm's size."""
    middle, half = (kinematics.lower + kinematics.upper) / 2, kinematics.upper - kinematics.lower
    start = middle + random.uniform(-0.2, 0.2, kinematics.dof) * half
    away = start + random.uniform(-0.05, 0.05, (2, kinematics.dof)) * half
    here, size = kinematics.forward(away[1]), kinematics.size / 20.0
    shifts = np.cumsum(random.choice([-1.0, 1.0], (3, 3)) * np.diag([size] * 3), axis=0)
    corners = [Pose(here.position + shift, here.quaternion) for shift in shifts]
    via = (corners[0].position + corners[1].position) / 2.0 + [size / 4.0, 0.0, 0.0]
    zone = float(np.linalg.norm(np.diff(away, axis=0))) / 4.0
    into_line = random.uniform(0.1, 1.0) * min(zone, size / 4.0)
    return start, [
        Ptp(away[0].tolist(), zone=min(zone, float(np.linalg.norm(away[0] - start)) / 4.0)),
        Ptp(away[1].tolist(), zone=into_line),
        Lin(corners[0], zone=size * random.uniform(0.1, 0.5)),
        Circ(ThroughPoint(via), corners[1], zone=size * random.uniform(0.1, 0.5)),
        Lin(corners[2], zone=size / 4.0),
        Ptp(away[1].tolist()),
    ]


@pytest.mark.parametrize("count", counts(1, 30))
@pytest.mark.parametrize("name", one_of_each_family(SERIAL))
def test_random_lists_of_segments_are_certified(name: str, count: int) -> None:
    kinematics, random, done = arm(name), np.random.default_rng(1), 0
    for _ in range(20 * count):
        start, segments = mixed(kinematics, random)
        try:
            paths = plan_path(kinematics, start, segments)
        except (errors.SegmentRefused, errors.ZoneTooLarge):
            continue
        trajectory = time_legs(paths, kinematics.limits)
        certify(trajectory, kinematics.limits, start=start)
        assert (np.diff(trajectory.waypoint_times) > 0.0).all()
        done += 1
        if done == count:
            return
    pytest.fail(f"only {done} of {count} could be planned")
