"""The walks: one event each through a running cell, from its first frame to what it leads to.

Owns which event a walk is, what state the cell is in then, and where the walk ends. A walk that is
to end with bytes ends where they are handed to the transport.
"""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import cache

from rigs.clock.virtual_clock import VirtualLoop
from walks.tracer import OnFrame, Tracer, Walk, any_frame
from walks.walked_cell import WalkedCell, receives, walked_cell

from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import Message, joint_array
from openpendant.simplemsg import pendant as messages

LISTENS = 100.0
"""Rate of a pendant that is told the state with each tick [Hz]."""

_MOMENT = 0.02
"""Within this time a message has arrived and was handled [s]."""

_PATIENCE = 120
"""Within this time comes an event of each kind that comes again and again [ms]."""

_IN_A_ROW = 5

_PROGRAM = """openpendant-program/1
program "main" robot ur5
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints 0.1 -1.5 1.5 -1.5 -1.5 0 rad
move PTP a
move PTP b
"""


@dataclass(frozen=True, slots=True)
class Route:
    """A walk that can be gone.

    Attributes:
        title: the event, and what it leads to.
        state_rate: of the cell's pendant [Hz].
    """

    title: str
    walk: Callable[[WalkedCell], Awaitable[Walk]]
    state_rate: float = 0.0


@cache
def gone(name: str) -> Walk:
    """Return a walk that was gone in a cell of its own.

    It is gone twice and the second one counts, since the first in a process may fill caches.
    """
    go(name)
    return go(name)


def go(name: str) -> Walk:
    """Go a walk in a cell of its own."""
    route = ROUTES[name]

    async def walk() -> Walk:
        async with walked_cell(state_rate=route.state_rate) as cell:
            return await route.walk(cell)

    loop = VirtualLoop()
    try:
        return loop.run_until_complete(walk())
    finally:
        loop.close()


# What the walks are made of.


async def _sent(
    cell: WalkedCell, message: Message, *leads_to: OnFrame, returns: bool = False
) -> Walk:
    """Walk from the bytes of a message of the pendant."""
    data = cell.hands.frame(message)
    with Tracer(receives(data), leads_to, returns=returns) as tracer:
        await cell.hands.send_frame(data)
        await _until_over(tracer)
    return tracer.walk


async def _until_over(tracer: Tracer) -> None:
    for _ in range(_PATIENCE):
        if tracer.is_over:
            return
        await asyncio.sleep(0.001)


def _delivered(deliver: Callable[[], None], leads_to: OnFrame) -> Walk:
    """Walk from an answer of the planner or the store."""
    with Tracer(any_frame, [leads_to]) as tracer:
        deliver()
    return tracer.walk


async def _next(begins: OnFrame, *leads_to: OnFrame) -> Walk:
    """Walk through events of a kind, each to the return of its first function.

    Returns the shortest: what comes with some of them only, as the tool's trace with each fourth
    round of reports, is no part of the walk.
    """
    walks = []
    for _ in range(_IN_A_ROW):
        with Tracer(begins, leads_to, returns=True) as tracer:
            await _until_over(tracer)
        walks.append(tracer.walk)
    return min(walks, key=lambda walk: walk.calls)


async def _take_control(cell: WalkedCell) -> None:
    hands = cell.hands
    await hands.accepted(messages.Authority(hands.request(), messages.AuthorityAction.REQUEST))
    cell.keep_on()


async def _press_key(cell: WalkedCell) -> None:
    """Jog the first joint, and wait until it moves."""
    hands = cell.hands
    await _take_control(cell)
    await hands.accepted(messages.SetMode(hands.request(), messages.OperatingMode.MANUAL_REDUCED))
    await asyncio.sleep(0.1)
    rates = joint_array((0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    press = hands.press + 1
    start = messages.JogStart(
        hands.request(), press, hands.state.sequence, 0.15, messages.JogSpace.JOINTS, "", 6, rates
    )
    await hands.accepted(start)
    hands.press = press
    await hands.until(lambda: hands.state.activity == messages.Activity.JOGGING)
    await asyncio.sleep(0.3)
    assert hands.state.velocities[0] > 0.05


# The walks.


def _pose_move(cell: WalkedCell) -> messages.PoseMove:
    # Where the robot stands at home, 50 mm higher.
    place = (-0.4869, -0.10915, 0.48186)
    turn = (-0.7071067690849304, -0.7071067690849304, 0.0, 0.0)
    return messages.PoseMove(cell.hands.request(), messages.Motion.PTP, 0.5, "base", place, turn)


async def pose_move_to_job(cell: WalkedCell) -> Walk:
    await _take_control(cell)
    return await _sent(cell, _pose_move(cell), cell.asks_planner)


async def pose_plan_to_point(cell: WalkedCell) -> Walk:
    await _take_control(cell)
    await cell.hands.send(_pose_move(cell))
    await asyncio.sleep(_MOMENT)
    return _delivered(cell.planner.planned(), cell.writes_to_controller)


async def jog_beat(cell: WalkedCell) -> Walk:
    await _press_key(cell)
    cell.keep_off()
    return await _sent(cell, cell.hands.next_beat())


async def jog_tick(cell: WalkedCell) -> Walk:
    await _press_key(cell)
    return await _next(cell.ticks, cell.writes_to_controller, cell.writes_to_pendant)


async def stop_while_jogging(cell: WalkedCell) -> Walk:
    await _press_key(cell)
    cell.keep_off()
    stop = messages.SoftwareStop(cell.hands.request(), "enough")
    return await _sent(cell, stop, cell.writes_to_controller)


async def controller_reports(cell: WalkedCell) -> Walk:
    return await _next(cell.is_told)


async def idle_tick(cell: WalkedCell) -> Walk:
    return await _next(cell.ticks)


async def telling_tick(cell: WalkedCell) -> Walk:
    return await _next(cell.ticks, cell.writes_to_pendant)


def _run_program(cell: WalkedCell) -> messages.ProgramRun:
    body = program_to_json(parse(_PROGRAM))
    cell.store.store.save(DocumentKind.PROGRAM, "main", body, expected_revision=0, author="test")
    return messages.ProgramRun(cell.hands.request(), messages.RunKind.ALL, 0, 1, 0, 1.0, "main")


async def program_to_load(cell: WalkedCell) -> Walk:
    await _take_control(cell)
    return await _sent(cell, _run_program(cell), cell.asks_store)


async def loaded_program_to_job(cell: WalkedCell) -> Walk:
    await _take_control(cell)
    await cell.hands.send(_run_program(cell))
    await asyncio.sleep(_MOMENT)
    return _delivered(cell.store.answered(), cell.asks_planner)


async def program_plan_to_point(cell: WalkedCell) -> Walk:
    await _take_control(cell)
    await cell.hands.send(_run_program(cell))
    await asyncio.sleep(_MOMENT)
    cell.store.answered()()
    return _delivered(cell.planner.planned(), cell.writes_to_controller)


async def frames_shown(cell: WalkedCell) -> Walk:
    request = cell.hands.manage("frames.show")
    return await _sent(cell, request, cell.writes_to_pendant, returns=True)


ROUTES: dict[str, Route] = {
    "a1": Route("pose move: bytes in to job asked", pose_move_to_job),
    "a2": Route("its plan back to first point written", pose_plan_to_point),
    "b1": Route("jog beat in", jog_beat, LISTENS),
    "b2": Route("tick with the jog's next point, one listener", jog_tick, LISTENS),
    "idle": Route("idle tick", idle_tick),
    "c": Route("software stop while jogging to its bytes", stop_while_jogging, LISTENS),
    "d1": Route("three controller reports", controller_reports),
    "d2": Route("tick that tells one listener", telling_tick, LISTENS),
    "e1": Route("program run asked to load", program_to_load),
    "e2": Route("program came to first motion asked", loaded_program_to_job),
    "e3": Route("its plan back to first point written", program_plan_to_point),
    "frames": Route("management frames.show", frames_shown),
}
"""All walks by name, in the order of the table."""
