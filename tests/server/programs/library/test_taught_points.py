from __future__ import annotations

from typing import Any

import pytest
from rigs.cells.busy_cell import BusyCell, answers
from rigs.cells.program_cell import ask
from rigs.data.large_programs import large_body

from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.verdicts import VerdictCode as V

A = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
B = (0.4, -1.3, 1.3, -1.4, -1.6, 0.2)
GRIPPER = {"position": [0.0, 0.0, 0.12]}
LONGER = {"position": [0.0, 0.0, 0.30]}
TABLE = {"position": [0.5, 0.0, 0.0]}
MOVED = {"position": [0.5, 0.2, 0.0]}
RECORD: dict[str, Any] = {"op": "programs.record", "point": "here"}
TOUCH_UP: dict[str, Any] = {"op": "programs.touch_up", "point": "p7"}


def go(cell: BusyCell, goal: tuple[float, ...]) -> None:
    assert cell.user.move(*goal) is V.ACCEPTED
    while cell.core.cell.is_busy:
        cell.pass_time(100)
    assert cell.position == pytest.approx(goal, abs=1e-6)


def teach(cell: BusyCell, asked: dict[str, Any], revision: int = 1, name: str = "main") -> None:
    cell.begin(cell.user, **asked, name=name, expected_revision=revision)


@pytest.fixture
def cell() -> BusyCell:
    made = BusyCell()
    go(made, A)
    made.store.save(
        DocumentKind.PROGRAM, "main", large_body(1_000, 1_000), expected_revision=0, author="test"
    )
    return made


@pytest.mark.parametrize("asked", [RECORD, TOUCH_UP])
def test_a_robot_that_went_on_before_the_point_was_kept_has_it_where_it_stood(
    cell: BusyCell, asked: dict[str, Any]
) -> None:
    cell.is_busy = True
    teach(cell, asked)
    go(cell, B)
    cell.catch_up()
    assert answers(cell.user)[-1]["revision"] == 2
    taught = cell.points()[asked["point"]]
    assert taught["joints"] == pytest.approx(A, abs=1e-6)
    standing = cell.points()[asked["point"]]["pose"]["position"]
    go(cell, A)
    teach(cell, RECORD | {"point": "again"}, 2)
    assert standing == pytest.approx(cell.points()["again"]["pose"]["position"], abs=1e-6)


@pytest.mark.parametrize("asked", [RECORD, TOUCH_UP])
def test_a_robot_that_moves_is_refused_at_once_though_it_would_stand_later(
    cell: BusyCell, asked: dict[str, Any]
) -> None:
    assert cell.user.move(*B) is V.ACCEPTED
    cell.wait(200)
    cell.is_busy = True
    teach(cell, asked)
    assert answers(cell.user)[-1]["code"] == V.MOVING
    assert cell.waiting == []


def test_without_a_fresh_report_no_point_is_taught(cell: BusyCell) -> None:
    cell.now += 1_000_000_000
    cell.is_busy = True
    teach(cell, RECORD)
    assert answers(cell.user)[-1]["code"] == V.FEEDBACK_STALE


@pytest.mark.parametrize(
    ("change", "fields"),
    [
        ("tools.move", {"name": "gripper", "tcp": LONGER}),
        ("tools.select", {"name": "gripper"}),
        ("frames.move", {"name": "table", "pose": MOVED}),
    ],
)
def test_a_point_has_the_pose_of_the_frames_and_tools_that_it_was_asked_for_with(
    cell: BusyCell, change: str, fields: dict[str, Any]
) -> None:
    ask(cell.user, "tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    ask(cell.user, "frames.add", name="table", pose=TABLE, expected_revision=0)
    ask(cell.user, "programs.create", name="own", frame="table", tool="gripper")
    teach(cell, RECORD | {"point": "before"}, 1, "own")
    before = cell.points("own")["before"]
    cell.is_busy = True
    teach(cell, RECORD, 2, "own")
    waiting, cell.waiting, cell.is_busy = cell.waiting, [], False
    ask(cell.user, change, **fields, expected_revision=1)
    cell.waiting = waiting
    cell.catch_up()
    assert cell.points("own")["here"]["pose"] == before["pose"]


def test_the_pose_of_a_point_is_the_same_whichever_tool_is_selected(cell: BusyCell) -> None:
    """The tool of a point is its program's; the selected one is that of jogs and pose moves."""
    ask(cell.user, "tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    ask(cell.user, "tools.add", name="torch", tcp=LONGER, expected_revision=1)
    ask(cell.user, "programs.create", name="own", tool="gripper")
    for number, selected in enumerate((None, "gripper", "torch")):
        ask(cell.user, "tools.select", name=selected, expected_revision=2 + number)
        teach(cell, RECORD | {"point": str(selected)}, 1 + number, "own")
    bare, gripper, torch = (point["pose"] for point in cell.points("own").values())
    assert gripper["position"] == pytest.approx(bare["position"], abs=1e-9)
    assert torch["position"] == pytest.approx(bare["position"], abs=1e-9)
