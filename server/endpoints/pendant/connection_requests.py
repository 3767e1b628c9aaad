"""Requests about the connections of the whole server: who is here, closing one, barring an address.

Whoever asks is an admin. The rules, and who has which place, are `places`' business; what each
connection takes of the loop is measured elsewhere, and asked for by an `Ask`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import count

from openpendant.simplemsg.pendant.management import access
from openpendant.simplemsg.pendant.management.declaration import Done
from openpendant.simplemsg.verdicts import VerdictCode

from ...access.admission import Admission
from ...access.audit import AuditEvent, Detail
from ...access.connection_loads import ConnectionLoad, LoadQuestion
from ...access.lockout import SECOND_NS
from ...access.places import ConnectionPlace
from ...events.effects import CutOff, Effect
from ...events.management_requests import ReplyTo, handles
from ...events.pending import Pending
from ...refusal import Refusal

MOST_LISTED = 100
"""Connections in one answer, which has to fit a frame and a turn of the loop."""

_MINUTE_NS = 60 * SECOND_NS


class ConnectionRequests:
    """Requests of one cell's pendants about all connections of the server."""

    def __init__(self, login: Admission, pending: Pending) -> None:
        """Answer from the login of all cells."""
        self._login = login
        self._pending = pending
        self._numbers = count(1)

    @handles(access.ListConnections)
    def _list_connections(
        self, asked: access.ListConnections, reply: ReplyTo[access.Connections], now: int
    ) -> list[Effect]:
        following = sorted(
            place.session for place in self._login.places if place.session > asked.after
        )
        listed = tuple(following[:MOST_LISTED])
        question = LoadQuestion(next(self._numbers), listed)
        more = len(following) - len(listed)
        return self._pending.ask(question, partial(self._measured, listed, more, reply))

    def _measured(
        self,
        listed: tuple[int, ...],
        more: int,
        reply: ReplyTo[access.Connections],
        loads: Mapping[int, ConnectionLoad],
        now: int,
    ) -> list[Effect]:
        """Tell of the connections that are still there once their load is known."""
        places = self._login.places
        found = [place for place in map(places.find, listed) if place is not None]
        barred: list[access.Bar] = [
            {"address": source, "remaining": round((until - now) / SECOND_NS, 1)}
            for source, until in places.bars(now).items()
        ]
        reports = [
            self._report(place, loads.get(place.session, ConnectionLoad()), now) for place in found
        ]
        return reply.answer({"connections": reports, "more": more, "barred": barred})

    def _report(
        self, place: ConnectionPlace, load: ConnectionLoad, now: int
    ) -> access.ConnectionReport:
        visitor = self._login.visitors.find(place.session)
        grant = None if visitor is None else visitor.grant
        return {
            "session": place.session,
            "address": place.address,
            "standing": self._login.places.standing(place).value,
            "client": "" if visitor is None else visitor.client,
            "cell": "" if visitor is None else visitor.cell,
            "name": "" if grant is None else grant.name,
            "role": "" if grant is None else grant.role.value,
            "since": round((now - place.since) / SECOND_NS, 1),
            "frames": load.frames,
            "bytes": load.received,
            "cost": round(load.cost_ns / SECOND_NS, 4),
        }

    @handles(access.CloseConnection)
    def _close_connection(
        self, asked: access.CloseConnection, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        place = self._login.places.find(asked.session)
        if asked.session == reply.session:
            text = "this is your own connection; log out, or hang up"
            return reply.refuse(Refusal(VerdictCode.BAD_ARGUMENT, text))
        if place is None or place.is_given_up:
            text = f"there is no connection {asked.session}"
            return reply.refuse(Refusal(VerdictCode.UNKNOWN_CONNECTION, text, value=asked.session))
        self._note(AuditEvent.CONNECTION_CLOSED, reply.session, now, **self._about(place))
        return [*reply.answer({}), self._cut_off(place.session, reply)]

    def _about(self, place: ConnectionPlace) -> dict[str, Detail]:
        visitor = self._login.visitors.find(place.session)
        grant = None if visitor is None else visitor.grant
        name = "" if grant is None else grant.name
        return {"closed": place.session, "address": place.address, "account": name}

    @handles(access.BarAddress)
    def _bar_address(
        self, asked: access.BarAddress, reply: ReplyTo[access.ClosedConnections], now: int
    ) -> list[Effect]:
        until = now + asked.minutes * _MINUTE_NS
        barred = self._login.places.bar(asked.address, until, reply.session, now)
        if isinstance(barred, Refusal):
            return reply.refuse(barred)
        about: dict[str, Detail] = {"address": asked.address, "minutes": asked.minutes}
        self._note(AuditEvent.ADDRESS_BARRED, reply.session, now, **about, closed=len(barred))
        ended = [self._cut_off(session, reply) for session in barred]
        return [*reply.answer({"closed": len(barred)}), *ended]

    @handles(access.UnbarAddress)
    def _unbar_address(
        self, asked: access.UnbarAddress, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        refusal = self._login.places.unbar(asked.address, now)
        if refusal is not None:
            return reply.refuse(refusal)
        self._note(AuditEvent.ADDRESS_UNBARRED, reply.session, now, address=asked.address)
        return reply.answer({})

    @staticmethod
    def _cut_off(session: int, reply: ReplyTo[Done] | ReplyTo[access.ClosedConnections]) -> Effect:
        return CutOff(session, f"closed by {reply.name}, session {reply.session}")

    def _note(self, event: AuditEvent, session: int, now: int, **detail: Detail) -> None:
        visitor = self._login.visitors.find(session)
        if visitor is not None:
            self._login.visitors.note(event, visitor, now, **detail)
