"""Motion of an operator's command, from taking the authority to its end.

Owns that interrupting the command stops the robot, and the output during the motion.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from openpendant.simplemsg.pendant import State, StateField
from openpendant.simplemsg.verdicts import VerdictCode

from ...console import ExitCode
from ..client import Aborted, MotionHandle, PendantClient, PendantError, Refused
from .running import CommandOutput, facts_of

STATE_RATE = 10.0
"""State messages for what is said of a motion, Hz."""

_PERIOD = 1.0
_STOPPED_WITHIN = 5.0

_NO_DEVICE = {
    VerdictCode.NOT_ENABLED: "this mode asks for the enabling device (training), which this command"
    " has none of: hold it in `openpendant pendant`, or set automatic there",
    VerdictCode.MODE_FORBIDS: "this mode does not allow it: set automatic in `openpendant pendant`,"
    " or use a pendant that holds the enabling device",
}
"""Remedies at a terminal, where the catalogue's do not fit."""

Begin = Callable[[], Awaitable[MotionHandle]]


async def move(pendant: PendantClient, output: CommandOutput, what: str, begin: Begin) -> int:
    """Take the authority, start a motion, report its progress, and return the exit code at its end.

    An interruption (Ctrl-C) stops the robot first; the end of the connection would stop it, too.
    """
    try:
        async with pendant.control():
            try:
                return await _watched(pendant, output, what, begin)
            except asyncio.CancelledError:
                task = asyncio.current_task()
                if task is not None:
                    task.uncancel()
                return await _interrupted(pendant, output, what)
    except Aborted as aborted:
        output.complain("aborted", f"{what}: {explained(aborted)}", **facts_of(aborted))
    except Refused as refused:
        if refused.code == VerdictCode.NO_MOTION:
            output.say("completed", f"{what}: the robot is there already")
            return ExitCode.OK
        output.complain("refused", f"{what}: {explained(refused)}", **facts_of(refused))
    return ExitCode.FAILED


async def _watched(pendant: PendantClient, output: CommandOutput, what: str, begin: Begin) -> int:
    output.say("asked", f"{what}: asked for; Ctrl-C stops the robot")
    motion = await begin()
    began = asyncio.get_running_loop().time()
    output.say("begun", f"{what}: begun")
    while not await motion.over_within(_PERIOD):
        seconds = asyncio.get_running_loop().time() - began
        where, facts = _where(pendant.state)
        output.say("moving", f"{what}: {seconds:.0f} s{where}", seconds=round(seconds, 3), **facts)
    result = await motion.done()
    took = f"planned in {result.plan_time:.2f} s, {result.motion_time:.1f} s long"
    output.say(
        "completed",
        f"{what}: completed; {took}"
        if result.motion_time
        else f"{what}: the robot is there already",
        plan_time=result.plan_time,
        motion_time=result.motion_time,
    )
    return ExitCode.OK


def _where(state: State | None) -> tuple[str, dict[str, object]]:
    """Return position and speed of the tool, in words and as JSON fields."""
    if state is None or not state.valid_fields & StateField.TOOL:
        return "", {}
    x, y, z = (1e3 * value for value in state.tool_position)
    words = f", tool at {x:.0f}, {y:.0f}, {z:.0f} mm, {1e3 * state.tool_speed:.0f} mm/s"
    return words, {"tool_position": list(state.tool_position), "tool_speed": state.tool_speed}


async def _interrupted(pendant: PendantClient, output: CommandOutput, what: str) -> int:
    """Stop the robot after an interruption of the command; return the exit code."""
    try:
        async with asyncio.timeout(_STOPPED_WITHIN):
            try:
                await pendant.program_stop()
            except Refused as refused:
                if refused.code != VerdictCode.NOTHING_TO_CONTROL:
                    await pendant.stop("Ctrl-C")
            await pendant.wait_until(lambda state: state.in_motion != 1, within=_STOPPED_WITHIN)
    except (PendantError, TimeoutError) as error:
        with contextlib.suppress(PendantError):
            await pendant.stop("Ctrl-C")
        reason = str(error) or f"no answer within {_STOPPED_WITHIN:g} s"
        text = f"{what}: interrupted; it was not seen at rest: {reason}; look at the robot"
        output.complain("unconfirmed", text)
        return ExitCode.UNAVAILABLE
    output.complain("stopped", f"{what}: interrupted, the robot stands")
    return ExitCode.INTERRUPTED


def explained(refused: Refused) -> str:
    """Return a refusal with its remedy at a terminal."""
    here = _NO_DEVICE.get(refused.code) if isinstance(refused.code, VerdictCode) else None
    return refused.explained if here is None else f"{refused} -> {here}"
