import locale
import math
import pickle
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import yaml
from rigs.motion import three_joints
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, WrongJointCount
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import SAMPLE_PERIOD, Trajectory, join
from openpendant.motion.trajectory.trajectory_files import from_csv, to_csv, to_ros_yaml

LIMITS = JointLimits(
    names=("turn", "slide"),
    lower=(-3.0, -1.0),
    upper=(3.0, 1.0),
    velocity=(2.0, 0.5),
    acceleration=(8.0, 2.0),
    prismatic=(False, True),
)
HERE, THERE, ELSEWHERE = [0.0, 0.0], [1.0, -0.2], [-0.5, 0.3]
FIELDS = ("times", "position", "velocity", "acceleration", "waypoint_times")


@pytest.fixture
def move() -> Trajectory:
    return plan_joint_move(HERE, THERE, LIMITS)


@pytest.mark.parametrize("field", FIELDS)
def test_the_arrays_cannot_be_written(move: Trajectory, field: str) -> None:
    with pytest.raises(ValueError, match="read-only"):
        getattr(move, field)[0] = 1.0


@pytest.mark.parametrize("field", FIELDS)
def test_a_trajectory_survives_the_way_between_processes(move: Trajectory, field: str) -> None:
    arrived = pickle.loads(pickle.dumps(move))
    assert np.array_equal(getattr(arrived, field), getattr(move, field))
    assert not getattr(arrived, field).flags.writeable


def test_pickling_adds_little_to_the_numbers(move: Trajectory) -> None:
    assert len(pickle.dumps(move)) < sum(getattr(move, field).nbytes for field in FIELDS) + 1000


def test_at_a_sample_the_sample_is_returned(move: Trajectory) -> None:
    for row, time in enumerate(move.times.tolist()):
        state = move.sample(time)
        assert np.array_equal(state.position, move.position[row])
        assert np.array_equal(state.velocity, move.velocity[row])
        assert np.array_equal(state.acceleration, move.acceleration[row])


def test_between_samples_of_constant_acceleration_the_motion_is_exact(move: Trajectory) -> None:
    row, ahead = 3, 0.004
    state = move.sample(float(move.times[row]) + ahead)
    position, velocity = move.position[row], move.velocity[row]
    acceleration = move.acceleration[row]
    assert state.velocity == pytest.approx(velocity + acceleration * ahead, abs=1e-12)
    assert state.position == pytest.approx(
        position + velocity * ahead + acceleration * ahead**2 / 2.0, abs=1e-12
    )


@pytest.mark.parametrize(("time", "row"), [(-1.0, 0), (-math.inf, 0), (1e9, -1), (math.inf, -1)])
def test_outside_its_time_the_motion_stands_still(move: Trajectory, time: float, row: int) -> None:
    state = move.sample(time)
    assert np.array_equal(state.position, move.position[row])
    assert not state.velocity.any()


def test_joined_legs_follow_one_another() -> None:
    first = plan_joint_move(HERE, THERE, LIMITS)
    second = plan_joint_move(THERE, ELSEWHERE, LIMITS)

    whole = join([first, second])

    meeting = len(first.times) - 1
    assert whole.duration == pytest.approx(first.duration + second.duration)
    assert np.diff(whole.times) == pytest.approx(SAMPLE_PERIOD)
    assert np.array_equal(whole.position[: meeting + 1], first.position)
    assert np.array_equal(whole.position[meeting:], second.position)
    assert not whole.velocity[meeting].any()
    assert whole.waypoint_times == pytest.approx([0.0, first.duration, whole.duration])


THREE = replace(three_joints.THREE, names=("turn", 'a "quoted", name', "slide"))


@pytest.fixture(scope="module")
def swing() -> Trajectory:
    return time_path(JointSpline([[0.0, 0.0, 0.0], [1.0, -1.0, 1e-5], [0.5, 1.0, -0.3]]), THREE)


@pytest.fixture
def comma_locale() -> Iterator[None]:
    """A locale that writes 1,5 where one is installed; else the test shows less."""
    before = locale.setlocale(locale.LC_NUMERIC)
    for name in ("de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"):
        try:
            locale.setlocale(locale.LC_NUMERIC, name)
            break
        except locale.Error:
            continue
    yield
    locale.setlocale(locale.LC_NUMERIC, before)


@pytest.mark.usefixtures("comma_locale")
def test_csv_gives_the_same_numbers_again_to_the_last_bit(swing: Trajectory) -> None:
    read = from_csv(to_csv(swing, THREE), THREE)
    for field in ("times", "position", "velocity", "acceleration"):
        assert np.array_equal(getattr(read, field), getattr(swing, field))
    certify(read, THREE)


@pytest.mark.usefixtures("comma_locale")
def test_csv_has_a_column_with_a_unit_for_each_quantity_and_decimal_dots(swing: Trajectory) -> None:
    header, first, second, *_ = to_csv(swing, THREE).splitlines()
    assert header.startswith('time [s],turn position [rad],"a ""quoted"", name position [rad]",')
    assert header.endswith("slide acceleration [m/s²]")
    assert first.startswith("0.0,")
    assert second.startswith("0.01,")


def test_csv_of_a_spreadsheet_is_read_too(swing: Trajectory) -> None:
    text = "\ufeff" + to_csv(swing, THREE).replace("\n", "\r\n")
    assert np.array_equal(from_csv(text, THREE).position, swing.position)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("turn position [rad]", "turn position [deg]", "column 2"),
        ("time [s],", "", "column 1"),
        ("\n0.01,", "\n0,01,", "line 3 is .*accepted: 10 values"),
        ("\n0.01,", "\nx,", "line 3, column 1"),
        ("\n0.01,", "\nnan,", "line 3, column 1"),
        ("\n0.02,", "\n0.01,", "time in CSV line 4"),
    ],
)
def test_a_csv_that_is_not_as_written_is_refused_with_its_place(
    swing: Trajectory, old: str, new: str, words: str
) -> None:
    text = to_csv(swing, THREE)
    assert old in text
    with pytest.raises(BadArgument, match=words):
        from_csv(text.replace(old, new, 1), THREE)


def test_ros_yaml_holds_names_and_every_point(swing: Trajectory) -> None:
    message = yaml.safe_load(to_ros_yaml(swing, THREE))

    assert message["joint_names"] == list(THREE.names)
    assert len(message["points"]) == len(swing)
    for index, point in enumerate(message["points"]):
        assert point["positions"] == swing.position[index].tolist()
        assert point["velocities"] == swing.velocity[index].tolist()
        assert point["accelerations"] == swing.acceleration[index].tolist()
        stamp = point["time_from_start"]
        assert stamp["sec"] + stamp["nanosec"] * 1e-9 == pytest.approx(swing.times[index])
        assert 0 <= stamp["nanosec"] < 10**9


def test_tiny_numbers_stay_numbers_in_yaml() -> None:
    move = plan_joint_move([0.0, 0.0, 0.0], [1.0, 1e-9, 0.0], THREE)
    points = yaml.safe_load(to_ros_yaml(move, THREE))["points"]
    assert all(isinstance(value, float) for point in points for value in point["positions"])


MOVE = plan_joint_move(HERE, THERE, LIMITS)
ALONE = plan_joint_move(
    [0.0], [0.5], JointLimits(("a",), (-1.0,), (1.0,), (1.0,), (1.0,), (False,))
)
SLOWER = plan_joint_move(THERE, HERE, LIMITS, sample_period=0.02)


@refusals(
    ("less velocity", lambda: replace(MOVE, velocity=MOVE.velocity[1:]), BadArgument, "velocity"),
    ("less time", lambda: replace(MOVE, times=MOVE.times[1:]), BadArgument, "one row of joints"),
    ("no time", lambda: MOVE.sample(math.nan), BadArgument, "time"),
    ("legs that do not meet", lambda: join([MOVE, MOVE]), BadArgument, "leg 1 starts elsewhere"),
    ("another sample period", lambda: join([MOVE, SLOWER]), BadArgument, "sample period"),
    ("no legs", lambda: join([]), BadArgument, "at least one"),
    ("no CSV", lambda: from_csv("", THREE), BadArgument, "two samples"),
    ("an empty line", lambda: from_csv("\n", THREE), BadArgument, "two samples"),
    ("one sample", lambda: from_csv("time [s]\n0.0\n", THREE), BadArgument, "two samples"),
    ("another robot's as CSV", lambda: to_csv(ALONE, THREE), WrongJointCount, ""),
    ("another robot's as YAML", lambda: to_ros_yaml(ALONE, THREE), WrongJointCount, ""),
)
def test_what_is_no_trajectory_here_is_refused(refusal: Refusal) -> None:
    refusal.check()
