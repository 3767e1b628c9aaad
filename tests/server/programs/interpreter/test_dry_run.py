from __future__ import annotations

import pytest
from rigs.cells.program_rig import ProgramRig
from rigs.data.program_samples import linked

from openpendant.server.programs.interpreter.dry_run import dry_run
from openpendant.server.programs.interpreter.dry_run_results import BlockPlan, DryRunResult
from openpendant.server.programs.interpreter.motion_blocks import MotionBlock
from openpendant.server.programs.interpreter.run_events import OfferedSignals
from openpendant.server.programs.language.points import JointVector
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V

START = (0.0,) * 6
SIGNALS = OfferedSignals(inputs=16, outputs=8)
LOOP = "loop\n{}end"


def planned(start: JointVector, block: MotionBlock, scene: object) -> BlockPlan:
    return BlockPlan(1.0, block.moves[-1].target.joints)


def walked(
    statements: str, others: dict[str, str] | None = None, signals: OfferedSignals | None = SIGNALS
) -> DryRunResult:
    absent = None if signals is None else signals.absent
    return dry_run(linked(statements, others), START, planned, absent=absent)


def refusals(found: DryRunResult) -> list[tuple[str, int, V]]:
    return [
        (each.program, each.index, each.refusal.code)
        for each in found.statements
        if each.refusal is not None
    ]


@pytest.mark.parametrize(
    ("statement", "text"),
    [
        ("wait input 999 on timeout 1 s", "input 999; accepted: 0 to 15"),
        ("wait input 16 on", "input 16; accepted: 0 to 15"),
        ("read input 16 into x", "input 16; accepted: 0 to 15"),
        ("if input 16 on\nend", "input 16; accepted: 0 to 15"),
        ("set output 8 off", "output 8; accepted: 0 to 7"),
    ],
)
def test_a_signal_that_the_controller_does_not_have_is_refused_at_its_statement(
    statement: str, text: str
) -> None:
    found = walked(f"move PTP a\n{statement}\nmove PTP b")
    assert refusals(found) == [("main", 1, V.NO_SIGNAL)]
    assert [each.refusal.text for each in found.refusals if each.refusal] == [text]
    assert found.unchecked == ()


def test_signals_that_are_there_are_good() -> None:
    found = walked("wait input 15 on\nset output 7 on\nread input 0 into x\nif flag x on\nend")
    assert [each.index for each in found.statements] == [0, 1, 2, 3]
    assert found.refusals == ()


def test_where_nobody_knows_the_signals_it_is_said_and_nothing_is_refused() -> None:
    found = walked("wait input 999 on\nmove PTP a\nset output 999 on", signals=None)
    assert found.refusals == ()
    assert found.unchecked == (("main", 0), ("main", 2))


@pytest.mark.parametrize(
    ("statements", "refused"),
    [
        ("if flag F on\nmove PTP a\nend", [0]),
        ("if flag F on\nend\nread input 1 into F\nif flag F on\nend", [0]),
        ("read input 1 into G\nif flag F on\nend\nif flag G on\nend", [1]),
        ("loop 5\nif flag F off\nend\nread input 1 into F\nend", [1]),
        ("if input 1 on\nread input 2 into F\nend\nif flag F on\nend", [3]),
        ("read input 1 into F\nif flag F on\nend", []),
        (
            "if input 1 on\nread input 2 into F\nelse\nread input 3 into F\nend\nif flag F on\nend",
            [],
        ),
    ],
)
def test_a_flag_that_may_be_unread_is_refused_where_it_is_asked_for(
    statements: str, refused: list[int]
) -> None:
    assert refusals(walked(statements)) == [("main", index, V.FLAG_NOT_READ) for index in refused]


@pytest.mark.parametrize("branch", ["if flag G off\nelse\n", "if flag G on\n"])
def test_flags_that_go_together_are_walked_together(branch: str) -> None:
    statements = (
        "read input 1 into G\nif flag G on\nread input 2 into F\nend\n"
        f"{branch}if flag F on\nmove PTP a\nend\nend"
    )
    found = walked(statements)
    assert found.refusals == ()
    assert found.complete


def test_branches_that_no_flag_leads_to_are_walked_all_the_same() -> None:
    found = walked("read input 1 into G\nif flag G on\nif flag G off\nmove PTP b\nend\nend")
    assert [each.point for each in found.moves] == ["b"]
    assert found.complete


@pytest.mark.parametrize(
    ("statements", "refused"),
    [
        (LOOP.format(""), [0]),
        (LOOP.format("# nothing\n"), [0]),
        (LOOP.format("loop 5\nend\n"), [0]),
        (LOOP.format(LOOP.format("") + "\n"), [1]),
        ("loop 1000000\nend", [0]),
        (LOOP.format("loop 10000\nend\n"), [1]),
        ("read input 1 into F\n" + LOOP.format("if flag F on\nmove PTP a\nend\n"), [1]),
        (LOOP.format("move PTP a\n"), []),
        (LOOP.format("move PTP a zone 5 deg\n"), []),
        (LOOP.format("wait 0.1 s\n"), []),
        (LOOP.format("set output 1 on\n"), []),
        (LOOP.format("if input 1 on\nmove PTP a\nend\n"), []),
        (LOOP.format("read input 1 into F\nif flag F on\nmove PTP a\nend\n"), []),
        ("loop 1000\nend", []),
        (
            "read input 1 into F\n"
            + LOOP.format("if flag F on\nmove PTP a\nend\nif flag F off\nmove PTP b\nend\n"),
            [],
        ),
    ],
)
def test_a_loop_that_goes_round_in_no_time_is_refused(statements: str, refused: list[int]) -> None:
    assert refusals(walked(statements)) == [("main", index, V.PROGRAM_STUCK) for index in refused]


def test_a_loop_round_a_call_of_nothing_is_refused_where_the_loop_is() -> None:
    found = walked("loop\ncall x\nend", {"x": "# nothing"})
    assert refusals(found) == [("main", 0, V.PROGRAM_STUCK)]
    found = walked("loop 9999\ncall x\nend", {"x": "# nothing"})
    assert refusals(found) == [("main", 0, V.PROGRAM_STUCK)]


def test_a_statement_of_a_called_program_is_refused_there() -> None:
    found = walked("call x", {"x": "move PTP a\nset output 99 on"})
    assert refusals(found) == [("x", 1, V.NO_SIGNAL)]


@pytest.mark.parametrize(
    "statements",
    [
        "if flag F on\nend",
        LOOP.format(""),
        LOOP.format("loop 5\nend\n"),
        "loop 1000000\nend",
        LOOP.format("wait 0.1 s\n") + "\nmove PTP a",
        "loop 1000\nend",
    ],
)
def test_a_dry_run_refuses_what_a_run_ends_at(statements: str) -> None:
    rig = ProgramRig(statements)
    came = [*rig.start(), *(each for _ in range(50) for each in rig.after(0.01))]
    ended = came[0] if came else "goes on"
    said = [f"failed {code.name}" for _, _, code in refusals(walked(statements))]
    assert said == ([ended] if ended.startswith("failed") else [])


def test_a_controller_without_signals_refuses_all() -> None:
    none = Refusal(V.SIGNALS_UNAVAILABLE, "none")
    found = dry_run(linked("wait input 1 on"), START, planned, absent=lambda kind, signal: none)
    assert refusals(found) == [("main", 0, V.SIGNALS_UNAVAILABLE)]
