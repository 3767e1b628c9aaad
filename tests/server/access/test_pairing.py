from __future__ import annotations

import random

import pytest

from openpendant.server.access.lockout import SECOND_NS
from openpendant.server.access.pairing import (
    ALPHABET,
    LENGTH,
    LIFETIME_NS,
    MOST_WRONG,
    PairingCodes,
)
from openpendant.server.access.passwords import Secret

START = 1_000 * SECOND_NS


def test_a_code_is_short_and_has_no_sign_that_is_mistaken_for_another() -> None:
    code = PairingCodes().issue("cell", "ann", START, random.Random(1))
    assert len(code.text.reveal()) == LENGTH
    assert set(code.text.reveal()) <= set(ALPHABET)
    assert not set(ALPHABET) & set("01OIL2Z5S")
    assert len(code.shown) == LENGTH + 1


@pytest.mark.parametrize("typed", ["{}", " {} ", "lower", "hyphen"])
def test_a_code_is_taken_however_it_is_typed(typed: str) -> None:
    codes = PairingCodes()
    code = codes.issue("cell", "ann", START, random.Random(1))
    text = {"lower": code.shown.lower(), "hyphen": "-".join(code.text.reveal())}.get(
        typed, typed.format(code.shown)
    )
    assert codes.redeem(Secret(text), START) is code


def test_a_code_serves_a_whole_class_until_it_ends() -> None:
    codes = PairingCodes()
    code = codes.issue("cell", "ann", START, random.Random(1))
    assert all(codes.redeem(code.text, START + LIFETIME_NS - 1) for _ in range(30))
    assert codes.redeem(code.text, START + LIFETIME_NS) is None


def test_another_code_of_the_cell_ends_the_first_and_not_that_of_another_cell() -> None:
    codes, chance = PairingCodes(), random.Random(1)
    first = codes.issue("left", "ann", START, chance)
    right = codes.issue("right", "ann", START, chance)
    second = codes.issue("left", "ann", START, chance)
    assert codes.redeem(first.text, START) is None
    assert codes.redeem(right.text, START) is right
    assert codes.redeem(second.text, START) is second
    assert codes.withdraw("left")
    assert codes.redeem(second.text, START) is None


def test_many_wrong_codes_end_every_code() -> None:
    codes, chance = PairingCodes(), random.Random(1)
    code = codes.issue("cell", "ann", START, chance)
    for _ in range(MOST_WRONG):
        assert codes.redeem(Secret("??????"), START) is None
    assert codes.redeem(code.text, START) is None
    again = codes.issue("cell", "ann", START, chance)
    assert codes.redeem(again.text, START) is again


@pytest.mark.parametrize("typed", ["", "\0" * 6, "\ud800" * 6, "Ω" * 6, "A" * 10**6])
def test_what_is_no_code_is_refused_without_an_error(typed: str) -> None:
    codes = PairingCodes()
    codes.issue("cell", "ann", START, random.Random(1))
    assert codes.redeem(Secret(typed), START) is None


def test_a_code_does_not_show_itself() -> None:
    code = PairingCodes().issue("cell", "ann", START, random.Random(1))
    assert code.text.reveal() not in repr(code)
