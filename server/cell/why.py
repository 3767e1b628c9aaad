"""Answer to "why is it not moving?": every condition of a motion, and the first broken one.

Owns how the chain of `interlocks` is told. The conditions themselves, and their order, are
`interlocks`'; cause and remedy are the catalogue's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from openpendant.simplemsg.pendant.management.cell import WhyRequest, Wish
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

from ..control import MotionKind
from ..events.cell_events import StopLatch
from ..refusal import JsonBody, Refusal
from .interlocks import Interlock, InterlockQuery, examine_motion
from .robot_cell import RobotCell


class ConditionReport(JsonBody):
    """One condition; code, cause, remedy and text are empty where it holds or was not broken."""

    condition: str
    meaning: str
    holds: bool
    code: int = 0
    name: str = ""
    text: str = ""
    cause: str = ""
    remedy: str = ""


class EndReport(JsonBody):
    """Why the last motion ended before its goal: an entry of the catalogue, and its numbers."""

    code: int
    name: str
    text: str
    cause: str
    remedy: str


class WhyReply(JsonBody):
    """The chain of conditions in the order in which they are examined."""

    cell: str
    kind: Wish
    ready: bool
    broken: str
    """The first condition that is broken; empty where all hold."""
    conditions: tuple[ConditionReport, ...]
    ended: EndReport | None = None
    """Why the last motion ended before its goal; null where it arrived or another began."""
    remarks: tuple[str, ...]
    """What else is to be known; keeps nothing from moving."""
    enabling_deadline: float
    """For how long the enabling device of who shall move it may be silent [s]."""


RoleFault = Callable[[int], Refusal | None]
"""Returns why the role of a connection does not let it move the robot."""


Known = Callable[[VerdictCode], VerdictCode]
"""Returns the code by which a connection knows a code, in an older version of the protocol too."""


def _as_it_is(code: VerdictCode) -> VerdictCode:
    return code


def why(
    cell: RobotCell,
    name: str,
    request: WhyRequest,
    session: int,
    now: int,
    contact: Refusal | None = None,
    role: RoleFault | None = None,
    known: Known = _as_it_is,
) -> WhyReply:
    """Examine every condition of a motion.

    Args:
        contact: what the robot touches where it stands; None for nothing.
        role: tells whose role is too low; None where everybody may move the robot.
        known: returns the code by which whoever asks knows a code.
    """
    holder = cell.authority.holder
    if request.whose == "holder" and holder is not None:
        session = holder.session
    wish = Wish(request.kind)
    kind = MotionKind[wish.name]
    asked = InterlockQuery(role=role or (lambda _: None), contact=contact)
    chain = examine_motion(cell, kind, session, now, asked=asked)
    shortly = cell.joint_names.shortly
    reports = tuple(_report(finding, cell.stop, shortly, known) for finding in chain)
    broken = next((report.condition for report in reports if not report.holds), "")
    return WhyReply(
        cell=name,
        kind=wish,
        ready=not broken,
        broken=broken,
        conditions=reports,
        ended=None if cell.ended is None else _end(cell.ended, shortly, known),
        remarks=_remarks(cell, now),
        enabling_deadline=round(cell.modes.enabling_deadline(session), 6),
    )


_InWords: TypeAlias = Callable[[str], str]
"""Returns a sentence with the display names of joints."""


def _end(refusal: Refusal, shortly: _InWords, known: Known) -> EndReport:
    code, text, entry = known(refusal.code), shortly(refusal.sentence), CATALOGUE[refusal.code]
    return EndReport(code=code, name=code.name, text=text, cause=entry.cause, remedy=entry.remedy)


def _remarks(cell: RobotCell, now: int) -> tuple[str, ...]:
    moved = cell.driving.uncommanded
    if moved is None:
        return ()
    ago = (now - moved.at) / 1e9
    somebody = "somebody may have moved it with the controller's own pendant"
    sentence = cell.joint_names.shortly(moved.sentence)
    return (f"{ago:.0f} s ago {sentence}; {somebody}",)


def _report(
    finding: Interlock, stop: StopLatch | None, shortly: _InWords, known: Known
) -> ConditionReport:
    condition, refusal = finding
    name, meaning = condition.name.lower(), condition.value
    if refusal is None:
        return ConditionReport(condition=name, meaning=meaning, holds=True)
    # A stop by the server itself says no more than that; what it was stopped for has the remedy.
    by_itself = stop is not None and refusal.code is VerdictCode.PROTECTIVE_STOP
    entry = CATALOGUE[stop.code if stop is not None and by_itself else refusal.code]
    code = known(refusal.code)
    return ConditionReport(
        condition=name,
        meaning=meaning,
        holds=False,
        code=code,
        name=code.name,
        text=shortly(refusal.sentence),
        cause=entry.cause,
        remedy=entry.remedy,
    )
