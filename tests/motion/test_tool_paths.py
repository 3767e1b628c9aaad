import math
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from path_accuracy import PathAccuracy, executed, path_accuracy

from openpendant.motion.certificate import certify
from openpendant.motion.circles import ToolArc, ToolTurn, arc_through, circle_about
from openpendant.motion.errors import BranchChange, MotionError, NoMotion, OutOfRange, Unreachable
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.robot import SerialRobot, load_robot, robot_names, serial_robot
from openpendant.motion.timing import time_path
from openpendant.motion.tool_chain import ToolChain
from openpendant.motion.tool_curves import Places, ToolCurve, ToolLine, ToolSpline
from openpendant.motion.tool_paths import deviation, follow_tool_curve
from openpendant.motion.trajectory import SAMPLE_PERIOD

Array = NDArray[np.float64]

SERIAL = [name for name in robot_names() if isinstance(load_robot(name), SerialRobot)]
GREATEST = PathAccuracy(distance=0.1, angle=0.05)
# The SCARA's joints reach 12 g: what it can do within 10 ms is more than the points show.
FAST = {"mitsubishi_rh6frh5520": 0.004}
UR5 = [0.3, -1.4, 1.6, -1.2, -1.3, 0.4]


@cache
def robot(name: str) -> Kinematics:
    return Kinematics(serial_robot(name))


class Attempt(NamedTuple):
    start: list[float]
    curves: dict[str, ToolCurve]


def attempts(kinematics: Kinematics, seed: int) -> Iterator[Attempt]:
    """Tool curves of a tenth of the arm's size, from random places; not all can be reached."""
    random = np.random.default_rng(seed)
    while True:
        middle, half = (
            (kinematics.lower + kinematics.upper) / 2,
            kinematics.upper - kinematics.lower,
        )
        start = middle + random.uniform(-0.25, 0.25, kinematics.dof) * half
        here = kinematics.forward(start)
        ahead, aside = random.normal(size=(2, 3)) * kinematics.size / 10.0
        # Arms of fewer axes than six turn their tool about the vertical only.
        turn = random.uniform(-0.3, 0.3, 3) * ([1, 1, 1] if kinematics.dof >= 6 else [0, 0, 1])
        turned = Pose.from_rpy([0.0] * 3, turn).compose(Pose(np.zeros(3), here.quaternion))
        there, last = (Pose(here.position + shift, turned.quaternion) for shift in (ahead, aside))
        via = here.position + ahead / 2.0 + aside / 3.0
        size = min(math.hypot(*ahead), math.dist(there.position, last.position))
        legs = [ToolLine(here, there), ToolLine(there, last)]
        circle = circle_about(here.position, via, np.cross(via - here.position, ahead))
        yield Attempt(
            start.tolist(),
            {
                "lin": legs[0],
                "arc": ToolArc(arc_through(here.position, via, there.position), here, there),
                "circle": ToolArc(circle, here, here, ToolTurn.CONSTANT),
                "zone": ToolChain(legs, [size / 3.0]),
                "spline": ToolSpline([here, there, last]),
            },
        )


def measured(kinematics: Kinematics, start: list[float], curve: ToolCurve) -> PathAccuracy:
    path = follow_tool_curve(kinematics, start, curve)
    period = FAST.get(kinematics.robot.name, SAMPLE_PERIOD)
    trajectory = time_path(path, kinematics.limits, sample_period=period)
    certify(trajectory, kinematics.limits, start=start)
    return path_accuracy(kinematics, curve, executed(trajectory, kinematics.limits))


def worst_of(name: str, seed: int, wanted: int) -> dict[str, PathAccuracy]:
    """The worst accuracy of each kind of curve, over as many as wanted that can be reached."""
    kinematics = robot(name)
    found: dict[str, list[PathAccuracy]] = {}
    for _, attempt in zip(range(20 * wanted), attempts(kinematics, seed), strict=False):
        for kind, curve in attempt.curves.items():
            if len(found.setdefault(kind, [])) == wanted:
                continue
            try:
                found[kind].append(measured(kinematics, attempt.start, curve))
            except (Unreachable, OutOfRange, BranchChange):
                continue
        if all(len(values) == wanted for values in found.values()):
            break
    assert all(found.values()), "a kind of curve was never reached"
    return {
        kind: PathAccuracy(*(max(column) for column in zip(*values, strict=True)))
        for kind, values in found.items()
    }


# Every second robot here, all of them with twenty times the paths in the soak test below.
@pytest.mark.parametrize("name", sorted({"ur5", *sorted(SERIAL)[::2]}))
def test_the_executed_tool_keeps_its_path_within_a_tenth_of_a_millimetre(
    name: str, record_property: Callable[[str, object], None]
) -> None:
    for kind, worst in worst_of(name, 1, 1).items():
        record_property(kind, f"{worst.distance:.3f} mm, {worst.angle:.4f}°")
        assert worst.distance <= GREATEST.distance
        assert worst.angle <= GREATEST.angle


@pytest.mark.soak
@pytest.mark.parametrize("name", SERIAL)
def test_many_executed_paths_are_kept_within_a_tenth_of_a_millimetre(name: str) -> None:
    for kind, worst in worst_of(name, 2, 20).items():
        assert worst.distance <= GREATEST.distance, kind
        assert worst.angle <= GREATEST.angle, kind


def shifted(pose: Pose, shift: list[float]) -> Pose:
    return Pose(pose.position + shift, pose.quaternion)


def test_the_planned_tool_is_twice_as_exact() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    curve = ToolLine(here, shifted(here, [-0.1, 0.2, 0.1]))

    path = follow_tool_curve(kinematics, UR5, curve)

    joints = path.evaluate(np.linspace(0.0, path.length, 10 * len(path.knots)))
    worst = path_accuracy(kinematics, curve, joints)
    assert worst.distance <= 0.05
    assert worst.angle <= 0.025


def test_waypoints_are_passed_where_the_curve_passes_them() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    corner = shifted(here, [0.0, 0.1, 0.0])
    last = shifted(corner, [0.0, 0.0, 0.1])
    chain = ToolChain([ToolLine(here, corner), ToolLine(corner, last)], [0.03])

    path = follow_tool_curve(kinematics, UR5, chain)

    passing = path.evaluate(path.knots[path.waypoint_knots])
    positions = [kinematics.forward(position).position for position in passing]
    assert len(positions) == 3
    assert math.dist(positions[1], corner.position) == pytest.approx(
        3.0 * 0.03 / 8.0 * math.sin(math.pi / 4.0), abs=1e-5
    )
    assert positions[2] == pytest.approx(last.position, abs=1e-5)


def test_deviation_is_measured_from_the_nearest_place_not_from_the_one_in_time() -> None:
    line = ToolLine(Pose.identity(), Pose.from_values([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]))
    places = Places(np.eye(3)[np.newaxis], np.array([[0.5, 0.003, 0.004]]))

    distance, angle = deviation(line, places, np.array([0.4]))

    assert (distance[0], angle[0]) == pytest.approx((0.005, 0.0))


@pytest.mark.parametrize(
    ("shift", "least", "most"), [([2.0, 0.0, 0.0], 0.1, 0.8), ([0.0, 0.0, 40.0], 0.0, 0.05)]
)
def test_a_curve_that_leaves_the_reach_is_refused_with_its_fraction(
    shift: list[float], least: float, most: float
) -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)

    with pytest.raises((Unreachable, OutOfRange)) as refusal:
        follow_tool_curve(kinematics, UR5, ToolLine(here, shifted(here, shift)))

    error = refusal.value
    assert isinstance(error, Unreachable | OutOfRange)
    assert error.fraction is not None
    assert least < error.fraction < most


def test_a_circle_of_a_hundred_metres_is_refused_soon() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    centre = shifted(here, [0.0, 99.0, 0.0]).position
    circle = circle_about(here.position, centre, [0.0, 0.0, 1.0])

    with pytest.raises(MotionError):
        follow_tool_curve(kinematics, UR5, ToolArc(circle, here, here))


def test_a_curve_too_short_to_move_a_joint_is_no_motion() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)

    with pytest.raises(NoMotion):
        follow_tool_curve(kinematics, UR5, ToolLine(here, shifted(here, [1e-8, 0.0, 0.0])))


@pytest.mark.parametrize("swing", [0.05, 0.2])
@pytest.mark.parametrize("fourth", [0.0, 0.2, 1.0])
def test_a_line_through_the_wrist_singularity_is_exact(fourth: float, swing: float) -> None:
    kinematics = robot("abb_irb2400")
    start, goal = ([0.1, 0.1, 0.1, fourth, fifth, 0.1] for fifth in (swing, -swing))

    line = ToolLine(kinematics.forward(start), kinematics.forward(goal))
    worst = measured(kinematics, start, line)

    assert worst.distance <= GREATEST.distance
    assert worst.angle <= GREATEST.angle
