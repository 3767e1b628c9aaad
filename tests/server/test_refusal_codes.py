import re
from pathlib import Path

import pytest

from openpendant.motion import errors
from openpendant.server.refusal import CODE_OF_ERROR, Refusal, refusal_of
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

ROOT = Path(__file__).parents[2]
SOURCES = "\n".join(
    path.read_text("utf-8")
    for folder in ("server", "simplemsg", "controller_emulator")
    for path in (ROOT / folder).rglob("*.py")
    if path.name != "verdicts.py"
)


def kinds(base: type[errors.MotionError]) -> list[type[errors.MotionError]]:
    found = []
    for kind in base.__subclasses__():
        found += [kind, *kinds(kind)]
    return found


@pytest.mark.parametrize("kind", kinds(errors.MotionError))
def test_every_motion_error_has_a_code(kind: type[errors.MotionError]) -> None:
    assert kind in CODE_OF_ERROR


@pytest.mark.parametrize("code", VerdictCode)
def test_every_code_has_a_cause_and_a_remedy(code: VerdictCode) -> None:
    assert CATALOGUE[code].cause.endswith(".")
    assert CATALOGUE[code].remedy.endswith(".")


def test_the_way_back_inside_needs_no_mode_where_none_is_set_here() -> None:
    """With a selector of the controller's own any jog may lead back, and SET_MODE is refused."""
    remedy = CATALOGUE[VerdictCode.OUTSIDE_LIMITS].remedy
    assert remedy == "Jog the joint back inside; where the mode is set here, in the recovery mode."


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (
            errors.OutOfRange("elbow", 2.5, -2.0, 2.0, "rad", 1),
            (VerdictCode.OUT_OF_RANGE, 1, 2.5, 2.0),
        ),
        (
            errors.OutOfRange("elbow", -2.5, -2.0, 2.0, "rad", 1),
            (VerdictCode.OUT_OF_RANGE, 1, -2.5, -2.0),
        ),
        (errors.TooFast("wrist", 9.0, 3.0, "rad", 2), (VerdictCode.TOO_FAST, 2, 9.0, 3.0)),
        (errors.TooSharp("wrist", 9.0, 3.0, "rad", 2), (VerdictCode.TOO_SHARP, 2, 9.0, 3.0)),
        (errors.SceneTooLarge(2_400, 2_000, 300), (VerdictCode.TOO_LARGE, -1, 2_400.0, 2_000.0)),
        (errors.NoMotion(), (VerdictCode.NO_MOTION, -1, 0.0, 0.0)),
        (errors.NotFinite("the goal", 3), (VerdictCode.NOT_FINITE, 3, 0.0, 0.0)),
        (errors.WrongJointCount(5, 6), (VerdictCode.WRONG_JOINT_COUNT, -1, 5.0, 6.0)),
        (
            errors.PoseUnreachable((0.0, 0.0, 0.0), "base", 0.1, 0.7, 3),
            (VerdictCode.UNREACHABLE, -1, 0.7, 0.0),
        ),
        (errors.BranchChange(0.25, "wrist", 3.0), (VerdictCode.BRANCH_CHANGE, -1, 3.0, 0.0)),
        (errors.NotTimeable(2.0, "too long"), (VerdictCode.NOT_TIMEABLE, -1, 2.0, 0.0)),
        (
            errors.CertificateRefused("velocity", "wrist", 3.0, 2.0, 0.5),
            (VerdictCode.CERTIFICATE_REFUSED, -1, 3.0, 2.0),
        ),
        (
            errors.PlatformLimit("stroke", "leg_2", 0.35, 0.32, "m", 1),
            (VerdictCode.PLATFORM_LIMIT, 1, 0.35, 0.32),
        ),
        (
            errors.SegmentRefused(2, errors.SegmentRefused(1, errors.TooFast("j", 9.0, 3.0))),
            (VerdictCode.TOO_FAST, -1, 9.0, 3.0),
        ),
        (errors.PoorGeometry("turn", 0.1, 0.2, "rad"), (VerdictCode.POOR_GEOMETRY, -1, 0.0, 0.0)),
        (
            errors.BadCircle(errors.CircleFault.TOO_SMALL, 0.1, 0.2),
            (VerdictCode.BAD_CIRCLE, -1, 0.0, 0.0),
        ),
        (errors.BadArgument("speed", 7, "1"), (VerdictCode.BAD_ARGUMENT, -1, 0.0, 0.0)),
    ],
)
def test_a_refusal_carries_joint_value_and_limit(
    error: errors.MotionError, expected: tuple[VerdictCode, int, float, float]
) -> None:
    refusal = refusal_of(error)
    assert (refusal.code, refusal.joint, refusal.value, refusal.limit) == expected
    assert refusal.text == str(error)


def test_a_refusal_without_words_uses_those_of_the_catalogue() -> None:
    assert Refusal(VerdictCode.MOVING).sentence == CATALOGUE[VerdictCode.MOVING].cause


NOT_GIVEN_YET = frozenset(
    {
        # By dialects that have something to prepare; the generic one has not.
        "CONFIRM_FIRST",
        "NOT_PREPARED",
        # By a grasp that is measured.
        "NOTHING_GRIPPED",
        "NOT_HELD",
        # By the shapes and meshes of a robot.
        "UNKNOWN_MESH",
    }
)
"""Codes of the protocol's version 3 whose part of the server is not built."""


def test_every_code_of_the_catalogue_is_given_somewhere() -> None:
    """By some source file other than the catalogue."""
    given = set(re.findall(r"\b(?:VerdictCode|V)\.([A-Z0-9_]+)\b", SOURCES))
    assert {code.name for code in VerdictCode} - given == NOT_GIVEN_YET
