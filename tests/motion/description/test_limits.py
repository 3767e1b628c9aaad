import math
import struct
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits, float32_ceiling

LIMITS = JointLimits(
    names=("rail", "shoulder"),
    lower=(0.0, -1.1),
    upper=(3.0, 2.2),
    velocity=(1.5, 2.6),
    acceleration=(2.0, 5.2),
    prismatic=(True, False),
)


def float32(value: float) -> float:
    rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return rounded


@pytest.mark.parametrize("position", [(0.0, -1.1), (3.0, 2.2), (1.0, 0.0)])
def test_a_position_on_or_inside_the_bounds_is_accepted(position: tuple[float, float]) -> None:
    LIMITS.check_position(position)


@pytest.mark.parametrize(
    ("position", "joint", "unit"),
    [
        ((math.nextafter(0.0, -1.0), 0.0), 0, "m"),
        ((math.nextafter(3.0, 9.0), 0.0), 0, "m"),
        ((1.0, math.nextafter(-1.1, -9.0)), 1, "rad"),
        ((1.0, math.nextafter(2.2, 9.0)), 1, "rad"),
    ],
)
def test_a_position_beyond_a_bound_is_refused_with_joint_value_and_unit(
    position: tuple[float, float], joint: int, unit: str
) -> None:
    with pytest.raises(errors.OutOfRange) as refused:
        LIMITS.check_position(position)
    error = refused.value
    assert (error.joint, error.index, error.unit) == (LIMITS.names[joint], joint, unit)
    assert error.value == position[joint]
    assert (error.lower, error.upper) == (LIMITS.lower[joint], LIMITS.upper[joint])


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_speed_at_the_limit_is_accepted_and_beyond_is_refused(sign: float) -> None:
    LIMITS.check_velocity((sign * 1.5, sign * 2.6))
    with pytest.raises(errors.TooFast) as refused:
        LIMITS.check_velocity((0.0, sign * 2.7))
    assert (refused.value.joint, refused.value.value) == ("shoulder", sign * 2.7)
    assert refused.value.limit == 2.6


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_acceleration_at_the_limit_is_accepted_and_beyond_is_refused(sign: float) -> None:
    LIMITS.check_acceleration((sign * 2.0, sign * 5.2))
    with pytest.raises(errors.TooSharp) as refused:
        LIMITS.check_acceleration((sign * 2.1, 0.0))
    assert (refused.value.joint, refused.value.unit) == ("rail", "m")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_refused_by_every_check(value: float) -> None:
    for check in (LIMITS.check_position, LIMITS.check_velocity, LIMITS.check_acceleration):
        with pytest.raises(errors.NotFinite) as refused:
            check((0.0, value))
        assert refused.value.index == 1


@pytest.mark.parametrize("count", [0, 1, 3])
def test_a_wrong_number_of_joints_is_refused(count: int) -> None:
    with pytest.raises(errors.WrongJointCount) as refused:
        LIMITS.check_position((0.0,) * count)
    assert (refused.value.got, refused.value.expected) == (count, 2)


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("lower", (3.0, -1.1)),
        ("upper", (math.nan, 2.2)),
        ("velocity", (0.0, 1.0)),
        ("acceleration", (1.0, -1.0)),
        ("names", ("rail",)),
    ],
)
def test_limits_that_make_no_sense_cannot_be_built(field: str, values: tuple[Any, ...]) -> None:
    changed: dict[str, Any] = {field: values}
    with pytest.raises((errors.BadArgument, errors.WrongJointCount)) as refused:
        replace(LIMITS, **changed)
    assert isinstance(refused.value, errors.MotionError)


@example(0.15625)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_rounding_up_to_four_bytes_gives_the_least_real_that_is_not_below(value: float) -> None:
    ceiling = float32_ceiling(value)
    assert ceiling >= value
    if math.isfinite(ceiling):
        assert float32(ceiling) == ceiling
        below = -float32_ceiling(math.nextafter(-ceiling, math.inf))
        assert below < ceiling
        assert below < value or value == ceiling


def test_a_bound_is_widened_by_no_more_than_one_four_byte_step() -> None:
    assert float32_ceiling(3.1416) == 3.1416001319885254
    assert float32_ceiling(-3.1416) == -3.1415998935699463


def test_four_byte_limits_are_wider_in_every_field() -> None:
    wide = LIMITS.as_float32()
    assert all(w <= n for w, n in zip(wide.lower, LIMITS.lower, strict=True))
    for field in ("upper", "velocity", "acceleration"):
        pairs = zip(getattr(wide, field), getattr(LIMITS, field), strict=True)
        assert all(w >= n and w - n <= 3e-7 for w, n in pairs)
    wide.check_position([float32(value) for value in LIMITS.upper])


def test_not_a_number_has_no_four_byte_bound() -> None:
    with pytest.raises(errors.NotFinite):
        float32_ceiling(math.nan)
