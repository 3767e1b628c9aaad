"""What pendants are told: verdicts, outcomes and news as messages.

Owns what fits a field: text is cut at whole characters and holds no control characters, numbers are
finite in four bytes, so that no answer is ever lost because it cannot be encoded.
"""

from __future__ import annotations

import math

from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    Outcome,
    OutcomeKind,
    StopChanged,
    StopKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

from .news import AuthorityMoved, Ended, StopMoved
from .refusal import Refusal

NAME_BYTES = 32
"""Size of a name on the wire."""

REASON_BYTES = 64
"""Size of the reason of a stop on the wire."""

_TEXT_BYTES = 160
_LARGEST_REAL = 3.4e38


def cut(text: str, size: int) -> str:
    """Return text that fits a field: whole characters, no control characters."""
    clean = "".join(char if char.isprintable() else "?" for char in text)
    return clean.encode("utf-8", "replace")[:size].decode("utf-8", "ignore")


def _real(value: float) -> float:
    """Return a number that four bytes can hold; 0 for what is not a number."""
    return 0.0 if math.isnan(value) else min(max(value, -_LARGEST_REAL), _LARGEST_REAL)


def verdict(request_id: int, refusal: Refusal | None = None) -> Verdict:
    """Return the answer to a request: accepted, or refused with code and numbers."""
    if refusal is None:
        return Verdict(
            request_id=request_id,
            code=VerdictCode.ACCEPTED,
            joint=-1,
            value=0.0,
            limit=0.0,
            text="",
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


def outcome(ended: Ended) -> Outcome:
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


def authority_changed(news: AuthorityMoved) -> AuthorityChanged:
    """Return the message that tells who holds the motion authority now."""
    holder = news.change.holder
    return AuthorityChanged(
        holder=0 if holder is None else holder.session,
        reason=news.change.reason,
        client="" if holder is None else cut(holder.client, NAME_BYTES),
    )


def stop_changed(news: StopMoved) -> StopChanged:
    """Return the message that tells of a stop or its reset."""
    stop, by = news.stop, news.by
    return StopChanged(
        stop=StopKind.NONE if stop is None else StopKind.SOFTWARE,
        session=by.session,
        client=cut(by.client, NAME_BYTES),
        reason="" if stop is None else cut(stop.reason, REASON_BYTES),
    )
