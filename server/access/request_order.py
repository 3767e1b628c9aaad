"""That no request which can move the robot is taken twice, or late (promise 28).

Owns one rule: on one connection the request ids of such requests only count up. A frame that comes
a second time, or behind one that was sent after it, has an id that is used up. Which requests these
are is `permissions`' table. TLS keeps others from repeating frames; this keeps the connection's own
software, or a proxy where there is no TLS, from doing so.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal


class RequestOrder:
    """The highest request id of each connection among the requests that can move the robot."""

    def __init__(self) -> None:
        """Have heard of no connection."""
        self._highest: dict[int, int] = {}

    def take(self, session: int, request_id: int) -> Refusal | None:
        """Use up a request id, and all below it.

        Args:
            session: the connection.
            request_id: of its request.

        Returns:
            Why the request is refused; None where its id is new. One that is refused for another
            reason later is used up all the same.
        """
        highest = self._highest.get(session)
        if highest is not None and request_id <= highest:
            text = f"request {request_id} comes after request {highest} of this connection"
            return Refusal(
                VerdictCode.REQUEST_REPEATED, text, value=float(request_id), limit=float(highest)
            )
        self._highest[session] = request_id
        return None

    def forget(self, session: int) -> None:
        """Forget a connection that ended; its number is never given to another."""
        self._highest.pop(session, None)
