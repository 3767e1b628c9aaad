"""Which moves are handed over together, so that zones join them."""

from __future__ import annotations

import pytest
from rigs.cells.program_rig import ProgramRig

from openpendant.server.programs.interpreter.motion_blocks import MOST_MOVES_IN_BLOCK
from openpendant.server.programs.interpreter.run_events import Passed

START = "move PTP a\n"


def first_block(statements: str, others: dict[str, str] | None = None) -> str:
    rig = ProgramRig(START + statements, others)
    rig.start()
    return rig.done()[0]


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        ("move LIN b zone 5 mm\nmove LIN c", "move b:LIN~ c:LIN"),
        ("move LIN b zone 5 mm\nmove CIRC c via a zone 5 mm\nmove LIN a", None),
        ("move PTP b zone 5 deg\nmove PTP c zone 5 deg\nmove PTP a", "move b~ c~ a"),
        ("move LIN b\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\n# to c\nmove LIN c", "move b:LIN~ c:LIN"),
        ("move LIN b zone 5 mm\nset output 1 on\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\nwait 0 s\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\nif input 1 on\nmove LIN c\nend", "move b:LIN"),
        ("move LIN b zone 5 mm\nmove PTP c", "move b:LIN"),
        ("move PTP b zone 5 deg\nmove LIN c", "move b"),
        ("move LIN b zone 5 mm\nmove SPLINE c", "move b:LIN"),
        ("move LIN b zone 5 mm", "move b:LIN"),
        ("move LIN b dwell 1 s\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\nmove LIN c dwell 1 s\nmove LIN a", "move b:LIN~ c:LIN"),
        ("loop 2\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nend\nmove LIN a", None),
    ],
)
def test_zones_join_moves_of_one_space(statements: str, expected: str | None) -> None:
    whole = {
        "CIRC": "move b:LIN~ c:CIRC<a~ a:LIN",
        "loop": "move b:LIN~ c:LIN~ b:LIN~ c:LIN~ a:LIN",
    }
    expected = expected or next(text for word, text in whole.items() if word in statements)
    assert first_block(statements) == expected


def test_a_block_goes_into_a_called_program_and_out_of_it() -> None:
    called = {"x": "move LIN b zone 5 mm\nmove LIN c zone 5 mm"}
    assert first_block("call x\nmove LIN a", called) == "move b:LIN~ c:LIN~ a:LIN"


def test_an_endless_loop_is_handed_over_in_blocks() -> None:
    rig = ProgramRig(START + "loop\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nend")
    rig.start()
    for _ in range(3):
        rig.done()
        assert len(rig.block.moves) == MOST_MOVES_IN_BLOCK
        assert rig.block.moves[-1].move.zone == 0.0


def test_a_block_ends_before_a_breakpoint() -> None:
    rig = ProgramRig(START + "move LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a")
    rig.break_at(("main", 3))
    rig.start()
    assert rig.done() == ["move b:LIN~ c:LIN"]


def test_a_block_may_end_before_a_breakpoint_at_something_that_takes_no_time() -> None:
    rig = ProgramRig(START + "move LIN b zone 5 mm\n# here\nmove LIN c")
    rig.break_at(("main", 2))
    rig.start()
    assert rig.done() == ["move b:LIN"]


def test_the_current_line_goes_on_within_a_block() -> None:
    rig = ProgramRig(START + "move LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a")
    rig.start()
    rig.done()
    lines = [rig.here[0][1]]
    for place in (0, 1, 0, 2):
        rig.do(Passed(rig.request, place))
        lines.append(rig.here[0][1])
    assert lines == [1, 2, 3, 3, 3]


def test_the_points_of_a_block_are_in_it() -> None:
    rig = ProgramRig("move PTP a")
    rig.start()
    (move,) = rig.block.moves
    assert (move.program, move.index, move.target.name) == ("main", 0, "a")
