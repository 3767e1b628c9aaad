"""Replies to pendants: verdicts, outcomes and cell events as messages.

Owns what fits a field: text is cut at whole characters and holds no control characters, numbers are
finite in four bytes, so that no answer is ever lost because it cannot be encoded.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from openpendant.simplemsg import ReplyCode, joint_array
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    AuthorityWanted,
    JogEnded,
    ModeChanged,
    Outcome,
    OutcomeKind,
    StopChanged,
    StopKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..control import Holder
from ..refusal import Refusal
from .cell_events import (
    AuthorityTransferred,
    MotionEnded,
    MotionRequest,
    OperatingModeChanged,
    StopAccount,
    StopLatch,
    StopLatchChanged,
)

NAME_BYTES = 32
"""Size of a name on the wire."""

REASON_BYTES = 64
"""Size of the reason of a stop on the wire."""

_TEXT_BYTES = 160
_LARGEST_REAL = 3.4e38
_CLAIMED = " (not logged in)"


def cut(text: str, size: int) -> str:
    """Return text that fits a field: whole characters, no control characters."""
    clean = "".join(char if char.isprintable() else "?" for char in text)
    return clean.encode("utf-8", "replace")[:size].decode("utf-8", "ignore")


def cut_at_word(text: str, size: int) -> str:
    """As `cut`, but a text that is too long ends behind a whole word, and with three dots."""
    told = cut(text, size)
    if len(told) == len(text):
        return told
    return cut(text, size - 4).rpartition(" ")[0] + " ..."


def in_words(text: str, named: Callable[[str], str]) -> str:
    """Return the text of a verdict or an outcome with other names in it, cut where too long."""
    told = named(text)
    return text if told == text else cut(told, _TEXT_BYTES)


def claimed(name: str) -> str:
    """Return a name that anybody could have put into his hello, as others are shown it."""
    return cut(name, NAME_BYTES - len(_CLAIMED)) + _CLAIMED


def _real(value: float) -> float:
    """Return a number that four bytes can hold; 0 for what is not a number."""
    return 0.0 if math.isnan(value) else min(max(value, -_LARGEST_REAL), _LARGEST_REAL)


def verdict(request_id: int, refusal: Refusal | None = None, note: str = "") -> Verdict:
    """Return the answer to a request: accepted, with a note, or refused with code and numbers."""
    if refusal is None:
        return Verdict(
            request_id=request_id,
            code=VerdictCode.ACCEPTED,
            joint=-1,
            value=0.0,
            limit=0.0,
            text=cut(note, _TEXT_BYTES),
        )
    return Verdict(
        request_id=request_id,
        code=refusal.code,
        joint=refusal.joint,
        value=_real(refusal.value),
        limit=_real(refusal.limit),
        text=cut(refusal.sentence, _TEXT_BYTES),
        reply_code=ReplyCode.FAILURE,
    )


def outcome(ended: MotionEnded) -> Outcome:
    """Return how an accepted request ended."""
    refusal = ended.refusal
    if refusal is None:
        kind, refusal = OutcomeKind.COMPLETED, Refusal(VerdictCode.ACCEPTED, "arrived")
    else:
        kind = OutcomeKind.ABORTED
    return Outcome(
        request_id=ended.request.request_id,
        outcome=kind,
        code=refusal.code,
        joint=refusal.joint,
        value=_real(refusal.value),
        limit=_real(refusal.limit),
        plan_time=ended.plan_time,
        motion_time=ended.motion_time,
        text=cut(refusal.sentence, _TEXT_BYTES),
    )


def sent_away(refusal: Refusal) -> Outcome:
    """Return the notification of a pendant that it may not observe any more.

    It answers no request of the pendant, hence id 0.
    """
    return outcome(MotionEnded(MotionRequest(0, 0), refusal, plan_time=0.0, motion_time=0.0))


def authority_changed(event: AuthorityTransferred) -> AuthorityChanged:
    """Return the message on the present holder of the motion authority."""
    holder = event.change.holder
    return AuthorityChanged(
        holder=0 if holder is None else holder.session,
        reason=event.change.reason,
        client="" if holder is None else cut(holder.client, NAME_BYTES),
    )


def stop_kind(stop: StopLatch | None) -> StopKind:
    """Return which stop is latched."""
    if stop is None:
        return StopKind.NONE
    return StopKind.PROTECTIVE if stop.is_protective else StopKind.SOFTWARE


def mode_changed(event: OperatingModeChanged) -> ModeChanged:
    """Return the message on a new mode of operation."""
    return ModeChanged(event.mode, event.by.session, cut(event.by.client, NAME_BYTES))


def authority_wanted(by: Holder) -> AuthorityWanted:
    """Return the message to the holder of the authority that another client asks for it."""
    return AuthorityWanted(by.session, cut(by.client, NAME_BYTES))


def jog_ended(account: StopAccount, tool_distance: float) -> JogEnded:
    """Return the message on the stop of a jog.

    Args:
        tool_distance: straight distance that the tool moved in that time [m].
    """
    return JogEnded(
        press=account.press,
        reason=account.reason,
        stop_time=account.time,
        joint_distance=account.joint_distance,
        tool_distance=tool_distance,
        positions=joint_array(account.ended_at),
    )


def stop_changed(event: StopLatchChanged) -> StopChanged:
    """Return the message on a stop or its reset."""
    stop, by = event.stop, event.by
    return StopChanged(
        stop=stop_kind(stop),
        session=by.session,
        client=cut(by.client, NAME_BYTES),
        reason="" if stop is None else cut(stop.reason, REASON_BYTES),
    )
