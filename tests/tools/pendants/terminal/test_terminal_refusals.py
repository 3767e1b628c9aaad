"""Refusals in degrees and millimetres, and which of them no second attempt heals."""

import math
import re

import pytest
from rigs.cells.panel_rig import joint

from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Refused
from openpendant.tools.pendants.panel.keyboard import KEYBOARD
from openpendant.tools.pendants.panel.wording import (
    in_screen_units,
    is_hopeless,
    refusal_line,
    remedy,
)

JOINTS = [joint("shoulder"), joint("rail", "m")]


@pytest.mark.parametrize(
    ("code", "index", "value", "limit", "sentence"),
    [
        (
            VerdictCode.OUT_OF_RANGE,
            0,
            math.radians(999),
            2.0,
            "joint 1, shoulder, at 999.00° is beyond its limit 114.59°;"
            " accepted: -114.59° to 114.59°",
        ),
        (
            VerdictCode.OUTSIDE_LIMITS,
            1,
            -2.5,
            -2.0,
            "joint 2, rail, at -2500.0 mm is beyond its limit -2000.0 mm;"
            " accepted: -2000.0 mm to 2000.0 mm",
        ),
        (
            VerdictCode.TOO_FAST,
            0,
            math.pi,
            math.pi / 2,
            "joint 1, shoulder, at 180.00°/s is faster than its limit 90.00°/s",
        ),
        (
            VerdictCode.TOO_SHARP,
            1,
            3.0,
            1.5,
            "joint 2, rail, accelerating at 3000.0 mm/s² exceeds its limit 1500.0 mm/s²",
        ),
        (VerdictCode.NOT_FINITE, 0, 0.0, 0.0, "as it was"),
        (VerdictCode.OUT_OF_RANGE, -1, 9.0, 1.0, "as it was"),
        (VerdictCode.OUT_OF_RANGE, 2, 9.0, 1.0, "as it was"),
    ],
)
def test_a_joint_at_fault_is_told_in_its_unit(
    code: VerdictCode, index: int, value: float, limit: float, sentence: str
) -> None:
    line = refusal_line(Refused(code, "as it was", index, value, limit), JOINTS)
    assert line.startswith(f"{code.name}: {sentence} -> ")


@pytest.mark.parametrize(
    ("code", "remedy"),
    [
        (VerdictCode.NOT_ENABLED, "Press v, which holds it for some seconds"),
        (VerdictCode.NOT_IN_CONTROL, "Press c, which asks for control."),
        (VerdictCode.OUTSIDE_LIMITS, "Jog the joint back inside; where m sets the mode,"),
        (VerdictCode.PLANNING, "Wait for its outcome, or stop it."),
    ],
)
def test_the_remedy_names_the_key_where_this_pendant_has_one(
    code: VerdictCode, remedy: str
) -> None:
    line = refusal_line(Refused(code, "why", -1, 0.0, 0.0), JOINTS)
    assert line.startswith(f"{code.name}: why -> {remedy}")


def test_every_key_that_a_remedy_names_has_a_meaning() -> None:
    named = {
        word
        for code in VerdictCode
        for word in re.findall(r"(?:Press|and|or|,) (\S)\b", remedy(code, ""))
    }
    assert named >= {"v", "c", "x", "8", "n"}
    assert named <= set(KEYBOARD)


def test_a_code_of_a_newer_server_is_told_by_its_number() -> None:
    assert refusal_line(Refused(9999, "too new", -1, 0.0, 0.0), JOINTS) == "9999: too new"


@pytest.mark.parametrize(
    ("sentence", "shown"),
    [
        (
            "elbow at 17.43583869934082 rad is outside its range -6.283185307 to 6.283185307 rad",
            "elbow at 999.00° is outside its range -360.00 to 360.00°",
        ),
        ("0.000813 m and 8.09e-16 rad away", "0.8 mm and 0.00° away"),
        ("3.5 rad/s² exceeds 0.25 m/s", "200.54°/s² exceeds 250.0 mm/s"),
        ("within 5 ms, 3 mm, 2 m², 1 mark, P1 rad", "within 5 ms, 3 mm, 2 m², 1 mark, P1 rad"),
        ("line 3 of 4", "line 3 of 4"),
        ("3.0000000000000004 Hz and 1e-07 s", "3.0000 Hz and 1e-07 s"),
        ("a norm of 0.000123456789", "a norm of 0.00012"),
        ("saved at 2026-11-22T06:22:49.123456", "saved at 2026-11-22T06:22:49.123456"),
    ],
)
def test_quantities_of_a_sentence_are_in_degrees_and_millimetres(sentence: str, shown: str) -> None:
    assert in_screen_units(sentence) == shown


@pytest.mark.parametrize(
    ("code", "hopeless"),
    [
        (VerdictCode.UNKNOWN_CELL, True),
        (VerdictCode.VERSION, True),
        (VerdictCode.LOGIN_FAILED, True),
        (VerdictCode.LOCKED_OUT, False),
        (VerdictCode.SHUTTING_DOWN, False),
        (9999, False),
    ],
)
def test_only_what_time_may_heal_is_tried_again(code: int, hopeless: bool) -> None:
    assert is_hopeless(Refused(code, "", -1, 0.0, 0.0)) is hopeless
