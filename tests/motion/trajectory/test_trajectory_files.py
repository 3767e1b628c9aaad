import locale
from collections.abc import Iterator

import numpy as np
import pytest
import yaml

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, WrongJointCount
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.motion.trajectory.trajectory_files import from_csv, to_csv, to_ros_yaml

LIMITS = JointLimits(
    names=("turn", 'a "quoted", name', "slide"),
    lower=(-3.0, -2.0, -1.0),
    upper=(3.0, 2.0, 1.0),
    velocity=(2.0, 1.5, 0.5),
    acceleration=(8.0, 6.0, 2.0),
    prismatic=(False, False, True),
)


@pytest.fixture(scope="module")
def swing() -> Trajectory:
    return time_path(JointSpline([[0.0, 0.0, 0.0], [1.0, -1.0, 1e-5], [0.5, 1.0, -0.3]]), LIMITS)


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
    read = from_csv(to_csv(swing, LIMITS), LIMITS)
    for field in ("times", "position", "velocity", "acceleration"):
        assert np.array_equal(getattr(read, field), getattr(swing, field))
    certify(read, LIMITS)


@pytest.mark.usefixtures("comma_locale")
def test_csv_has_a_column_with_a_unit_for_each_quantity_and_decimal_dots(swing: Trajectory) -> None:
    header, first, second, *_ = to_csv(swing, LIMITS).splitlines()
    assert header.startswith('time [s],turn position [rad],"a ""quoted"", name position [rad]",')
    assert header.endswith("slide acceleration [m/s²]")
    assert first.startswith("0.0,")
    assert second.startswith("0.01,")


def test_csv_of_a_spreadsheet_is_read_too(swing: Trajectory) -> None:
    text = "\ufeff" + to_csv(swing, LIMITS).replace("\n", "\r\n")
    assert np.array_equal(from_csv(text, LIMITS).position, swing.position)


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
    text = to_csv(swing, LIMITS)
    assert old in text
    with pytest.raises(BadArgument, match=words):
        from_csv(text.replace(old, new, 1), LIMITS)


@pytest.mark.parametrize("text", ["", "\n", "time [s]\n0.0\n"])
def test_a_csv_without_samples_is_refused(text: str) -> None:
    with pytest.raises(BadArgument, match="two samples"):
        from_csv(text, LIMITS)


def test_ros_yaml_holds_names_and_every_point(swing: Trajectory) -> None:
    message = yaml.safe_load(to_ros_yaml(swing, LIMITS))

    assert message["joint_names"] == list(LIMITS.names)
    assert len(message["points"]) == len(swing)
    for index, point in enumerate(message["points"]):
        assert point["positions"] == swing.position[index].tolist()
        assert point["velocities"] == swing.velocity[index].tolist()
        assert point["accelerations"] == swing.acceleration[index].tolist()
        stamp = point["time_from_start"]
        assert stamp["sec"] + stamp["nanosec"] * 1e-9 == pytest.approx(swing.times[index])
        assert 0 <= stamp["nanosec"] < 10**9


def test_tiny_numbers_stay_numbers_in_yaml() -> None:
    move = plan_joint_move([0.0, 0.0, 0.0], [1.0, 1e-9, 0.0], LIMITS)
    points = yaml.safe_load(to_ros_yaml(move, LIMITS))["points"]
    assert all(isinstance(value, float) for point in points for value in point["positions"])


def test_another_robots_trajectory_is_refused() -> None:
    single = JointLimits(("a",), (-1.0,), (1.0,), (1.0,), (1.0,), (False,))
    move = plan_joint_move([0.0], [0.5], single)
    with pytest.raises(WrongJointCount):
        to_csv(move, LIMITS)
    with pytest.raises(WrongJointCount):
        to_ros_yaml(move, LIMITS)
