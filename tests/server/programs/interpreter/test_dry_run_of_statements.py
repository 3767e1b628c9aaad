from __future__ import annotations

from typing import Any

from rigs.cells.program_cell import BODY_LINE, HEAD, ProgramCell, ask

from openpendant.server.programs.execution.program_run import BareEnvironment
from openpendant.server.programs.interpreter.run_events import Offer, OfferedSignals
from openpendant.simplemsg.verdicts import VerdictCode as V

STATEMENTS = "wait input 999 on\nset output 1 on\nif flag F on\nend\nloop\nend\n"


NAME = "a-point-with-a-name-that-says-where-it-is"


class Signals(BareEnvironment):
    def __init__(self, offer: Offer) -> None:
        self._offer = offer

    @property
    def offered_signals(self) -> Offer:
        return self._offer


def dry_run(offer: Offer, statements: str = STATEMENTS) -> dict[str, Any]:
    cell = ProgramCell(main=statements)
    cell.core.pendants.programs.executor.environment = Signals(offer)
    return ask(cell.user, "programs.dry_run", name="main")


def test_statements_that_a_run_would_end_at_are_told_with_line_code_and_text() -> None:
    found = dry_run(OfferedSignals(inputs=16, outputs=16))
    told = [
        (each["line"] - BODY_LINE, each["does"], each.get("code")) for each in found["statements"]
    ]
    assert told == [
        (0, "wait-input", V.NO_SIGNAL),
        (2, "if-flag", V.FLAG_NOT_READ),
        (4, "loop", V.PROGRAM_STUCK),
        (1, "set-output", None),
    ]
    assert found["refused"] == 3
    assert found["unchecked"] == []
    assert found["statements"][0]["text"] == "input 999; accepted: 0 to 15"


def test_while_the_controller_has_not_said_its_signals_none_is_refused() -> None:
    found = dry_run(None)
    assert [each["line"] - BODY_LINE for each in found["unchecked"]] == [0, 1]
    assert [each["does"] for each in found["statements"]] == ["if-flag", "loop"]


def test_the_text_of_a_refusal_is_told_to_its_end() -> None:
    cell = ProgramCell()
    far = HEAD.format(name="main").replace("c joints 0.2", f"{NAME} joints 9")
    text = f"{far}move PTP a\nmove PTP {NAME}\n"
    ask(cell.user, "programs.save", name="main", body=text, expected_revision=0)
    found = ask(cell.user, "programs.dry_run", name="main")
    (worst, *_) = found["moves"]
    assert worst["code"] == V.OUT_OF_RANGE
    assert worst["text"].endswith(" rad")
    assert len(worst["text"]) > 120
