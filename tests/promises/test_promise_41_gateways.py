"""Promise 41: through a gateway a person may do what he may from his own address, and no more.

The rows of the table in `docs/access.md`, each with and without accounts; forged words; and
whatever bytes come before a hello.
"""

import json
import string
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.cells.byte_rig import ByteClient
from rigs.cells.gateway_rig import (
    ALONE,
    FORWARDED,
    GATEWAYS,
    SECRET,
    SHARED,
    GatewayRig,
    forwarded,
    is_taken,
)
from rigs.cells.rights import LOGIN_FOR_ALL, LOOKS_ON, ONLY_STOP, SINGLE_USER, Rights
from rigs.peers.server_clients import hello

from openpendant.server.access.audit import AuditEvent
from openpendant.server.access.gateways import Gateways, Origin
from openpendant.simplemsg import HeaderOnly, Opaque, Ping
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    Forwarded,
    HelloReply,
    Lobby,
    LobbyReply,
    Management,
    ResetStop,
    SoftwareStop,
    State,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

LAN, LAN_6 = "192.0.2.7", "2001:db8:0:7::1"
FORGED, FORGED_FEW = figure(41, "forged").count, figure(41, "forged_few").count
FIRST_FRAME = figure(41, "first_frame").seconds

Reach = Callable[[GatewayRig], ByteClient]
"""Has a connection come, and returns it when it may say hello."""


def directly(address: str) -> Reach:
    return lambda rig: rig.come(address)


def through(address: str) -> Reach:
    return lambda rig: rig.through(address)


def rights(rig: GatewayRig, client: ByteClient) -> Rights:
    """Say hello and try everything."""
    client.heard()
    client.tell(Lobby(1))
    (lobby,) = client.heard()
    shows = "holder" in json.loads(lobby.body)["cells"][0]
    client.tell(hello("somebody", 100.0))
    assert isinstance(client.heard()[0], HelloReply)
    rig.now += 20_000_000
    rig.tick()
    sends_state = any(isinstance(each, State) for each in client.heard())
    numbers = count(2)

    def code(make: Callable[[int], Authority | SoftwareStop | ResetStop]) -> V:
        client.tell(make(next(numbers)))
        return V(next(each.code for each in client.heard() if isinstance(each, Verdict)))

    def asked(op: str) -> dict[str, Any]:
        client.tell(Management(next(numbers), json.dumps({"op": op}).encode()))
        body: dict[str, Any] = json.loads(client.heard()[-1].body)
        return body

    observed = asked("snapshot").get("code", V.ACCEPTED)
    return Rights(
        str(asked("access.whoami")["basis"]),
        shows,
        V(observed),
        sends_state,
        code(lambda number: Authority(number, AuthorityAction.REQUEST)),
        code(lambda number: SoftwareStop(number, "enough")),
        code(ResetStop),
        rig.log_in(client, "ann"),
    )


MATRIX: dict[str, tuple[Reach, Rights, Rights]] = {
    "this machine, another program": (directly(SHARED), SINGLE_USER, LOOKS_ON),
    "the gateway, for this machine": (through("127.0.0.1"), SINGLE_USER, LOOKS_ON),
    "the gateway, for this machine by IPv6": (through("::1"), SINGLE_USER, LOOKS_ON),
    "the gateway, for this machine as IPv6": (through("::ffff:127.0.0.1"), SINGLE_USER, LOOKS_ON),
    "the gateway, for another machine": (through(LAN), ONLY_STOP, LOGIN_FOR_ALL),
    "the gateway, for one of IPv6": (through(LAN_6), ONLY_STOP, LOGIN_FOR_ALL),
    "another machine, no gateway": (directly(LAN), ONLY_STOP, LOGIN_FOR_ALL),
}
each_row = pytest.mark.parametrize("row", MATRIX)
accounts = pytest.mark.parametrize("has_accounts", [False, True], ids=["no accounts", "accounts"])


@accounts
@each_row
async def test_promise_41_each_row_of_the_matrix(row: str, has_accounts: bool) -> None:
    reach, without, with_accounts = MATRIX[row]
    rig = GatewayRig(has_accounts=has_accounts)
    assert rights(rig, reach(rig)) == (with_accounts if has_accounts else without)


@accounts
@pytest.mark.parametrize("address", [LAN, LAN_6, "127.0.0.1", "::1", "127.8.9.10"])
async def test_promise_41_through_a_gateway_is_as_without_one(
    address: str, has_accounts: bool
) -> None:
    found = []
    for reach in (through(address), directly(address)):
        rig = GatewayRig(has_accounts=has_accounts)
        found.append(rights(rig, reach(rig)))
    assert found[0] == found[1]


@accounts
async def test_promise_41_who_comes_from_where_only_a_gateway_does_has_to_say_for_whom(
    has_accounts: bool,
) -> None:
    rig = GatewayRig(has_accounts=has_accounts)
    client = rig.come(ALONE)
    client.tell(hello("somebody"))
    (told,) = client.heard()
    assert isinstance(told, Verdict)
    assert told.code == V.FORWARD_FIRST
    assert client.transport.is_over


@accounts
@pytest.mark.parametrize("address", [SHARED, ALONE, LAN])
async def test_promise_41_who_claims_an_address_without_name_or_secret_is_closed(
    address: str, has_accounts: bool
) -> None:
    for stated in (
        replace(forwarded("127.0.0.1"), secret=""),
        replace(forwarded("127.0.0.1"), gateway=""),
        replace(forwarded("127.0.0.1"), gateway="own"),
    ):
        rig = GatewayRig(has_accounts=has_accounts)
        client = rig.come(address)
        client.tell(stated)
        assert not is_taken(client)
        assert client.transport.is_over


# Forged ones.

_NAMES = st.one_of(st.sampled_from(["", "web", "own", "WEB", "web "]), st.text(max_size=8))
_NEAR = st.builds(
    lambda at, other: SECRET[:at] + other + SECRET[at + 1 :],
    st.integers(0, 63),
    st.sampled_from(string.hexdigits),
)
_SECRETS = st.one_of(
    st.sampled_from(["", SECRET[:-1], SECRET[1:], SECRET[::-1], SECRET.upper(), SECRET, "0" * 64]),
    _NEAR,
    st.text(max_size=16),
)
_ADDRESSES = st.one_of(
    st.sampled_from(
        ["127.0.0.1", "::1", LAN, LAN_6, "localhost", "0.0.0.0", "fe80::1%1", "1.2.3.4:5", ""]
    ),
    st.ip_addresses().map(str),
    st.text(max_size=20),
)
_PEERS = st.sampled_from([SHARED, ALONE, LAN, "::1", "::ffff:127.0.0.1", "127.0.0.3", LAN_6])


def is_true(stated: Forwarded, peer: str) -> bool:
    """Judge as somebody who reads what the configuration says."""
    at = {"web": (SHARED, "::ffff:127.0.0.1"), "own": (ALONE,)}.get(stated.gateway, ())
    secret = {"web": SECRET, "own": SECRET[::-1]}.get(stated.gateway)
    return peer in at and stated.secret.lower() == secret


def judge_forged(stated: Forwarded, peer: str) -> None:
    known = Gateways(GATEWAYS, lambda entry: None)
    if isinstance(known.origin(peer, stated, 1), Origin):
        assert is_true(stated, peer)
        assert known.refused == 0
    else:
        assert known.refused == 1


_STATED = st.builds(Forwarded, _NAMES, _SECRETS, _ADDRESSES, st.integers(-1, 3))


@settings(max_examples=FORGED_FEW, deadline=None)
@given(stated=_STATED, peer=_PEERS)
def test_promise_41_no_forged_word_is_believed(stated: Forwarded, peer: str) -> None:
    judge_forged(stated, peer)


@pytest.mark.soak
@settings(max_examples=FORGED, deadline=None)
@given(stated=_STATED, peer=_PEERS)
def test_promise_41_no_forged_word_of_ten_thousand_is_believed(
    stated: Forwarded, peer: str
) -> None:
    judge_forged(stated, peer)


# Whatever comes before a hello.

_FRAMES = st.one_of(
    st.sampled_from(
        [
            forwarded(LAN),
            forwarded("127.0.0.1"),
            replace(forwarded(LAN), secret=""),
            Forwarded("own", SECRET[::-1], LAN, 0),
            Lobby(1),
            Ping(),
            SoftwareStop(2, "enough"),
            hello("somebody"),
            Opaque(FORWARDED, b"short", comm_type=2),
            Opaque(FORWARDED, b"", comm_type=1),
            Opaque(Lobby.PLACE.msg_type, b"", comm_type=2),
            Opaque(Lobby.PLACE.msg_type, b"\xff" * 80, comm_type=2),
            Opaque(65_070, b"join", comm_type=2),
        ]
    ),
    _STATED.filter(lambda each: "\0" not in each.gateway + each.secret + each.address),
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    peer=st.sampled_from([SHARED, ALONE, LAN]),
    said=st.lists(_FRAMES, max_size=5),
    rubbish=st.binary(max_size=40),
    cuts=st.lists(st.integers(1, 400), max_size=4),
    has_accounts=st.booleans(),
)
async def test_promise_41_whatever_comes_before_hello_is_answered_or_closed_in_time(
    peer: str,
    said: list[Forwarded],
    rubbish: bytes,
    cuts: list[int],
    has_accounts: bool,
) -> None:
    rig = GatewayRig(has_accounts=has_accounts)
    client = rig.come(peer)
    data = b"".join(map(client.frames, said)) + rubbish
    for at, end in zip([0, *sorted(cuts)], [*sorted(cuts), len(data)], strict=True):
        if not client.transport.is_over:
            client.say(data[at:end])
            await client.until_handled()
    rig.settle()
    told = client.heard()
    # At most one is believed, and nobody else's address is counted than the one it stated.
    taken = [each for each in told if isinstance(each, HeaderOnly) and each.reply_code == 1]
    assert len(taken) <= 1
    if taken:
        assert isinstance(said[0], Forwarded)
        assert is_true(said[0], peer)
    refused = [each for each in told if isinstance(each, HeaderOnly) and each.reply_code == 2]
    if any(each.msg_type == FORWARDED for each in refused):
        assert client.transport.is_over, "a word that is not believed, and still there"
    if not any(isinstance(each, HelloReply | LobbyReply) for each in told):
        for _ in range(9):  # as long for a first frame, as long for the hello behind it
            rig.check_deadlines(FIRST_FRAME / 4)
            rig.perform(rig.core.pendants.tick(rig.now))
        assert client.transport.is_over, "neither hello nor lobby, and still there"
    assert not [each for each in rig.desk.log if each.event is AuditEvent.LOGIN]
