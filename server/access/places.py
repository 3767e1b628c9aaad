"""Places of connections: who gets one, who gives up his for it, and which addresses are barred.

Owns the rules of promise 54. Where accounts exist, the address and the standing of a connection
decide, so that no stranger's host takes the places of others; a network of IPv6 (/64) counts as one
address. A *stranger* is a pendant that has not logged in, whether it has said hello or not: 16 of
them have places at an address, 64 in all. Where these are taken, a newcomer gets the place of the
stranger that has been here longest of its own address, or of the address that has most. Whose login
waits keeps his place; but where all wait, who failed to log in before gives his up. Who finds no
place may still stop a robot: each address has one place for a stop, beside all others.

This machine's own connections, and all of them where there are no accounts, are only counted.

Pure: `now` is an argument, and the same events make the same decisions, in a rerun as well. Who
logged in as what is the business of `request_gate`, and who may open how many connections a second
that of `arrivals`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .exposure import is_loopback
from .gateways import Forwarder, Gateways
from .lockout import SECOND_NS, ip_of, source_of
from .request_gate import Basis, Granted, Visitors

MOST_STRANGERS = 64
"""Strangers at once; without accounts, pendants that have not said hello."""

STRANGERS_OF_ADDRESS = 16
"""Strangers of one address at once."""

KEPT_PLACES = 8
"""The last places: without accounts ROS-Industrial gets none of them, so that whoever wants to stop
a robot finds one; with accounts they are for admins, and for strangers on their way to log in."""

SHARES = 4
"""One account, and one address on the ports without a login, has at most a place in so many."""

MOST_STOP_PLACES = 32
"""Places for a stop at once, one an address; of more addresses the oldest goes."""

STOP_PLACE_NS = 2 * SECOND_NS
"""So long somebody may take to say hello and stop."""

MOST_BARS = 256
"""Addresses that are barred at once."""

_AGAIN_WHEN_FULL = 5
"""Advice to whom all places are taken [s]: some may have left by then."""

_AGAIN_WHEN_STRANGE = 2
"""Advice to whom strangers take the places [s]: by then these have said hello, or are gone."""

_LONGEST_ADDRESS = 64

_GIVEN_UP_AT_ONCE = 2
"""So many places a newcomer takes at most, of which it needs one: where logouts made more strangers
than there are places for, they become fewer again."""


class ConnectionStanding(StrEnum):
    """Standing of a connection."""

    ACCOUNT = "account"
    PAIRING = "pairing"
    SINGLE_USER = "single user"
    ROS = "ros-industrial"
    STRANGER = "stranger"
    STOP = "stop"


_OF_BASIS = {
    Basis.ACCOUNT: ConnectionStanding.ACCOUNT,
    Basis.PAIRING: ConnectionStanding.PAIRING,
    Basis.SINGLE_USER: ConnectionStanding.SINGLE_USER,
}


@dataclass(slots=True)
class ConnectionPlace:
    """Place of one connection.

    Attributes:
        source: who is charged for it, as `source_of` says.
        is_own: it comes from this machine.
        since: when it was taken [ns].
        is_for_stop: nothing but a stop is taken on it.
        is_given_up: another connection has it; this one is being closed.
        forwarder: the gateway that stated the address; None where it is the socket's.
    """

    session: int
    address: str
    source: str
    is_own: bool
    is_pendant: bool
    since: int
    is_for_stop: bool = False
    is_given_up: bool = False
    forwarder: Forwarder | None = None


@dataclass(frozen=True, slots=True)
class PlaceGiven:
    """A newcomer has a place.

    Attributes:
        given_up: connections that are to be closed for it.
        but_stop: why it may do nothing but stop; None where it may do more.
    """

    given_up: tuple[int, ...] = ()
    but_stop: Refusal | None = None

    @property
    def is_for_stop(self) -> bool:
        """True if it may do nothing but stop."""
        return self.but_stop is not None


def place_refusal(
    connections: int, strangers: int, max_connections: int, *, is_pendant: bool
) -> Refusal | None:
    """Return why there is no place for one more connection by count alone; None where there is.

    Its value is how long to wait before coming again [s].

    Args:
        strangers: pendants among them that have not said hello.
        max_connections: how many there may be, as configured.
    """
    if connections >= max_connections:
        return _no_place(f"more than {max_connections} connections", _AGAIN_WHEN_FULL)
    places = max(max_connections - KEPT_PLACES, 1)
    if not is_pendant and connections >= places:
        text = f"more than {places} connections; the last {KEPT_PLACES} are for pendants"
        return _no_place(text, _AGAIN_WHEN_FULL)
    if is_pendant and strangers >= MOST_STRANGERS:
        text = f"more than {MOST_STRANGERS} pendants that did not say hello yet"
        return _no_place(text, _AGAIN_WHEN_STRANGE)
    return None


def _no_place(why: str, again: int) -> Refusal:
    return Refusal(VerdictCode.NO_PLACE, f"{why}; come again in {again} s", value=again)


class ConnectionPlaces:
    """The places of one process.

    Attributes:
        most: how many connections there may be, as configured; those for a stop come on top.
    """

    def __init__(
        self, visitors: Visitors, most: int = 256, gateways: Gateways | None = None
    ) -> None:
        """Know no connection yet.

        Args:
            visitors: who said hello, and what each was granted.
            gateways: whose addresses are never barred; there is none where left out.
        """
        self.most = most
        self._visitors = visitors
        self._gateways = gateways
        self._places: dict[int, ConnectionPlace] = {}
        self._bars: dict[str, int] = {}

    def __iter__(self) -> Iterator[ConnectionPlace]:
        """Return the places in the order in which they were taken."""
        return iter(self._places.values())

    def find(self, session: int) -> ConnectionPlace | None:
        """Return the place of a connection; None where it has none."""
        return self._places.get(session)

    def standing(self, place: ConnectionPlace) -> ConnectionStanding:
        """Return whom a connection counts as now."""
        if place.is_for_stop:
            return ConnectionStanding.STOP
        if not place.is_pendant:
            return ConnectionStanding.ROS
        grant = self._grant_of(place)
        return ConnectionStanding.STRANGER if grant is None else _OF_BASIS[grant.basis]

    def _grant_of(self, place: ConnectionPlace) -> Granted | None:
        visitor = self._visitors.find(place.session)
        return None if visitor is None else visitor.grant

    # Who comes and who goes.

    def opened(
        self,
        session: int,
        address: str,
        now: int,
        *,
        is_pendant: bool,
        by_standing: bool,
        forwarder: Forwarder | None = None,
    ) -> PlaceGiven | Refusal:
        """Give a new connection a place, or return why there is none.

        The value of a NO_PLACE, and of an ADDRESS_BARRED, is when to come again [s].

        Args:
            by_standing: there are accounts.
            forwarder: the gateway that states the address; None where it is the socket's.
        """
        source, is_own = source_of(address), is_loopback(address)
        newcomer = ConnectionPlace(
            session, address, source, is_own, is_pendant, now, forwarder=forwarder
        )
        barred = self._barred(source, now)
        if barred is not None:
            # Somebody may stand beside a robot there: whoever is barred may stop it all the same.
            decided = self._for_stop(newcomer, barred) if is_pendant else barred
        else:
            decided = self._by_standing(newcomer) if by_standing else self._by_count(newcomer)
        if isinstance(decided, Refusal):
            return decided
        newcomer.is_for_stop = decided.is_for_stop
        for gone in decided.given_up:
            self._places[gone].is_given_up = True
        self._places[session] = newcomer
        return decided

    def closed(self, session: int) -> None:
        """Take the place of a connection that ended."""
        self._places.pop(session, None)

    def _taken(self) -> list[ConnectionPlace]:
        """Return all places that count: not those for a stop, nor those that are given up."""
        return [
            place
            for place in self._places.values()
            if not place.is_given_up and not place.is_for_stop
        ]

    def _by_count(self, newcomer: ConnectionPlace) -> PlaceGiven | Refusal:
        taken = self._taken()
        silent = sum(self._is_silent(place) for place in taken)
        pendant = newcomer.is_pendant
        return place_refusal(len(taken), silent, self.most, is_pendant=pendant) or PlaceGiven()

    def _is_silent(self, place: ConnectionPlace) -> bool:
        return place.is_pendant and self._visitors.find(place.session) is None

    def _by_standing(self, newcomer: ConnectionPlace) -> PlaceGiven | Refusal:
        taken = self._taken()
        strangers = [place for place in taken if self._is_displaceable(place)]
        is_full = len(taken) >= self.most
        if not newcomer.is_own and newcomer.is_pendant:
            return self._stranger(newcomer, strangers, is_full)
        # No stranger keeps these out, so that only the others are counted against them.
        others = len(taken) - len(strangers)
        refusal = self._counted_refusal(newcomer, taken, others)
        if refusal is not None:
            return refusal
        given_up = self._given_up(newcomer, strangers) if is_full else ()
        if is_full and not given_up:
            return _no_place(f"more than {self.most} connections", _AGAIN_WHEN_STRANGE)
        return PlaceGiven(given_up)

    def _is_displaceable(self, place: ConnectionPlace) -> bool:
        return not place.is_own and self.standing(place) is ConnectionStanding.STRANGER

    def _counted_refusal(
        self, newcomer: ConnectionPlace, taken: Sequence[ConnectionPlace], others: int
    ) -> Refusal | None:
        """Return why one of this machine, or of ROS-Industrial, gets no place."""
        silent = sum(self._is_silent(place) for place in taken if place.is_own)
        pendant = newcomer.is_pendant
        refusal = place_refusal(others, silent, self.most, is_pendant=pendant)
        if refusal is not None or newcomer.is_own:
            return refusal
        # These ports know no login, so that an address is all there is to tell people apart by.
        of_address = sum(
            place.source == newcomer.source and not place.is_pendant for place in taken
        )
        if of_address < self._share:
            return None
        text = f"more than {self._share} ROS-Industrial connections of {newcomer.source}"
        return _no_place(text, _AGAIN_WHEN_FULL)

    @property
    def _share(self) -> int:
        return max(self.most // SHARES, 1)

    def _stranger(
        self, newcomer: ConnectionPlace, strangers: Sequence[ConnectionPlace], is_full: bool
    ) -> PlaceGiven | Refusal:
        of_address = [place for place in strangers if place.source == newcomer.source]
        if len(of_address) >= STRANGERS_OF_ADDRESS:
            given_up = self._longest(of_address, STRANGERS_OF_ADDRESS)
        elif is_full or len(strangers) >= MOST_STRANGERS:
            given_up = self._given_up(newcomer, strangers)
        else:
            return PlaceGiven()
        if given_up:
            return PlaceGiven(given_up)
        return self._for_stop(newcomer, no_place_for_strangers())

    def _given_up(
        self, newcomer: ConnectionPlace, strangers: Sequence[ConnectionPlace]
    ) -> tuple[int, ...]:
        """Return whose place a newcomer gets of the address that has most; nobody's if empty."""
        by_source: dict[str, list[ConnectionPlace]] = {}
        for place in strangers:
            by_source.setdefault(place.source, []).append(place)
        own = len(by_source.get(newcomer.source, ()))

        def rank(each: tuple[str, list[ConnectionPlace]]) -> tuple[int, bool]:
            return -len(each[1]), each[0] != newcomer.source

        for source, places in sorted(by_source.items(), key=rank):
            # An address never gives one up to another that has as many: it would be its turn next.
            if source == newcomer.source or len(places) > own:
                given_up = self._longest(places, len(places))
                if given_up:
                    return given_up
        return ()

    def _longest(self, places: Sequence[ConnectionPlace], most: int) -> tuple[int, ...]:
        """Return who of an address gives up his place; nobody where all have a login waiting."""
        wanted = _GIVEN_UP_AT_ONCE if len(places) > most else 1
        free = [place for place in places if not self._waits(place)]
        if free:
            free.sort(key=self._looks_on)  # each half stays in the order in which they came
            return tuple(place.session for place in free[:wanted])
        failed = (place.session for place in places if self._has_failed(place))
        return tuple(failed)[:1]

    def _waits(self, place: ConnectionPlace) -> bool:
        visitor = self._visitors.find(place.session)
        return visitor is not None and visitor.checking

    def _looks_on(self, place: ConnectionPlace) -> bool:
        visitor = self._visitors.find(place.session)
        return visitor is not None and visitor.looks_on

    def _has_failed(self, place: ConnectionPlace) -> bool:
        visitor = self._visitors.find(place.session)
        return visitor is not None and visitor.has_failed

    def _for_stop(self, newcomer: ConnectionPlace, refusal: Refusal) -> PlaceGiven | Refusal:
        """Give a stranger without a place the one that its address has for a stop.

        Args:
            refusal: why it has no other.
        """
        stops = [
            place for place in self._places.values() if place.is_for_stop and not place.is_given_up
        ]
        if any(place.source == newcomer.source for place in stops):
            return refusal
        oldest = tuple(place.session for place in stops[:1])
        return PlaceGiven(oldest if len(stops) >= MOST_STOP_PLACES else (), but_stop=refusal)

    # Who logs in.

    def login_refusal(self, session: int, granted: Granted) -> Refusal | None:
        """Return why a connection may not become somebody who logged in; None where it may.

        Args:
            granted: what it is to be granted.
        """
        place = self._places.get(session)
        if place is None or place.is_own:
            return None
        if place.is_for_stop:
            return no_place_for_strangers()
        others = [each for each in self._taken() if each.session != session]
        if granted.role is not Role.ADMIN:
            places = max(self.most - KEPT_PLACES, 1)
            firm = sum(not self._is_displaceable(each) for each in others)
            if firm >= places:
                text = f"more than {places} connections; the last {KEPT_PLACES} are for admins"
                return _no_place(text, _AGAIN_WHEN_FULL)
        alike = sum(self._is_alike(each, place, granted) for each in others)
        if alike < self._share:
            return None
        who = f"{granted.name} has"
        if granted.basis is Basis.PAIRING:
            who = f"the guests of {place.source} have"
        text = f"{who} {alike} connections, and a quarter of all places is {self._share}"
        return Refusal(VerdictCode.ACCOUNT_FULL, text, value=alike, limit=self._share)

    def _is_alike(self, other: ConnectionPlace, place: ConnectionPlace, granted: Granted) -> bool:
        """Return True if another place counts with that of who is to be granted something.

        A guest chooses his name, so that all guests of an address count as one account.
        """
        grant = self._grant_of(other)
        if other.is_own or grant is None or grant.basis is not granted.basis:
            return False
        if granted.basis is Basis.PAIRING:
            return other.source == place.source
        return grant.name == granted.name

    # Which addresses are barred.

    def bars(self, now: int) -> dict[str, int]:
        """Return until when each barred address is barred [ns], the soonest to end first."""
        for source, until in list(self._bars.items()):
            if until <= now:
                del self._bars[source]
        return dict(sorted(self._bars.items(), key=lambda each: each[1]))

    def _barred(self, source: str, now: int) -> Refusal | None:
        until = self._bars.get(source, 0)
        if until <= now:
            return None
        seconds = -(-(until - now) // SECOND_NS)
        text = f"an admin has barred {source}; come again in {seconds} s"
        return Refusal(VerdictCode.ADDRESS_BARRED, text, value=seconds)

    def bar(self, address: str, until: int, by: int, now: int) -> tuple[int, ...] | Refusal:
        """Let nobody of an address in until a time [ns], but for its stop.

        Args:
            by: connection of who asks.

        Returns:
            The connections of that address, which are to be closed; or why it is not barred.
        """
        source = self._bar_source(address)
        if source is None:
            accepted = "one of IPv4, or one of IPv6 for its /64"
            text = f"{address[:_LONGEST_ADDRESS]!r} is no address; accepted: {accepted}"
            return Refusal(VerdictCode.BAD_ARGUMENT, text)
        fault = self._bar_fault(source, by)
        if fault is not None:
            return Refusal(VerdictCode.BAR_REFUSED, fault)
        if source not in self._bars and len(self.bars(now)) >= MOST_BARS:
            text = f"{MOST_BARS} addresses are barred already"
            return Refusal(VerdictCode.BAR_REFUSED, text, value=MOST_BARS, limit=MOST_BARS)
        self._bars[source] = until
        return tuple(place.session for place in self if place.source == source)

    def unbar(self, address: str, now: int) -> Refusal | None:
        """Let an address in again; return why that is not done."""
        source = self._bar_source(address)
        if source is None or source not in self.bars(now):
            text = f"{address[:_LONGEST_ADDRESS]!r} is not barred"
            return Refusal(VerdictCode.BAD_ARGUMENT, text)
        del self._bars[source]
        return None

    def _bar_source(self, address: str) -> str | None:
        """Return what an address, or what a list of bars calls one, is charged to; None if none."""
        source = source_of(address.strip().removesuffix("/64"))
        return None if ip_of(source.removesuffix("/64")) is None else source

    def _bar_fault(self, source: str, by: int) -> str | None:
        """Return why an address is not to be barred by who asks; None where it may be."""
        ip = ip_of(source.removesuffix("/64"))
        if ip is None or ip.is_loopback or ip.is_unspecified or ip.is_multicast:
            return f"{source} is this machine's own, or no address of one host"
        if self._gateways is not None and self._gateways.has_source(source):
            return f"a gateway connects from {source}; bar the addresses that it states"
        here = [place for place in self if place.source == source and not place.is_given_up]
        if any(place.session == by for place in here):
            return f"you come from {source} yourself"
        admins = (self._grant_of(place) for place in here)
        names = sorted({each.name for each in admins if each and each.role is Role.ADMIN})
        if names:
            return f"{', '.join(names)}, who is admin, is logged in from {source}"
        return None


def no_place_for_strangers() -> Refusal:
    """Return why somebody who has not logged in may do nothing, or nothing but stop."""
    why = "who has not logged in finds every place taken, and may only stop"
    return _no_place(why, _AGAIN_WHEN_STRANGE)
