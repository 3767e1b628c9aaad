"""Connections from a gateway's address (promise 41): whose they are, and what they count for."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from promises.promise_table import figure
from rigs.cells.byte_rig import ByteClient
from rigs.cells.gateway_rig import ALONE, FAR, FORWARDED, SHARED, GatewayRig, forwarded, is_taken
from rigs.peers.server_clients import hello

from openpendant.server.access.audit import AuditEvent
from openpendant.server.access.passwords import Secret
from openpendant.server.access.places import STRANGERS_OF_ADDRESS
from openpendant.server.events.events import Port
from openpendant.server.refusal import Refusal
from openpendant.server.shell.first_frames import MOST_AWAITED
from openpendant.simplemsg import HeaderOnly, Message, Opaque, Ping, ReplyCode
from openpendant.simplemsg.pendant import (
    Forwarded,
    HelloReply,
    Lobby,
    Login,
    LoginKind,
    Management,
    SoftwareStop,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

LAN, LAN_6 = "192.0.2.7", "2001:db8::1"
FIRST_FRAME = figure(41, "first_frame").seconds
FORGED = replace(forwarded(LAN), secret="a guess")


def codes(client: ByteClient) -> list[V]:
    return [V(each.code) for each in client.heard() if isinstance(each, Verdict)]


def notes(rig: GatewayRig, event: AuditEvent) -> list[dict[str, Any]]:
    return [{**each.detail, "source": each.source} for each in rig.desk.log if each.event is event]


# Until the first frame.


@pytest.mark.parametrize("address", [SHARED, ALONE, FAR])
async def test_a_silent_connection_of_a_gateway_s_address_has_no_place(address: str) -> None:
    rig = GatewayRig()
    client = rig.come(address)
    assert rig.counted == []
    open_until = []
    for seconds in (FIRST_FRAME - 0.01, 0.01):
        rig.check_deadlines(seconds)
        open_until.append(not client.transport.is_over)
    assert open_until == [True, False]
    rig.settle()
    assert rig.clients.by_session == {}


async def test_half_a_first_frame_does_not_keep_a_connection() -> None:
    rig = GatewayRig()
    client = rig.come(SHARED)
    rig.check_deadlines(1.5)
    client.say(client.frames(forwarded(LAN))[:100])
    rig.check_deadlines(0.5)
    assert client.transport.is_over


async def test_the_deadline_of_a_hello_bounds_that_of_a_first_frame() -> None:
    rig = GatewayRig()
    awaiting = rig.clients.first_frames
    awaiting._most_ns = min(500_000_000, awaiting._most_ns)
    client = rig.come(SHARED)
    rig.check_deadlines(0.5)
    assert client.transport.is_over


async def test_of_too_many_silent_ones_the_longest_goes() -> None:
    rig = GatewayRig()
    silent = [rig.come(SHARED) for _ in range(MOST_AWAITED + 2)]
    assert [each.transport.is_over for each in silent] == [True] * 2 + [False] * MOST_AWAITED
    silent[-1].tell(forwarded(LAN))
    assert is_taken(silent[-1])


async def test_a_connection_that_ends_before_its_first_frame_is_forgotten() -> None:
    rig = GatewayRig()
    rig.come(SHARED).shell.connection_lost(None)
    assert not rig.clients.first_frames._awaited


async def test_the_silent_ones_are_closed_with_the_server() -> None:
    rig = GatewayRig()
    client = rig.come(SHARED)
    rig.clients.hang_up("the server is going down")
    assert client.transport.is_over


async def test_ros_industrial_has_no_first_frame() -> None:
    rig = GatewayRig(ros_state_port=11_002)
    rig.come(SHARED, Port.ROS_STATE)
    assert rig.counted == [SHARED]


# The first frame.


async def test_after_it_a_connection_is_one_of_the_address_that_was_stated() -> None:
    rig = GatewayRig()
    client = rig.through(LAN)
    assert rig.counted == [LAN]
    assert client.shell.address == LAN
    client.tell(hello("a browser"))
    assert isinstance(client.heard()[0], HelloReply)


async def test_hello_may_follow_in_the_same_packet() -> None:
    rig = GatewayRig()
    client = rig.come(SHARED)
    client.tell(forwarded(LAN), hello("a browser"))
    await client.until_handled()
    told = client.heard()
    assert [type(each) for each in told] == [HeaderOnly, HelloReply]


async def test_a_stop_in_the_same_packet_acts() -> None:
    rig = GatewayRig()
    client = rig.come(SHARED)
    client.tell(forwarded(LAN), hello("a browser"), SoftwareStop(1, "stop"))
    await client.until_handled()
    assert rig.core.cell.stop is not None
    assert codes(client) == [V.ACCEPTED]


@pytest.mark.parametrize("first", [hello("mine"), Ping(), SoftwareStop(1, ""), Opaque(9, b"x")])
async def test_another_program_of_this_machine_is_served_as_ever(first: Message) -> None:
    rig, other = GatewayRig(), GatewayRig()
    other.desk.login.gateways._gateways = ()
    asked, plain = rig.come(SHARED), other.come(SHARED)
    for client in (asked, plain):
        client.tell(first)
    assert asked.heard() == plain.heard()
    assert rig.counted == [SHARED]


@pytest.mark.parametrize(
    "first",
    [
        hello("mine"),
        Lobby(3),
        SoftwareStop(4, ""),
        Login(5, LoginKind.PASSWORD, "ann", "ann's password"),
        Opaque(9, b"x"),
    ],
    ids=lambda each: type(each).__name__,
)
async def test_where_only_a_gateway_comes_from_it_has_to_say_for_whom(first: Message) -> None:
    rig = GatewayRig()
    client = rig.come(ALONE)
    client.tell(first)
    (told,) = client.heard()
    assert isinstance(told, Verdict)
    assert (told.code, told.request_id) == (V.FORWARD_FIRST, getattr(first, "request_id", 0))
    assert client.transport.is_over
    assert rig.counted == []
    assert rig.core.cell.stop is None


async def test_a_hello_of_version_2_is_refused_there_by_a_code_that_it_knows() -> None:
    rig = GatewayRig()
    client = rig.come(ALONE)
    client.tell(hello("mine", version=2))
    (told,) = client.heard()
    assert isinstance(told, Verdict)
    assert told.code == V.BAD_ARGUMENT
    assert "for whom it speaks" in told.text


@pytest.mark.parametrize("first", [Ping(comm_type=1), Forwarded("own", "", LAN, 1)])
async def test_nor_is_anything_else_a_word_for_somebody(first: Message) -> None:
    rig = GatewayRig()
    client = rig.come(ALONE)
    client.tell(first)
    assert client.transport.is_over
    assert rig.counted == []


# What is refused.


def late(client: ByteClient) -> None:
    client.tell(Ping(), forwarded(LAN))


def twice(client: ByteClient) -> None:
    client.tell(forwarded(LAN), forwarded(LAN))


def after_hello(client: ByteClient) -> None:
    client.tell(hello("a browser"), forwarded(LAN))


def after_both(client: ByteClient) -> None:
    client.tell(forwarded(LAN), hello("a browser"), forwarded(LAN))


def forged(client: ByteClient) -> None:
    client.tell(FORGED)


def of_another_size(client: ByteClient) -> None:
    client.tell(Opaque(FORWARDED, b"web", comm_type=2))


def in_front_of_a_stop(client: ByteClient) -> None:
    client.tell(FORGED, SoftwareStop(1, ""))


def late_of_another_size(client: ByteClient) -> None:
    client.tell(Ping(), Opaque(FORWARDED, b"web", comm_type=2))


Say = Callable[[ByteClient], None]


@pytest.mark.parametrize(
    "say",
    [
        *(late, twice, after_hello, after_both, forged, of_another_size, in_front_of_a_stop),
        late_of_another_size,
    ],
)
@pytest.mark.parametrize("address", [SHARED, LAN])
async def test_whatever_is_not_the_very_first_word_of_a_gateway_is_refused_bare_and_closed(
    address: str, say: Say
) -> None:
    rig = GatewayRig()
    client = rig.come(address)
    say(client)
    await client.until_handled()
    refused = [each for each in client.heard() if isinstance(each, HeaderOnly)]
    assert (refused[-1].msg_type, refused[-1].reply_code) == (FORWARDED, ReplyCode.FAILURE)
    assert client.transport.is_over
    (noted,) = notes(rig, AuditEvent.FORWARD_REFUSED)
    assert (noted["source"], noted["refused"]) == (address, 1)
    assert rig.desk.login.gateways.refused == 1
    assert rig.core.cell.stop is None


async def test_what_follows_a_refused_one_is_not_taken() -> None:
    rig = GatewayRig()
    client = rig.come(SHARED)
    client.tell(FORGED, hello("a browser"))
    await client.until_handled()
    assert [type(each) for each in client.heard()] == [HeaderOnly]
    assert len(rig.desk.login.visitors) == 0


async def test_a_forged_one_locks_nobody_out() -> None:
    rig = GatewayRig()
    for _ in range(100):
        rig.come(SHARED).tell(FORGED)
    rig.settle()
    client = rig.through(LAN)
    client.tell(hello("a browser"))
    assert rig.log_in(client, "ann") is V.ACCEPTED
    (noted,) = notes(rig, AuditEvent.FORWARD_REFUSED)
    assert noted["refused"] == 1


# Every rule goes by the address that was stated.


async def test_places_are_those_of_the_stated_address() -> None:
    rig = GatewayRig()
    crowd = [rig.through(LAN) for _ in range(STRANGERS_OF_ADDRESS)]
    other = rig.through("192.0.2.8")
    rig.come(LAN)
    assert crowd[0].transport.is_over
    assert not any(each.transport.is_over for each in (*crowd[1:], other))


async def test_an_ipv6_network_is_one_stated_address() -> None:
    rig = GatewayRig()
    first = [rig.through(f"2001:db8:0:7::{number}") for number in range(1, 17)]
    rig.through("2001:db8:0:7:8000::1")
    assert first[0].transport.is_over


async def test_the_rate_is_that_of_the_stated_address() -> None:
    rig = GatewayRig()
    ended = 0
    for _ in range(40):
        client = rig.come(SHARED)
        client.tell(forwarded(LAN))
        if not client.heard():
            assert client.transport.is_over
            ended += 1
        rig.settle()
    assert ended == 20
    rig.through("192.0.2.8")
    rig.now += 1_000_000_000
    rig.through(LAN)


@pytest.mark.parametrize("address", [LAN, SHARED])
async def test_without_accounts_and_for_this_machine_there_is_no_rate(address: str) -> None:
    rig = GatewayRig(has_accounts=address == SHARED)
    for _ in range(40):
        rig.through(address)


async def test_five_wrong_passwords_lock_the_account_at_the_stated_address_alone() -> None:
    rig = GatewayRig()
    guesser, other = rig.through(LAN), rig.through("192.0.2.8")
    for client in (guesser, other):
        client.tell(hello("a browser"))
        client.heard()
    for number in range(6):
        guesser.tell(Login(number, LoginKind.PASSWORD, "ann", "a guess"))
    assert codes(guesser) == [V.LOGIN_FAILED] * 5 + [V.LOCKED_OUT]
    assert rig.log_in(other, "ann") is V.ACCEPTED
    direct = rig.come(LAN)
    direct.tell(hello("a pendant"))
    direct.heard()
    direct.tell(Login(9, LoginKind.PASSWORD, "ann", "ann's password"))
    assert codes(direct) == [V.LOCKED_OUT]


async def test_a_barred_address_is_barred_behind_a_gateway_too_and_may_stop() -> None:
    rig = GatewayRig()
    before = rig.through(LAN)
    assert rig.desk.login.places.bar(LAN, rig.now + 60_000_000_000, 0, rig.now) == (before.session,)
    client = rig.through(LAN)
    client.tell(hello("a browser"), SoftwareStop(1, "stop"))
    await client.until_handled()
    assert rig.core.cell.stop is not None
    other = rig.through("192.0.2.8")
    other.tell(hello("a browser"))
    assert rig.log_in(other, "ann") is V.ACCEPTED


async def test_a_gateway_s_own_address_is_not_barred() -> None:
    told = GatewayRig().desk.login.places.bar(FAR, 10**18, 0, 0)
    assert isinstance(told, Refusal)
    assert told.code == V.BAR_REFUSED
    assert "bar the addresses that it states" in told.sentence


async def test_the_audit_log_says_through_which_gateway_somebody_came() -> None:
    rig = GatewayRig()
    client = rig.through(LAN)
    client.tell(hello("a browser"))
    assert rig.log_in(client, "ann") is V.ACCEPTED
    direct = rig.come("192.0.2.9")
    direct.tell(hello("a pendant"))
    assert rig.log_in(direct, "ann") is V.ACCEPTED
    connected = notes(rig, AuditEvent.CONNECTED)
    assert connected == [
        {"client": "a browser", "via": "web", "encrypted": True, "source": LAN},
        {"client": "a pendant", "source": "192.0.2.9"},
    ]
    logins = notes(rig, AuditEvent.LOGIN)
    assert [each.get("via") for each in logins] == ["web", None]


async def test_an_admin_is_shown_the_stated_address() -> None:
    rig = GatewayRig()
    ann, silent = rig.through("192.0.2.1"), rig.through(LAN_6)
    ann.tell(hello("a browser"))
    assert rig.log_in(ann, "ann") is V.ACCEPTED
    for op, part in (("access.connections", "connections"), ("access.sessions", "sessions")):
        ann.tell(Management(77, json.dumps({"op": op}).encode()))
        (told,) = ann.heard()
        found = {each["session"]: each["address"] for each in json.loads(told.body)[part]}
        seen = {ann.session: "192.0.2.1"}
        assert found == (seen if part == "sessions" else {**seen, silent.session: LAN_6})


async def test_a_password_waits_in_the_queue_of_the_stated_address() -> None:
    rig = GatewayRig()
    client = rig.through(LAN)
    client.tell(hello("a browser"))
    job = rig.desk.login.try_password(client.session, "ann", Secret("a password"), rig.now)
    assert getattr(job, "source", None) == LAN
