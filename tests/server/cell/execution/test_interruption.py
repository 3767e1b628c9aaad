from __future__ import annotations

import pytest

from openpendant.server.cell.execution.feedback import Shown, interruption
from openpendant.simplemsg import ControllerMode
from openpendant.simplemsg.verdicts import VerdictCode as V

AUTO, MANUAL = ControllerMode.AUTO, ControllerMode.MANUAL
SOUND = Shown(AUTO, "", 0)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (SOUND, Shown(AUTO, "the emergency stop", 0), "the emergency stop"),
        (Shown(AUTO, "no power", 0), Shown(AUTO, "the emergency stop", 0), "the emergency stop"),
        (SOUND, Shown(MANUAL, "", 0), "from auto to manual"),
        (Shown(MANUAL, "", 0), SOUND, "from manual to auto"),
        (SOUND, Shown(ControllerMode.UNKNOWN, "", 0), "from auto to unknown"),
        (SOUND, Shown(AUTO, "", 7), "error 7"),
        (Shown(AUTO, "", 6), Shown(AUTO, "", 7), "error 7"),
        (SOUND, Shown(AUTO, "", -1), "error -1"),
    ],
)
def test_what_is_new_ends_what_is_under_way(before: Shown, after: Shown, said: str) -> None:
    refusal = interruption(before, after)
    assert refusal is not None
    assert refusal.code is V.CONTROLLER_STOPPED
    assert said in refusal.text


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (SOUND, SOUND),
        (Shown(AUTO, "", 7), Shown(AUTO, "", 7)),
        (Shown(AUTO, "", 7), SOUND),
        (Shown(AUTO, "no power", 0), Shown(AUTO, "no power", 0)),
        (Shown(AUTO, "no power", 0), SOUND),
    ],
)
def test_what_was_shown_before_ends_nothing(before: Shown, after: Shown) -> None:
    assert interruption(before, after) is None
