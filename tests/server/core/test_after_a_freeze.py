from __future__ import annotations

from rigs.cells.program_cell import ProgramCell
from rigs.cells.server_rig import MS, ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.events.effects import Ask, SendStop
from openpendant.simplemsg.verdicts import VerdictCode as V

FREEZE_NS = 100 * MS
"""Late for the watchdog, and the last report of the controller is still fresh enough to start."""


def test_promise_26_a_plan_that_is_served_first_after_a_freeze_begins_no_motion() -> None:
    rig = ready(plans_at_once=False)
    pad = JogPad(rig)
    pad.pendant.path((0.5, 0.5), (1.0, 0.0))
    rig.now += FREEZE_NS
    assert isinstance(rig.plan()[0], SendStop)
    rig.wait(500)
    assert rig.points == []
    assert pad.pendant.verdicts()[-1][1] is V.SERVER_LATE


class SlowStore(ProgramCell):
    kept: list[Ask] | None = None

    def _run(self, asked: Ask) -> None:
        if self.kept is None:
            super()._run(asked)
        else:
            self.kept.append(asked)


def test_promise_26_a_program_that_is_loaded_first_after_a_freeze_begins_no_motion() -> None:
    cell = SlowStore(main="move PTP b\n")
    cell.core.cell.feedback.says_emulated = False
    cell.wait(10)
    cell.kept = []
    cell.run()
    cell.now += FREEZE_NS
    before = len(cell.sent)
    kept, cell.kept = cell.kept, None
    for asked in kept:
        cell._run(asked)
    assert cell.core.cell.stop is not None
    assert all(getattr(message, "sequence", None) == -4 for message in cell.sent[before:])
    assert cell.user.verdicts()[-1][1] is not V.ACCEPTED
