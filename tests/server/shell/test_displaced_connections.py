"""Promise 54 on connections: who gives up his place is told and closed; a stop finds one."""

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import expect
from rigs.cells.guarded_bytes import GuardedBytes
from rigs.peers.server_clients import hello

from openpendant.server.events.events import Port
from openpendant.simplemsg import Ping
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    AuthorityBeat,
    HelloReply,
    Login,
    LoginKind,
    Management,
    Outcome,
    SoftwareStop,
    State,
    StopChanged,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

OF_ADDRESS = figure(54, "of_address").count
STOP_TIME = figure(54, "stop_time").seconds
CROWDED = "192.0.2.7"


def crowd(rig: GuardedBytes) -> GuardedBytes:
    """Have the logins of all strangers of an address wait."""
    for number in range(OF_ADDRESS):
        client = rig.come(CROWDED)
        client.tell(hello("pupil"), Login(1, LoginKind.PASSWORD, f"pupil {number}", "wrong"))
        assert not [each for each in client.heard() if isinstance(each, Verdict)]
    return rig


def crowded() -> GuardedBytes:
    return crowd(GuardedBytes(checks_at_once=False))


async def test_promise_54_who_gives_up_his_place_is_told_so_and_closed_at_once() -> None:
    rig = GuardedBytes()
    silent = rig.come(CROWDED)
    greeted = rig.come(CROWDED)
    greeted.tell(hello("a stranger"))
    greeted.heard()
    for _ in range(OF_ADDRESS - 2):
        rig.come(CROWDED)
    elsewhere = rig.come("192.0.2.8")
    rig.come(CROWDED)
    assert silent.transport.is_over
    assert not silent.heard()
    rig.come(CROWDED)
    assert greeted.transport.is_over
    (told,) = greeted.heard()
    assert (expect(Outcome, told).request_id, told.code) == (0, V.NO_PLACE)
    assert not elsewhere.transport.is_over
    rig.settle()
    assert len(rig.clients.by_session) == OF_ADDRESS + 1
    assert len(list(rig.desk.login.places)) == OF_ADDRESS + 1


async def test_promise_54_who_logged_in_stays_whoever_comes_of_his_address() -> None:
    rig = GuardedBytes()
    teacher = rig.come(CROWDED)
    teacher.tell(hello("teacher"))
    assert rig.log_in(teacher, "ann") is V.ACCEPTED
    for _ in range(3 * OF_ADDRESS):
        rig.come(CROWDED)
        rig.settle()
    assert not teacher.transport.is_over
    assert len(rig.clients.by_session) == OF_ADDRESS + 1


async def test_a_failed_login_is_remembered_as_long_as_its_connection_lasts() -> None:
    rig = GuardedBytes()
    client = rig.come(CROWDED)
    client.tell(hello("guesser"), Login(1, LoginKind.PASSWORD, "otto", "wrong"))
    assert [each.code for each in client.heard() if isinstance(each, Verdict)] == [V.LOGIN_FAILED]
    visitor = rig.desk.login.visitors.find(client.session)
    assert visitor is not None
    assert visitor.has_failed
    client.tell(Login(2, LoginKind.PAIRING, "kim", "ABC234"))
    assert [each.code for each in client.heard() if isinstance(each, Verdict)] == [V.PAIRING_WRONG]


# The place of an address for a stop.


@pytest.mark.parametrize("together", [True, False])
async def test_promise_54_where_there_is_no_place_a_stop_is_latched_and_answered(
    together: bool,
) -> None:
    rig = crowded()
    client = rig.come(CROWDED)
    said = [hello("a stranger", 25.0), SoftwareStop(7, "somebody is in there")]
    for each in [client.frames(*said)] if together else [client.frames(one) for one in said]:
        client.say(each)
    stop = rig.core.cell.stop
    assert stop is not None
    assert stop.reason == "somebody is in there"
    greeted, *told = client.heard()
    expect(HelloReply, greeted)
    (verdict,) = [each for each in told if isinstance(each, Verdict)]
    assert (verdict.request_id, verdict.code) == (7, V.ACCEPTED)
    assert client.transport.is_over
    rig.settle()
    # The place is free for the next one of that address.
    again = rig.come(CROWDED)
    again.tell(hello("another"))
    expect(HelloReply, again.heard()[0])


@pytest.mark.parametrize(
    "asked",
    [
        Login(9, LoginKind.PASSWORD, "ann", "ann's password"),
        Subscribe(9, 25.0),
        Authority(9, AuthorityAction.REQUEST),
        Management(9, b'{"op":"access.whoami"}'),
        Management(9, b'{"op":"access.logout"}'),
    ],
    ids=lambda each: type(each).__name__,
)
async def test_promise_54_nothing_but_a_stop_is_taken_on_such_a_place(asked: object) -> None:
    rig = crowded()
    checks = len(rig.desk.log)
    client = rig.come(CROWDED)
    client.tell(hello("a stranger"))
    client.heard()
    client.tell(asked)  # type: ignore[arg-type]  # one of the messages above
    (told,) = client.heard()
    assert (expect(Verdict, told).request_id, told.code, told.value) == (9, V.NO_PLACE, 2.0)
    assert client.transport.is_over
    assert [entry.event for entry in rig.desk.log[checks:]] == ["connected"]


async def test_whoever_is_barred_may_stop_and_hears_of_the_bar_when_asking_more() -> None:
    rig = GuardedBytes()
    teacher = rig.come("192.0.2.1")
    teacher.tell(hello("teacher"))
    until = rig.now + 60 * 1_000_000_000
    assert rig.desk.login.places.bar(CROWDED, until, teacher.session, rig.now) == ()
    asking = rig.come(CROWDED)
    asking.tell(hello("barred"), Login(9, LoginKind.PASSWORD, "ann", "ann's password"))
    told = [each for each in asking.heard() if isinstance(each, Verdict)]
    assert [(each.request_id, each.code) for each in told] == [(9, V.ADDRESS_BARRED)]
    assert asking.transport.is_over
    rig.settle()
    stopping = rig.come(CROWDED)
    stopping.tell(hello("barred"), SoftwareStop(7, "somebody is in there"))
    assert rig.core.cell.stop is not None


async def test_a_topic_on_such_a_place_is_passed_over_and_a_stop_behind_it_acts() -> None:
    rig = crowded()
    client = rig.come(CROWDED)
    client.tell(hello("a stranger"), AuthorityBeat(), SoftwareStop(7, "stop"))
    assert rig.core.cell.stop is not None


async def test_a_stop_before_the_hello_is_none_and_the_next_one_acts() -> None:
    rig = crowded()
    client = rig.come(CROWDED)
    client.tell(SoftwareStop(6, "too early"))
    assert [expect(Verdict, each).code for each in client.heard()] == [V.HELLO_FIRST]
    assert rig.core.cell.stop is None
    client.tell(hello("a stranger"), SoftwareStop(7, "in time"))
    assert rig.core.cell.stop is not None


async def test_promise_54_who_neither_stops_nor_goes_is_cut_off_after_2_s() -> None:
    rig = crowded()
    connections = [rig.come(CROWDED), rig.come("192.0.2.8")]
    rig.check_deadlines(STOP_TIME - 0.001)
    assert [each.transport.is_over for each in connections] == [False, False]
    rig.check_deadlines(0.001)
    assert [each.transport.is_over for each in connections] == [True, False]


async def test_promise_54_no_state_is_sent_to_who_may_only_stop() -> None:
    rig = GuardedBytes(checks_at_once=False)
    rig.desk.login.visitors._observe_without_login = True
    crowd(rig)
    client = rig.come(CROWDED)
    client.tell(hello("a stranger", 25.0))
    rig.wait(500)
    assert not [each for each in client.heard() if isinstance(each, State)]


async def test_promise_54_the_second_of_an_address_without_a_place_is_told_when_to_come() -> None:
    rig = crowded()
    rig.come(CROWDED)
    late = rig.come(CROWDED)
    late.tell(hello("late"))
    (told,) = late.heard()
    assert (expect(Verdict, told).code, told.value) == (V.NO_PLACE, 2.0)
    assert late.transport.is_over


async def test_whoever_stops_is_told_to_others_as_a_stranger() -> None:
    rig = crowded()
    teacher = rig.come("192.0.2.8")
    rig.checks_at_once = True
    teacher.tell(hello("teacher"))
    assert rig.log_in(teacher, "ann") is V.ACCEPTED
    rig.come(CROWDED).tell(hello("somebody"), SoftwareStop(7, "stop"))
    (change,) = [each for each in teacher.heard() if isinstance(each, StopChanged)]
    assert "not logged in" in change.client


# Who finds no room as somebody who logged in.


async def test_promise_54_a_login_without_room_is_refused_and_the_connection_stays() -> None:
    rig = GuardedBytes(max_connections=24)
    for number in range(6):
        client = rig.come(f"192.0.2.{number}")
        client.tell(hello("otto's"))
        assert rig.log_in(client, "otto") is V.ACCEPTED
    late = rig.come("192.0.2.9")
    late.tell(hello("one more of otto's"))
    assert rig.log_in(late, "otto") is V.ACCOUNT_FULL
    assert not late.transport.is_over
    assert rig.desk.log[-1].event == "refused"
    assert rig.desk.log[-1].detail["account"] == "otto"
    late.tell(Authority(9, AuthorityAction.REQUEST))
    assert [expect(Verdict, each).code for each in late.heard()] == [V.LOGIN_NEEDED]
    late.tell(SoftwareStop(10, "stop"))
    assert rig.core.cell.stop is not None
    assert rig.log_in(late, "vera") is V.ACCEPTED


async def test_256_connections_of_one_operator_leave_three_quarters_to_others() -> None:
    rig = GuardedBytes()
    codes = []
    for number in range(256):
        client = rig.come(f"198.51.100.{number % 100}")
        rig.settle()
        client.tell(hello("a tool of otto's"))
        codes.append(rig.log_in(client, "otto"))
    assert codes == [V.ACCEPTED] * 64 + [V.ACCOUNT_FULL] * 192
    teacher = rig.come("192.0.2.1")
    teacher.tell(hello("teacher"))
    assert rig.log_in(teacher, "ann") is V.ACCEPTED


async def test_a_ros_client_keeps_its_place_and_a_stranger_gives_up_his() -> None:
    rig = GuardedBytes(max_connections=20, ros_state_port=11_002)
    ros = [rig.come("127.0.0.1", Port.ROS_STATE) for _ in range(4)]
    strangers = [rig.come(f"192.0.2.{number}") for number in range(16)]
    late = rig.come("127.0.0.1")
    assert [each.transport.is_over for each in strangers] == [True] + [False] * 15
    assert not any(each.transport.is_over for each in (*ros, late))
    late.tell(Ping())
