from __future__ import annotations

import pytest
from rigs.cells.emulated_cell import EmulatedCell

from openpendant.controller_emulator.error_codes import ErrorCode
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.server.uplinks.uplink import WORDS, error_text
from openpendant.simplemsg import Received
from openpendant.simplemsg.pendant import AuthorityBeat, Outcome
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_the_words_are_there_for_every_error_of_the_emulated_controller() -> None:
    assert set(WORDS) == {int(code) for code in ErrorCode if code is not ErrorCode.NONE}


@pytest.mark.parametrize(
    ("number", "words"), [(109, ("109", "under-run", "too late")), (4711, ("4711",))]
)
def test_a_number_is_always_told(number: int, words: tuple[str, ...]) -> None:
    assert all(word in error_text(number) for word in words)


class SlowLine(EmulatedCell):
    def __init__(self) -> None:
        self.late: list[tuple[ControllerPath, Received]] = []
        self.slow: tuple[ControllerPath, ...] = ()
        super().__init__(controller={"lead": 0.09})  # so that it runs dry before reports are lost

    def _hear(self, path: ControllerPath, received: Received) -> None:
        if path in self.slow:
            self.late.append((path, received))
        else:
            super()._hear(path, received)

    def catch_up(self) -> None:
        self.slow, late = (), self.late
        for path, received in late:
            super()._hear(path, received)


@pytest.mark.parametrize(
    ("slow", "code"),
    [
        ((ControllerPath.MOTION,), V.CONTROLLER_STOPPED),
        ((ControllerPath.MOTION, ControllerPath.STATE), V.CONTROLLER_REFUSED),
    ],
)
def test_a_motion_that_ran_dry_is_told_as_an_under_run_whichever_is_heard_first(
    slow: tuple[ControllerPath, ...], code: V
) -> None:
    """The controller's own status names the error; its answer to the next point does not."""
    cell = SlowLine()
    cell.wait(300)
    pendant = cell.holder()
    assert pendant.move(*(at + 0.8 for at in cell.position), speed=0.5) is V.ACCEPTED
    cell.wait(300)
    pendant.send(AuthorityBeat())
    cell.slow = slow
    cell.wait(200)
    cell.catch_up()
    cell.wait(50)
    (outcome,) = pendant.all(Outcome)
    assert outcome.code == code
    assert "under-run" in outcome.text
    assert "late" in outcome.text
