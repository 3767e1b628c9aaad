from __future__ import annotations

import math
import struct

import pytest
from rigs.cells.server_rig import ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.endpoints.pendant.jog_requests import increment_fault, shares_fault, told
from openpendant.server.refusal import NO_JOINT
from openpendant.simplemsg.pendant import JogSpace, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

JOINTS, TOOL = JogSpace.JOINTS, JogSpace.TOOL


def four_bytes(value: float) -> float:
    """Return what a value is after a message with 4-byte reals."""
    rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return rounded


@pytest.mark.parametrize(
    ("space", "values", "text", "joint"),
    [
        (JOINTS, (0.0, 1.01), "the share of joint 2 is 1.01; accepted: -1 to 1", 1),
        (JOINTS, (-3.0, 0.0), "the share of joint 1 is -3; accepted: -1 to 1", 0),
        (
            TOOL,
            (0.0, 0.0, 1.5, 0.0, 0.0, 0.0),
            "the share of the tool along z is 1.5; accepted: -1 to 1",
            NO_JOINT,
        ),
        (
            TOOL,
            (0.0, 0.0, 0.0, 0.0, -1.1, 0.0),
            "the share of the tool about y is -1.1; accepted: -1 to 1",
            NO_JOINT,
        ),
    ],
)
def test_a_share_beyond_1_is_named_with_its_joint_or_axis(
    space: JogSpace, values: tuple[float, ...], text: str, joint: int
) -> None:
    refusal = shares_fault(space, [four_bytes(value) for value in values])
    assert refusal is not None
    assert (refusal.code, refusal.text, refusal.joint) == (V.BAD_ARGUMENT, text, joint)
    assert abs(refusal.value) > abs(refusal.limit) == 1.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("space", "joint"), [(JOINTS, 1), (TOOL, NO_JOINT)])
def test_what_is_no_number_is_named_too(value: float, space: JogSpace, joint: int) -> None:
    for judge in (shares_fault, increment_fault):
        refusal = judge(space, (0.0, value, 0.0, 0.0, 0.0, 0.0))
        assert refusal is not None
        assert (refusal.code, refusal.joint) == (V.NOT_FINITE, joint)


def test_shares_in_order_are_not_refused() -> None:
    assert shares_fault(JOINTS, (-1.0, 0.0, 1.0)) is None
    assert increment_fault(JOINTS, (-5.0, 0.0, 1e30)) is None


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (four_bytes(1.01), "1.01"),
        (1.01, "1.01"),
        (four_bytes(0.1), "0.1"),
        (math.nextafter(1.0, 2.0), "1.0000000000000002"),
        (four_bytes(1.0000001), "1.0000001"),
        (1e300, "1e+300"),
    ],
)
def test_a_number_is_told_in_the_fewest_digits_that_mean_it(value: float, text: str) -> None:
    assert told(value) == text


def test_the_verdict_of_a_press_carries_joint_value_and_limit() -> None:
    pad = JogPad(ready(modes={"initial": "manual_reduced"}))
    pad.squeeze()
    assert pad.press(0.0, four_bytes(1.01)) is V.BAD_ARGUMENT
    verdict = pad.pendant.all(Verdict)[-1]
    assert (verdict.joint, verdict.limit) == (1, 1.0)
    assert verdict.value == pytest.approx(1.01)
    assert verdict.text == "the share of joint 2 is 1.01; accepted: -1 to 1"
