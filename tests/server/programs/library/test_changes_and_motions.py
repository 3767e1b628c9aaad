from collections.abc import Callable
from typing import Any

import pytest
from rigs.cells.busy_cell import BusyCell, answers

from openpendant.server.store.store_errors import DiskFull
from openpendant.simplemsg import joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V

Change = dict[str, Any]

PLACE = {"position": [0.5, 0.0, 0.0]}
LONG_TOOL = {"position": [0.0, 0.0, 1.0]}
SELECT: Change = {"op": "tools.select", "name": "lance", "expected_revision": 1}
ADD_FRAME: Change = {"op": "frames.add", "name": "table", "pose": PLACE, "expected_revision": 0}
ADD_TOOL: Change = {"op": "tools.add", "name": "gripper", "tcp": PLACE, "expected_revision": 1}


@pytest.fixture
def cell() -> BusyCell:
    """Return a cell in T1, enabled, with a tool that is not selected."""
    made = BusyCell()
    assert made.user.code(messages.Subscribe(made.user._next(), 100.0)) is V.ACCEPTED
    assert made.user.mode(messages.OperatingMode.MANUAL_REDUCED) is V.ACCEPTED
    made.user.ask("tools.add", name="lance", tcp=LONG_TOOL, expected_revision=0)
    made.user.enable(1)
    made.wait(100)
    return made


def jog(cell: BusyCell) -> V | None:
    newest = cell.user.all(messages.State)[-1].sequence
    rates = joint_array((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    press, space = cell.user._next(), messages.JogSpace.JOINTS
    return cell.user.code(messages.JogStart(press, press, newest, 0.15, space, "", 6, rates))


def hold(cell: BusyCell, milliseconds: int) -> None:
    for beat in range(milliseconds // 50):
        cell.user.send(messages.JogBeat(cell.user.last_request, beat + 1))
        cell.user.enable(1)
        cell.wait(50)


def move(cell: BusyCell) -> V | None:
    return cell.user.move(*(value + 0.2 for value in cell.position), speed=0.3)


def selected(cell: BusyCell) -> object:
    return cell.user.ask("frames.show")["content"]["selected_tool"]


def why(cell: BusyCell, kind: str = "jog") -> dict[str, Any]:
    told = cell.user.ask("why", kind=kind, whose="mine")["conditions"]
    return next((each for each in told if not each["holds"]), {"condition": ""})


MOTIONS = pytest.mark.parametrize("motion", [jog, move])


@MOTIONS
@pytest.mark.parametrize("change", [SELECT, ADD_FRAME, ADD_TOOL], ids=lambda each: each["op"])
def test_no_motion_begins_while_frames_or_tools_are_being_kept(
    cell: BusyCell, change: dict[str, Any], motion: Callable[[BusyCell], V | None]
) -> None:
    cell.is_busy = True
    cell.begin(cell.user, **change)
    assert motion(cell) is V.CHANGE_WHILE_MOVING
    broken = why(cell)
    assert (broken["condition"], broken["name"]) == ("standing", "CHANGE_WHILE_MOVING")
    assert "being saved" in broken["text"]
    cell.catch_up()
    assert answers(cell.user)[-1]["revision"] == change["expected_revision"] + 1
    assert why(cell)["condition"] == ""
    cell.user.enable(1)
    assert motion(cell) is V.ACCEPTED


@MOTIONS
def test_while_it_moves_frames_and_tools_are_not_changed(
    cell: BusyCell, motion: Callable[[BusyCell], V | None]
) -> None:
    """The other order: the motion was first."""
    assert motion(cell) is V.ACCEPTED
    hold(cell, 100)
    assert cell.user.ask(**SELECT)["code"] == V.CHANGE_WHILE_MOVING
    assert selected(cell) is None


def test_a_jog_after_the_change_keeps_the_new_tool_below_250_mm_per_second(cell: BusyCell) -> None:
    cell.is_busy = True
    cell.begin(cell.user, **SELECT)
    assert jog(cell) is V.CHANGE_WHILE_MOVING
    cell.catch_up()
    assert selected(cell) == "lance"
    cell.user.enable(1)
    assert jog(cell) is V.ACCEPTED
    hold(cell, 1_000)
    fastest = max(state.tool_speed for state in cell.user.all(messages.State))
    assert 0.1 < fastest <= 0.2501


@pytest.mark.parametrize("change", [SELECT, ADD_FRAME], ids=lambda each: each["op"])
def test_a_change_that_the_disk_refuses_holds_up_nothing(
    cell: BusyCell, change: dict[str, Any]
) -> None:
    cell.is_busy = True
    cell.begin(cell.user, **change)
    cell.fail(DiskFull("store.db: database or disk is full"))
    assert answers(cell.user)[-1]["code"] == V.DISK_FULL
    cell.user.enable(1)
    assert jog(cell) is V.ACCEPTED


def test_a_change_that_is_refused_at_once_holds_up_nothing(cell: BusyCell) -> None:
    cell.is_busy = True
    cell.begin(cell.user, **(SELECT | {"name": "unknown"}))
    assert jog(cell) is V.ACCEPTED


def test_a_change_of_frames_and_one_of_tools_at_once_do_not_undo_each_other(cell: BusyCell) -> None:
    cell.is_busy = True
    cell.begin(cell.user, **ADD_FRAME)
    cell.begin(cell.user, **SELECT)
    assert answers(cell.user)[-1]["code"] == V.STORE_BUSY
    cell.catch_up()
    assert "table" in cell.user.ask("frames.show")["names"]
    assert cell.user.ask(**SELECT) == {"revision": 2}
    assert "table" in cell.user.ask("frames.show")["names"]


def test_no_motion_begins_before_frames_tools_and_scene_were_read_at_the_start() -> None:
    cell = SlowStart()
    assert move(cell) is V.CHANGE_WHILE_MOVING
    assert "being read" in why(cell, "move")["text"]
    while cell.waiting:
        assert move(cell) is V.CHANGE_WHILE_MOVING
        cell.catch_up()
        cell.is_busy = bool(cell.waiting)
    assert move(cell) is V.ACCEPTED


def test_nothing_is_changed_before_what_is_kept_was_read() -> None:
    """What was read would come into force in its place."""
    cell = SlowStart()
    box = {"name": "box", "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "position": [2, 0, 0]}
    assert cell.user.ask(**ADD_FRAME)["code"] == V.STORE_BUSY
    assert cell.user.ask("scene.add", object=box, expected_revision=0)["code"] == V.STORE_BUSY


def test_documents_that_cannot_be_read_hold_up_nothing_once_that_is_known() -> None:
    cell = SlowStart()
    while cell.waiting:
        cell.fail(DiskFull("store.db: disk I/O error"))
    assert move(cell) is V.ACCEPTED


class SlowStart(BusyCell):
    def perform(self, outgoing: list[Any]) -> list[Any]:
        self.is_busy = self.is_busy or not hasattr(self, "user")
        return super().perform(outgoing)
