"""What answered a request: an acceptance, a refusal, or nothing in time."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from openpendant.simplemsg import Message, ReplyCode
from openpendant.simplemsg.pendant import Management, Verdict

from .failures import Refused, Unanswered


def judged(verdict: asyncio.Future[Message], within: float | None) -> Message:
    """Return what answered a request that was waited for.

    Args:
        verdict: of `Conversation.send`.
        within: how long it was waited for [s]; None where without a bound.

    Raises:
        Refused: the verdict is a failure, or the answer to a management request is one.
        Unanswered: there is none.
        ConnectionLost: the connection ended.
    """
    if not verdict.done():
        text = f"no verdict within {within:g} s; the request may be carried out all the same"
        raise Unanswered(f"{text}: look at the state before you ask again")
    reply = verdict.result()
    if isinstance(reply, Verdict) and reply.reply_code != ReplyCode.SUCCESS:
        raise Refused(reply.code, reply.text, reply.joint, reply.value, reply.limit)
    if isinstance(reply, Management) and reply.reply_code != ReplyCode.SUCCESS:
        raise _refused(json.loads(reply.body))
    return reply


def _refused(answer: dict[str, Any]) -> Refused:
    """Return the refusal that the answer to a management request tells."""
    return Refused(
        answer.get("code", 0),
        answer.get("text", ""),
        answer.get("joint", -1),
        answer.get("value", 0.0),
        answer.get("limit", 0.0),
    )
