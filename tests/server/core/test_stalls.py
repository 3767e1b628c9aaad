"""Server or emulator is not run for a time amid a motion (promise 55), exactly, on one clock."""

import asyncio
from collections import deque
from collections.abc import Callable

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import expect
from rigs.cells.program_cell import ProgramCell
from rigs.cells.robot_cell_situations import at_a_pad
from rigs.cells.server_rig import MS
from rigs.cells.stalling_cell import StallingCell, Who
from rigs.clock.virtual_clock import VirtualLoop
from rigs.peers.server_clients import Pendant
from rigs.processes.app_on_loop import app_on_loop, said, until

from openpendant.server.events.effects import SendStop
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V


def joint_move(cell: StallingCell, pendant: Pendant) -> None:
    at = cell.position
    assert pendant.move(at[0] + 0.6, *at[1:], speed=0.4) is V.ACCEPTED


def planned_path(cell: StallingCell, pendant: Pendant) -> None:
    at = cell.position
    path = ((at[0] + 0.3, at[1] - 0.2, *at[2:]), (at[0] + 0.5, *at[1:]))
    assert pendant.path(*path, speed=0.3) is V.ACCEPTED


STALL = round(figure(55, "stall").ms)

MOTIONS: tuple[Callable[[StallingCell, Pendant], None], ...] = (joint_move, planned_path)


def moving(
    motion: Callable[[StallingCell, Pendant], None] = joint_move,
) -> tuple[StallingCell, Pendant]:
    cell = StallingCell()
    pendant = cell.holder()
    motion(cell, pendant)
    return cell, pendant


def finished(cell: StallingCell, pendant: Pendant) -> list[V]:
    for _ in range(400):
        if cell.core.cell.activity is Activity.IDLE:
            break
        cell.wait(50)
    return [code for _, code in pendant.outcomes()]


@pytest.mark.parametrize("who", ["server", "emulator"])
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("after", [50, 60, 300, 555, 900])
def test_promise_55_a_stall_of_200_ms_ends_no_planned_motion(
    who: Who, motion: Callable[[StallingCell, Pendant], None], after: int
) -> None:
    cell, pendant = moving(motion)
    cell.wait(after)
    cell.stall(who, STALL)
    assert finished(cell, pendant) == [V.ACCEPTED]
    assert cell.core.cell.stop is None
    events, counts = cell.controller.referee.events, cell.controller.referee.counts
    assert not events["under-runs"]
    assert not counts


def test_promise_55_planned_motions_leave_so_far_ahead_unless_told_otherwise() -> None:
    assert round(ControllerLink().planned_lead * 1e3) == figure(55, "lead").ms


@pytest.mark.parametrize("who", ["server", "emulator"])
def test_promise_55_nor_do_many_of_them_one_after_the_other(who: Who) -> None:
    cell, pendant = moving()
    for _ in range(8):
        cell.wait(100)
        cell.stall(who, STALL)
    assert finished(cell, pendant) == [V.ACCEPTED]
    assert not cell.controller.referee.events["under-runs"]


@pytest.mark.parametrize("who", ["server", "emulator"])
def test_the_robot_is_never_seen_to_jump(who: Who) -> None:
    cell, _ = moving()
    cell.wait(500)
    before = cell.position[0]
    cell.stall(who, STALL)
    # 0.4 of the speed limit of a UR5's first joint, 3.15 rad/s, for 0.2 s.
    assert 0.0 <= cell.position[0] - before <= 0.4 * cell.limits.velocity[0] * 0.2 + 1e-6


def test_promise_26_a_real_controller_is_stopped_for_within_such_a_stall() -> None:
    cell, pendant = moving()
    cell.core.cell.feedback.says_emulated = False
    cell.wait(300)
    cell.stall("server", STALL)
    assert [code for _, code in pendant.outcomes()] == [V.SERVER_LATE]
    assert cell.core.cell.stop is not None


def test_a_queue_that_the_server_left_dry_names_the_server() -> None:
    """Shorter than the watchdog waits for an emulated robot, longer than its points last."""
    cell, pendant = moving()
    cell.wait(300)
    cell.stall("server", 330)
    cell.wait(50)
    assert [code for _, code in pendant.outcomes()] == [V.SERVER_LATE]
    assert (cell.controller.referee.events["under-runs"], cell.core.cell.stop) == (1, None)
    assert "log" in CATALOGUE[V.SERVER_LATE].remedy


def test_an_under_run_while_the_server_ticked_is_the_controllers() -> None:
    """Its answers stay away: nobody may send more."""
    cell, pendant = moving()
    cell.wait(300)
    cell._awaited[ControllerPath.MOTION] = 0
    held: list[tuple[int, Message]] = []
    hear = cell._from_controller
    cell._from_controller = lambda outgoing: held.extend(outgoing)  # type: ignore[method-assign]
    cell.wait(400)
    cell._from_controller = hear  # type: ignore[method-assign]
    cell.wait(50)
    assert [code for _, code in pendant.outcomes()] == [V.CONTROLLER_STOPPED]


FREEZE_NS = 100 * MS
"""Late for the watchdog, and the last report of the controller is still fresh enough to start."""


def test_promise_26_a_plan_that_is_served_first_after_a_freeze_begins_no_motion() -> None:
    rig, pad = at_a_pad(plans_at_once=False)
    pad.pendant.path((0.5, 0.5), (1.0, 0.0))
    rig.now += FREEZE_NS
    assert isinstance(rig.plan()[0], SendStop)
    rig.wait(500)
    assert rig.points == []
    assert pad.pendant.verdicts()[-1][1] is V.SERVER_LATE


def test_promise_26_a_program_that_is_loaded_first_after_a_freeze_begins_no_motion() -> None:
    cell = ProgramCell(main="move PTP b\n")
    cell.core.cell.feedback.says_emulated = False
    cell.wait(10)
    cell.held = deque()
    cell.run()
    cell.now += FREEZE_NS
    before = len(cell.sent)
    cell.answer_all()
    assert cell.core.cell.stop is not None
    assert all(getattr(message, "sequence", None) == -4 for message in cell.sent[before:])
    assert cell.user.verdicts()[-1][1] is not V.ACCEPTED


HELLO_DEADLINE = 2.0
LATE_NS = 300_000_000
_SAME_TURN = 5e-10
"""A timer that is due so much earlier runs in the same turn of the loop, before the other [s]."""


@pytest.mark.asyncio
@pytest.mark.virtual_clock
async def test_what_arrives_in_the_turn_of_a_late_tick_is_read_before_it() -> None:
    async with app_on_loop() as served:
        stranger = await served.visitor()
        await asyncio.sleep(HELLO_DEADLINE - 0.2)
        assert served.connections == 1
        loop = expect(VirtualLoop, asyncio.get_running_loop())

        def stand_still() -> None:
            stranger.send(said())
            loop._virtual.now_ns += LATE_NS

        loop.call_at(served.app._next_tick - _SAME_TURN, stand_still)
        await asyncio.sleep(1.0)
        assert served.connections == 1


@pytest.mark.asyncio
@pytest.mark.virtual_clock
async def test_what_does_not_arrive_is_judged_by_the_late_tick() -> None:
    async with app_on_loop() as served:
        await served.visitor()
        await asyncio.sleep(HELLO_DEADLINE - 0.2)
        loop = expect(VirtualLoop, asyncio.get_running_loop())
        loop._virtual.now_ns += LATE_NS
        took = await until(lambda: served.connections == 0, 0.05)
        assert took <= 0.02
