"""Numbers of a taught point: as people read them, inside the limits, one in text and document."""

import math
import re
import struct
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.example_counts import few

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import SerialRobot, load_robot, robot_names
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.printer import print_program
from openpendant.server.programs.language.program import Program
from openpendant.server.programs.language.taught_numbers import taught_joints, taught_position
from openpendant.simplemsg.pendant.management.program_values import PointPose, TeachPoint

HALF_A_DIGIT = {True: 0.5e-7, False: math.radians(0.5e-6)}
"""Half of the last digit that is read, of a linear axis [m] and of a turning one [rad]."""

NOISE = 1e-15
"""What a conversion of reals adds."""


@cache
def all_limits() -> tuple[JointLimits, ...]:
    """Return the limits of all serial robots."""
    robots = map(load_robot, robot_names())
    return tuple(robot.limits for robot in robots if isinstance(robot, SerialRobot))


def program_of(joints: tuple[float, ...], limits: JointLimits) -> Program:
    linear = tuple(index for index, slides in enumerate(limits.prismatic) if slides)
    position = taught_position((0.123456789, -0.2, 1.9999999999))
    pose = PointPose(position, (0.0, 0.0, 0.0, 1.0), "base", "flange")
    return Program("p", "robot", linear_axes=linear, points=(TeachPoint("a", joints, pose),))


def check(joints: tuple[float, ...], limits: JointLimits) -> None:
    """Check that a taught position is legal, short, and one number in text and document."""
    limits.check_position(joints)
    program = program_of(joints, limits)
    text = print_program(program)
    assert parse(text) == program
    assert print_program(parse(text)) == text
    (line,) = re.findall(r"^  joints (.*)$", text, re.MULTILINE)
    for number, slides in zip(re.findall(r"-?[0-9.]+", line), limits.prismatic, strict=True):
        assert len(number.partition(".")[2]) <= (4 if slides else 6), line


fractions = st.floats(0.0, 1.0)


@few(60)
@given(st.data())
def test_a_taught_position_is_within_the_limits_and_half_a_digit_and_the_same_in_its_text(
    data: st.DataObject,
) -> None:
    limits = data.draw(st.sampled_from(all_limits()))
    joints = tuple(
        min(max(lower + data.draw(fractions) * (upper - lower), lower), upper)
        for lower, upper in zip(limits.lower, limits.upper, strict=True)
    )
    taught = taught_joints(joints, limits)
    check(taught, limits)
    for index, (value, was) in enumerate(zip(taught, joints, strict=True)):
        # Next to a limit it is rounded inward, by up to a whole digit.
        near = min(was - limits.lower[index], limits.upper[index] - was)
        digit = HALF_A_DIGIT[limits.prismatic[index]]
        assert abs(value - was) <= (digit if near > 2 * digit else 2 * digit) + NOISE


@few(60)
@given(st.data())
def test_whatever_the_limits_are_a_point_that_is_taught_on_one_is_legal(
    data: st.DataObject,
) -> None:
    slides = data.draw(st.booleans())
    lower = data.draw(st.floats(-7.0, 6.0))
    upper = lower + data.draw(st.floats(1e-5, 7.0))
    limits = JointLimits(("a",), (lower,), (upper,), (1.0,), (1.0,), (slides,))
    for bound in (lower, upper):
        for reported in (bound, math.nextafter(bound, math.inf), math.nextafter(bound, -math.inf)):
            taught = taught_joints((reported,), limits)
            check(taught, limits)
            assert abs(taught[0] - bound) <= 2 * HALF_A_DIGIT[slides] + NOISE


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_point_that_is_taught_on_every_limit_of_a_robot_is_legal(side: str) -> None:
    for limits in all_limits():
        bounds = getattr(limits, side)
        # As the controller reports it: a 4-byte real may be beyond the limit.
        reported = struct.unpack(f"<{limits.dof}f", struct.pack(f"<{limits.dof}f", *bounds))
        for joints in (bounds, reported):
            check(taught_joints(joints, limits), limits)


UPPER = math.radians(120) - 1e-9
LIMITS = JointLimits(("a",), (-1.0,), (UPPER,), (1.0,), (1.0,), (False,))


def test_the_nearest_text_that_is_outside_is_not_taken() -> None:
    assert math.degrees(UPPER) == pytest.approx(119.99999994, abs=1e-8)
    (taught,) = taught_joints((UPPER,), LIMITS)
    assert taught == math.radians(119.999999)
    (low,) = taught_joints((-1.0,), LIMITS)
    assert math.degrees(low) == pytest.approx(-57.295779, abs=1e-9)
    assert low >= -1.0


def test_a_robot_that_stands_outside_is_not_taught_inside() -> None:
    (taught,) = taught_joints((UPPER + 1e-5,), LIMITS)
    assert taught > UPPER
    assert taught == pytest.approx(UPPER + 1e-5, abs=1e-8)


def test_a_range_that_is_narrower_than_a_digit_keeps_the_position() -> None:
    limits = JointLimits(("a",), (1e-10,), (2e-10,), (1.0,), (1.0,), (False,))
    assert taught_joints((1.5e-10,), limits) == (1.5e-10,)


def test_a_pose_is_taught_to_a_tenth_of_a_micrometre() -> None:
    assert taught_position((0.12345678901, -1.0, 1e-9)) == (0.1234568, -1.0, 0.0)
