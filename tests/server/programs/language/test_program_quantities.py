from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.server.programs.language.lexer import (
    LONGEST_NUMBER,
    UNITS,
    from_si,
    is_number,
    plain_number,
    read_number,
    to_si,
)

REALS = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize("unit", UNITS)
@given(value=REALS)
def test_every_real_reads_back_as_itself_in_every_unit(unit: str, value: float) -> None:
    text = from_si(value, unit)
    assert is_number(text)
    assert to_si(text, unit) == value


@given(REALS)
def test_every_real_without_a_unit_reads_back_as_itself(value: float) -> None:
    text = plain_number(value)
    assert is_number(text)
    assert read_number(text) == value


@pytest.mark.parametrize(
    ("number", "unit", "expected"),
    [
        ("180", "deg", math.pi),
        ("-90", "deg", -math.pi / 2),
        ("0.1", "mm", 0.0001),
        ("250", "mm/s", 0.25),
        ("50", "%", 0.5),
        ("20", "ms", 0.02),
        ("1e3", "m", 1000.0),
    ],
)
def test_a_number_with_a_unit_is_the_nearest_real(number: str, unit: str, expected: float) -> None:
    assert to_si(number, unit) == expected


@pytest.mark.parametrize("typed", ["30", "-12.5", "0.001", "359.999", "0", "100000"])
def test_what_was_typed_is_printed_as_it_was(typed: str) -> None:
    assert from_si(to_si(typed, "deg"), "deg") == typed
    assert from_si(to_si(typed, "mm"), "mm") == typed


def test_minus_zero_is_zero() -> None:
    assert math.copysign(1.0, to_si("-0", "deg")) == 1.0


@pytest.mark.parametrize(
    "word", ["", ".", "1,5", "1.5.", "0x10", "1_000", "nan", "inf", "١", "1e", "--1", "e5"]
)
def test_what_is_no_number_is_not_taken_for_one(word: str) -> None:
    assert not is_number(word)


def test_a_number_may_not_be_endless() -> None:
    assert is_number("1" * LONGEST_NUMBER)
    assert not is_number("1" * (LONGEST_NUMBER + 1))


def test_a_number_beyond_all_reals_is_infinite() -> None:
    assert to_si("1e999", "m") == math.inf
