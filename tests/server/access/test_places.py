"""Places by address and standing: who gets one, who gives one up, who may still stop."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure

from openpendant.server.access.audit import AuditEntry
from openpendant.server.access.places import (
    MOST_BARS,
    ConnectionPlace,
    ConnectionPlaces,
    ConnectionStanding,
    PlaceGiven,
    no_place_for_strangers,
)
from openpendant.server.access.request_gate import Basis, Granted, Visitor, Visitors
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V

SECOND = 1_000_000_000
START = 1_000 * SECOND
OF_ADDRESS, IN_ALL = figure(54, "of_address").count, figure(54, "strangers").count
STOPS = figure(54, "stops").count
SHARE = 256 // figure(54, "share").count
KEPT = figure(54, "kept").count


def _forget(entry: AuditEntry) -> None:
    """Keep no log."""


class Hall:
    """Places of a server with accounts, and who is on them."""

    def __init__(self, most: int = 256, *, by_standing: bool = True) -> None:
        self.visitors = Visitors(_forget, observe_without_login=True)
        self.places = ConnectionPlaces(self.visitors, most)
        self.by_standing = by_standing
        self.last = 0
        self.gone: list[int] = []

    def decide(
        self, address: str, *, now: int = START, pendant: bool = True
    ) -> PlaceGiven | Refusal:
        """Have a connection come; who gives up a place for it is closed."""
        self.last += 1
        decided = self.places.opened(
            self.last, address, now, is_pendant=pendant, by_standing=self.by_standing
        )
        if isinstance(decided, PlaceGiven):
            for session in decided.given_up:
                self.gone.append(session)
                self.leave(session)
        return decided

    def come(self, address: str, *, pendant: bool = True) -> int:
        """Have a connection come that gets a usual place; return its number."""
        decided = self.decide(address, pendant=pendant)
        assert isinstance(decided, PlaceGiven)
        assert not decided.is_for_stop
        return self.last

    def hello(self, address: str, **about: bool) -> int:
        """Have one come and say hello."""
        session = self.come(address)
        visitor = Visitor(session, address, "app", "cell", **about)  # type: ignore[arg-type]
        self.visitors.add(visitor, START)
        return session

    def visitor(self, session: int) -> Visitor:
        found = self.visitors.find(session)
        assert found is not None
        return found

    def log_in(
        self, address: str, name: str, role: Role = Role.OPERATOR, basis: Basis = Basis.ACCOUNT
    ) -> Refusal | None:
        """Have one come, say hello and prove who he is; return why he may not be that."""
        session = self.hello(address)
        granted = Granted(session, role, name, basis)
        full = self.places.login_refusal(session, granted)
        if full is None:
            self.visitor(session).grant = granted
        return full

    def leave(self, session: int) -> None:
        self.places.closed(session)
        self.visitors.remove(session, START)

    def here(self, address: str = "") -> list[int]:
        return [place.session for place in self.places if place.address.startswith(address)]


def test_promise_54_a_newcomer_gets_the_place_of_the_longest_stranger_of_its_address() -> None:
    hall = Hall()
    other = hall.come("192.0.2.1")
    crowd = [hall.come("192.0.2.7") for _ in range(OF_ADDRESS)]
    assert hall.gone == []
    late = [hall.come("192.0.2.7") for _ in range(3)]
    assert hall.gone == crowd[:3]
    assert hall.here("192.0.2.7") == [*crowd[3:], *late]
    assert hall.here("192.0.2.1") == [other]


def test_promise_54_where_all_are_taken_the_address_that_has_most_gives_up_one() -> None:
    hall = Hall()
    sizes = (16, 15, 16, 14, 3)
    assert sum(sizes) == IN_ALL
    crowds = [
        [hall.come(f"192.0.2.{number}") for _ in range(size)] for number, size in enumerate(sizes)
    ]
    hall.come("198.51.100.1")
    assert hall.gone == [crowds[0][0]]
    hall.come("198.51.100.1")
    assert hall.gone == [crowds[0][0], crowds[2][0]]
    assert len(hall.here()) == IN_ALL


def test_promise_54_nobody_gives_up_a_place_to_an_address_that_has_as_many() -> None:
    hall = Hall()
    first = [hall.come(f"192.0.2.{number}") for number in range(IN_ALL)]
    hall.come("192.0.2.5")
    assert hall.gone == [first[5]]
    hall.come("198.51.100.1")
    assert hall.gone == [first[5], first[0]]


def test_promise_54_who_looks_on_gives_up_a_place_after_the_others() -> None:
    hall = Hall()
    watching = [hall.hello("192.0.2.7", looks_on=True) for _ in range(OF_ADDRESS - 2)]
    silent = hall.come("192.0.2.7")
    idle = hall.hello("192.0.2.7")
    for _ in range(2):
        hall.hello("192.0.2.7", looks_on=True)
    assert hall.gone == [silent, idle]
    hall.come("192.0.2.7")
    assert hall.gone == [silent, idle, watching[0]]


def test_promise_54_whose_login_waits_keeps_his_place() -> None:
    hall = Hall()
    waiting = [hall.hello("192.0.2.7", checking=True) for _ in range(OF_ADDRESS - 1)]
    hall.come("192.0.2.7")
    for _ in range(4):
        hall.come("192.0.2.7")
    assert hall.here("192.0.2.7")[:-1] == waiting


def test_promise_54_where_all_wait_who_failed_before_gives_up_his_place() -> None:
    hall = Hall()
    waiting = [hall.hello("192.0.2.7", checking=True) for _ in range(OF_ADDRESS)]
    hall.visitor(waiting[5]).has_failed = True
    hall.visitor(waiting[9]).has_failed = True
    hall.come("192.0.2.7")
    assert hall.gone == [waiting[5]]


def test_promise_54_where_nobody_gives_up_a_place_one_may_stop_and_the_next_is_told_when() -> None:
    hall = Hall()
    for _ in range(OF_ADDRESS):
        hall.hello("192.0.2.7", checking=True)
    assert hall.decide("192.0.2.7") == PlaceGiven(but_stop=no_place_for_strangers())
    stopping = hall.places.find(hall.last)
    assert stopping is not None
    assert hall.places.standing(stopping) is ConnectionStanding.STOP
    told = hall.decide("192.0.2.7")
    assert isinstance(told, Refusal)
    assert (told.code, told.value) == (V.NO_PLACE, 2)
    assert "come again in 2 s" in told.sentence
    # It takes no other's place: whoever comes from elsewhere has one.
    hall.come("192.0.2.8")
    hall.leave(stopping.session)
    assert hall.decide("192.0.2.7") == PlaceGiven(but_stop=no_place_for_strangers())


def test_promise_54_of_more_stop_places_than_there_are_the_oldest_goes() -> None:
    hall = Hall()
    for number in range(4):
        for _ in range(OF_ADDRESS):
            hall.hello(f"192.0.2.{number}", checking=True)
    first = hall.last + 1
    for number in range(STOPS):
        assert hall.decide(f"198.51.100.{number}") == PlaceGiven(but_stop=no_place_for_strangers())
    assert hall.decide("203.0.113.1") == PlaceGiven((first,), no_place_for_strangers())
    assert hall.decide("203.0.113.2") == PlaceGiven((first + 1,), no_place_for_strangers())
    stops = [place for place in hall.places if place.is_for_stop]
    assert len(stops) == STOPS
    assert hall.gone == [first, first + 1]


def test_promise_54_a_network_of_ipv6_is_one_address() -> None:
    hall = Hall()
    crowd = [hall.come(f"2001:db8:0:7::{number:x}") for number in range(OF_ADDRESS)]
    hall.come("2001:db8:0:7:8000::1")
    assert hall.gone == crowd[:1]
    hall.come("2001:db8:0:8::1")
    hall.come("::ffff:192.0.2.1")
    assert hall.gone == crowd[:1]


def test_promise_54_a_connection_that_gives_up_its_place_is_counted_no_more() -> None:
    """It is closed in a later turn, and until then others may come."""
    places = ConnectionPlaces(Visitors(_forget, observe_without_login=False))
    for session in range(1, OF_ADDRESS + 1):
        places.opened(session, "192.0.2.7", START, is_pendant=True, by_standing=True)
    for late in range(3):
        decided = places.opened(100 + late, "192.0.2.7", START, is_pendant=True, by_standing=True)
        assert decided == PlaceGiven((late + 1,))


# This machine, and a server without accounts.


@pytest.mark.parametrize(("address", "by_standing"), [("127.0.0.1", True), ("192.0.2.7", False)])
def test_own_connections_and_all_without_accounts_are_only_counted(
    address: str, by_standing: bool
) -> None:
    hall = Hall(by_standing=by_standing)
    for _ in range(IN_ALL):
        hall.come(address)
    told = hall.decide(address)
    assert isinstance(told, Refusal)
    assert "more than 64 pendants that did not say hello" in told.text
    for session in hall.here():
        hall.visitors.add(Visitor(session, address, "", ""), START)
    for _ in range(256 - IN_ALL):
        hall.hello(address)
    told = hall.decide(address)
    assert isinstance(told, Refusal)
    assert told.text == "more than 256 connections; come again in 5 s"
    assert hall.gone == []


def test_strangers_of_others_keep_nobody_of_this_machine_out() -> None:
    hall = Hall(most=32)
    crowd = [hall.come(f"192.0.2.{number % 2}") for number in range(32)]
    hall.come("127.0.0.1")
    hall.come("::1")
    assert hall.gone == [crowd[0], crowd[1]]


def test_promise_54_ros_clients_of_an_address_have_a_quarter_and_leave_the_last_places() -> None:
    hall = Hall()
    for _ in range(SHARE):
        hall.come("192.0.2.7", pendant=False)
    told = hall.decide("192.0.2.7", pendant=False)
    assert isinstance(told, Refusal)
    assert told.code is V.NO_PLACE
    for number in range(3 * SHARE - KEPT):
        hall.come(f"198.51.100.{number}", pendant=False)
    told = hall.decide("192.0.2.8", pendant=False)
    assert isinstance(told, Refusal)
    assert "the last 8 are for pendants" in told.text


def test_promise_54_a_ros_client_gets_the_place_of_a_stranger_where_all_are_taken() -> None:
    hall = Hall(most=24)
    strangers = [hall.come("192.0.2.7") for _ in range(OF_ADDRESS)]
    for number in range(8):
        hall.come(f"198.51.100.{number}", pendant=False)
    hall.come("198.51.100.8", pendant=False)
    assert hall.gone == strangers[:1]


# Who logged in.


def test_promise_54_one_account_has_at_most_a_quarter_of_all_places() -> None:
    hall = Hall()
    for number in range(SHARE):
        assert hall.log_in(f"192.0.2.{number % 5}", "otto") is None
    full = hall.log_in("198.51.100.1", "otto")
    assert full is not None
    assert (full.code, full.value, full.limit) == (V.ACCOUNT_FULL, SHARE, SHARE)
    stranger = hall.places.find(hall.last)
    assert stranger is not None
    assert hall.places.standing(stranger) is ConnectionStanding.STRANGER
    assert hall.log_in("192.0.2.1", "vera") is None
    hall.leave(hall.here()[0])
    assert hall.log_in("198.51.100.2", "otto") is None


def test_promise_54_the_last_places_are_for_admins() -> None:
    hall = Hall()
    names = ("otto", "vera", "kim", "lee")
    for number in range(256 - KEPT):
        assert hall.log_in(f"192.0.2.{number % 200}", names[number % 4]) is None
    full = hall.log_in("192.0.2.1", "max")
    assert full is not None
    assert full.code is V.NO_PLACE
    assert "the last 8 are for admins" in full.text
    for _ in range(KEPT):
        assert hall.log_in("198.51.100.1", "ann", Role.ADMIN) is None
    assert len(hall.here()) == 256
    assert hall.decide("198.51.100.2") == PlaceGiven(but_stop=no_place_for_strangers())


def test_promise_54_an_admin_comes_in_where_logged_in_people_and_strangers_have_all_places() -> (
    None
):
    hall = Hall()
    for number in range(256 - KEPT):
        assert hall.log_in(f"192.0.2.{number % 200}", f"user {number % 4}") is None
    for _ in range(KEPT):
        hall.come("198.51.100.1")
    assert hall.log_in("203.0.113.1", "ann", Role.ADMIN) is None


def test_promise_54_guests_of_one_address_are_one_account_however_they_call_themselves() -> None:
    hall = Hall()
    for number in range(SHARE):
        assert hall.log_in("192.0.2.7", f"guest {number}", basis=Basis.PAIRING) is None
    full = hall.log_in("192.0.2.7", "another", basis=Basis.PAIRING)
    assert full is not None
    assert (full.code, full.value) == (V.ACCOUNT_FULL, SHARE)
    assert hall.log_in("192.0.2.8", "one more", basis=Basis.PAIRING) is None


def test_who_is_on_this_machine_logs_in_as_often_as_he_likes() -> None:
    hall = Hall()
    for _ in range(SHARE + 3):
        assert hall.log_in("127.0.0.1", "otto") is None
    assert hall.log_in("192.0.2.7", "otto") is None


def test_who_logs_in_anew_on_his_connection_is_not_counted_twice() -> None:
    hall = Hall(most=8)
    assert hall.log_in("192.0.2.7", "ann", Role.ADMIN) is None
    assert hall.log_in("192.0.2.7", "ann", Role.ADMIN) is None
    again = Granted(hall.last, Role.ADMIN, "ann", Basis.ACCOUNT)
    assert hall.places.login_refusal(hall.last, again) is None


def test_strangers_that_logged_out_beyond_their_places_become_fewer_again() -> None:
    hall = Hall()
    users = [hall.hello("192.0.2.7") for _ in range(10)]
    for session in users:
        hall.visitor(session).grant = Granted(session, Role.VIEWER, "vera", Basis.ACCOUNT)
    strangers = [hall.come("192.0.2.7") for _ in range(OF_ADDRESS)]
    for session in users:
        hall.visitor(session).grant = None
    assert len(hall.here()) == OF_ADDRESS + 10
    for number in range(1, 11):
        hall.come("192.0.2.7")
        assert len(hall.here()) == OF_ADDRESS + 10 - number
    assert hall.gone[:10] == users
    assert set(strangers) & set(hall.gone) == set(strangers[:10])


@given(st.lists(st.tuples(st.integers(0, 9), st.sampled_from(["come", "wait", "in", "go"]))))
def test_no_order_of_comers_breaks_the_bounds(steps: list[tuple[int, str]]) -> None:
    hall = Hall(most=40)
    for who, what in steps * 6:
        address = f"192.0.2.{who}"
        match what:
            case "come":
                hall.decide(address)
            case "wait" if not isinstance(hall.decide(address), Refusal):
                if not any(p.is_for_stop for p in hall.places if p.session == hall.last):
                    hall.visitors.add(Visitor(hall.last, address, "", "", checking=True), START)
            case "in" if isinstance(decided := hall.decide(address), PlaceGiven):
                if not decided.is_for_stop:
                    hall.visitors.add(Visitor(hall.last, address, "", ""), START)
                    granted = Granted(hall.last, Role.OPERATOR, f"user {who}", Basis.ACCOUNT)
                    if hall.places.login_refusal(hall.last, granted) is None:
                        hall.visitor(hall.last).grant = granted
            case "go" if hall.here():
                hall.leave(hall.here()[0])
        standing: list[ConnectionPlace] = [place for place in hall.places if not place.is_for_stop]
        assert len(standing) <= 40
        kinds = [hall.places.standing(place) for place in standing]
        assert kinds.count(ConnectionStanding.ACCOUNT) <= 40 - KEPT
        for number in range(10):
            strangers = [
                place
                for place in standing
                if place.address == f"192.0.2.{number}"
                and hall.places.standing(place) is ConnectionStanding.STRANGER
            ]
            assert len(strangers) <= OF_ADDRESS


# Bars.


def barred(hall: Hall, address: str, by: int, minutes: int = 60) -> tuple[int, ...] | Refusal:
    return hall.places.bar(address, START + minutes * 60 * SECOND, by, START)


def test_nobody_of_a_barred_address_does_more_than_stop_until_the_bar_ends() -> None:
    hall = Hall()
    ann = hall.hello("192.0.2.1")
    here = [hall.come("192.0.2.7"), hall.come("192.0.2.7")]
    assert barred(hall, "192.0.2.7", ann, minutes=1) == tuple(here)
    given = hall.decide("192.0.2.7", now=START + 1)
    assert isinstance(given, PlaceGiven)
    assert given.but_stop is not None
    assert (given.but_stop.code, given.but_stop.value) == (V.ADDRESS_BARRED, 60)
    told = hall.decide("192.0.2.7", now=START + 60 * SECOND - 1)
    assert isinstance(told, Refusal)
    assert (told.code, told.value) == (V.ADDRESS_BARRED, 1)
    assert hall.decide("192.0.2.8") == PlaceGiven()
    assert hall.decide("192.0.2.7", now=START + 60 * SECOND) == PlaceGiven()
    assert hall.places.bars(START + 60 * SECOND) == {}


def test_ros_industrial_of_a_barred_address_has_no_place_at_all() -> None:
    hall = Hall()
    barred(hall, "192.0.2.7", hall.hello("192.0.2.1"))
    told = hall.decide("192.0.2.7", pendant=False)
    assert isinstance(told, Refusal)
    assert told.code is V.ADDRESS_BARRED


def test_a_bar_of_ipv6_is_one_of_its_network_and_is_taken_back_as_it_is_shown() -> None:
    hall = Hall()
    ann = hall.hello("192.0.2.1")
    assert barred(hall, "2001:db8:0:7::5", ann) == ()
    given = hall.decide("2001:db8:0:7:8::1")
    assert isinstance(given, PlaceGiven)
    assert given.is_for_stop
    (shown,) = hall.places.bars(START)
    assert shown == "2001:db8:0:7::/64"
    assert hall.places.unbar(shown, START) is None
    assert hall.decide("2001:db8:0:7:8::1") == PlaceGiven()
    refused = hall.places.unbar(shown, START)
    assert refused is not None
    assert refused.code is V.BAD_ARGUMENT


@pytest.mark.parametrize(
    ("address", "code", "named"),
    [
        ("192.0.2.1", V.BAR_REFUSED, "you come from 192.0.2.1 yourself"),
        ("127.0.0.1", V.BAR_REFUSED, "this machine's own"),
        ("127.8.9.1", V.BAR_REFUSED, "this machine's own"),
        ("::1", V.BAR_REFUSED, "this machine's own"),
        ("::ffff:127.0.0.1", V.BAR_REFUSED, "this machine's own"),
        ("0.0.0.0", V.BAR_REFUSED, "this machine's own"),
        ("192.0.2.3", V.BAR_REFUSED, "amy, who is admin, is logged in from 192.0.2.3"),
        ("robot-lab", V.BAD_ARGUMENT, "is no address"),
        ("", V.BAD_ARGUMENT, "is no address"),
        ("192.0.2.0/24", V.BAD_ARGUMENT, "is no address"),
    ],
)
def test_some_addresses_are_not_barred(address: str, code: V, named: str) -> None:
    hall = Hall()
    assert hall.log_in("192.0.2.1", "ann", Role.ADMIN) is None
    ann = hall.last
    assert hall.log_in("192.0.2.3", "amy", Role.ADMIN) is None
    told = barred(hall, address, ann)
    assert isinstance(told, Refusal)
    assert told.code is code
    assert named in told.text
    assert hall.places.bars(START) == {}
    assert isinstance(hall.decide("192.0.2.3"), PlaceGiven)


def test_bars_are_bounded() -> None:
    hall = Hall()
    ann = hall.hello("192.0.2.1")
    for number in range(MOST_BARS):
        assert barred(hall, f"10.0.{number // 256}.{number % 256}", ann) == ()
    told = barred(hall, "10.9.9.9", ann)
    assert isinstance(told, Refusal)
    assert told.code is V.BAR_REFUSED
    assert barred(hall, "10.0.0.0", ann) == ()  # one that is barred may be barred for longer
