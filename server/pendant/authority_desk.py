"""The motion authority as pendants ask for it: take it, take it over, give it back.

Owns who is told of a request. Who may have it is the cell's rule, and how long a lease lives is
`authority`'s.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import Authority, AuthorityAction, AuthorityReason
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.desk import AccessDesk
from ..access.roles import Permission
from ..outgoing import Outgoing, Send
from ..refusal import Refusal
from ..robot_cell import RobotCell
from .listeners import Listener, Listeners
from .replies import authority_wanted, verdict


class AuthorityDesk:
    """The motion authority of one cell, for its pendants."""

    def __init__(self, cell: RobotCell, listeners: Listeners) -> None:
        """Make a desk for one cell."""
        self._cell = cell
        self._listeners = listeners

    def authority(self, session: int, message: Authority, now: int) -> Refusal | list[Outgoing]:
        """Give the authority, take it over or take it back.

        Returns:
            Why it is refused, or everything that is to be written, the verdict included.
        """
        match message.action:
            case AuthorityAction.REQUEST:
                return self._take(session, message.request_id, now)
            case AuthorityAction.FORCE:
                return self._take(session, message.request_id, now, force=True)
            case AuthorityAction.RELEASE:
                change = self._cell.authority.release(session, AuthorityReason.RELEASED)
                if change is None:
                    return Refusal(VerdictCode.NOT_IN_CONTROL)
                gone = self._cell.authority_gone(change, now)
                return [*gone, Send(session, verdict(message.request_id))]
        text = f"action {message.action}; accepted: 1 request, 2 release, 3 take over"
        return Refusal(VerdictCode.BAD_ARGUMENT, text)

    def follow(self, listener: Listener, access: AccessDesk, now: int) -> list[Outgoing]:
        """End the authority of a pendant that is somebody else now, or may not move any more."""
        session, holder = listener.session, self._cell.authority.holder
        if holder is None or holder.session != session:
            return []
        if holder.client == listener.client and access.may(session, Permission.MOVE):
            return []
        # Whoever is still logged in by that name has lost the role alone.
        is_in = "" != access.name_of(session, "") == holder.client
        reason = AuthorityReason.ROLE_LOST if is_in else AuthorityReason.LOGGED_OUT
        change = self._cell.authority.release(session, reason)
        return self._cell.authority_gone(change, now)

    def _take(
        self, session: int, request_id: int, now: int, *, force: bool = False
    ) -> list[Outgoing]:
        """Give the authority to a pendant; where another has it, tell that one who asks."""
        asker = self._listeners[session].holder
        before = self._cell.authority.holder
        taken = self._cell.take_authority(asker, now, beats=True, force=force)
        if not isinstance(taken, Refusal):
            # A take-over stops what moves, and the stop leaves first.
            return [*taken, Send(session, verdict(request_id))]
        out: list[Outgoing] = [Send(session, verdict(request_id, taken))]
        if before is not None and before.session in self._listeners:
            out.append(Send(before.session, authority_wanted(asker)))
        return out
