"""What an admin sees of all connections, and what he may do: close one, bar an address."""

import json
from typing import Any

import pytest
from rigs.cells.byte_rig import ByteClient
from rigs.cells.guarded_bytes import GuardedBytes
from rigs.peers.server_clients import hello

from openpendant.server.access.audit import AuditEvent
from openpendant.server.events.events import Port
from openpendant.simplemsg import Ping
from openpendant.simplemsg.pendant import Authority, AuthorityAction, Management, Subscribe, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

TEACHER = "192.0.2.1"


def ask(client: ByteClient, op: str, **fields: object) -> dict[str, Any]:
    client.heard()
    client.tell(Management(77, json.dumps({"op": op, **fields}).encode()))
    (told,) = [each for each in client.heard() if isinstance(each, Management)]
    answer: dict[str, Any] = json.loads(told.body)
    return answer


def user(rig: GuardedBytes, name: str, address: str = TEACHER) -> ByteClient:
    client = rig.come(address)
    client.tell(hello(f"{name}'s pendant"))
    assert rig.log_in(client, name) is V.ACCEPTED
    return client


def noted(rig: GuardedBytes, event: AuditEvent) -> list[dict[str, object]]:
    return [dict(entry.detail) for entry in rig.desk.log if entry.event is event]


async def test_an_admin_sees_each_connection_with_its_address_and_standing() -> None:
    rig = GuardedBytes(ros_state_port=11_002)
    ann = user(rig, "ann")
    rig.now += 3_000_000_000
    otto = user(rig, "otto", "192.0.2.2")
    silent = rig.come("2001:db8::1")
    ros = rig.come("127.0.0.1", Port.ROS_STATE)
    told = ask(ann, "access.connections")
    keys = ("session", "address", "standing", "client", "cell", "name", "role", "since")
    assert [tuple(each[key] for key in keys) for each in told["connections"]] == [
        (ann.session, TEACHER, "account", "ann's pendant", "cell", "ann", "admin", 3.0),
        (otto.session, "192.0.2.2", "account", "otto's pendant", "cell", "otto", "operator", 0.0),
        (silent.session, "2001:db8::1", "stranger", "", "", "", "", 0.0),
        (ros.session, "127.0.0.1", "ros-industrial", "", "", "", "", 0.0),
    ]
    assert (told["more"], told["barred"]) == (0, [])


async def test_rate_and_cost_are_those_of_the_last_second_that_was_counted() -> None:
    rig = GuardedBytes()
    ann, busy = user(rig, "ann"), rig.come("192.0.2.7")
    busy.tell(hello("busy"))
    rig.check_deadlines(1.0)
    size = len(busy.frames(Ping()))
    rig.each_look = 5_000
    for _ in range(40):
        busy.tell(Ping())
    rig.each_look = 0
    rig.check_deadlines(2.0)
    found = {each["session"]: each for each in ask(ann, "access.connections")["connections"]}
    assert (found[busy.session]["frames"], found[busy.session]["bytes"]) == (20, 20 * size)
    assert found[busy.session]["cost"] == pytest.approx(20 * 5e-6)
    assert (found[ann.session]["frames"], found[ann.session]["cost"]) == (0, 0)


async def test_many_connections_are_told_a_hundred_at_a_time() -> None:
    rig = GuardedBytes(max_connections=1024)
    ann = user(rig, "ann")
    for number in range(250):
        client = rig.come(f"10.0.{number % 200}.1")
        client.tell(hello("a pendant with a long name......"))
        assert rig.log_in(client, "otto") is V.ACCEPTED
    seen: list[int] = []
    left: list[int] = []
    while not left or left[-1]:
        told = ask(ann, "access.connections", after=seen[-1] if seen else 0)
        seen += [each["session"] for each in told["connections"]]
        left.append(told["more"])
    assert left == [151, 51, 0]
    assert seen == sorted(rig.clients.by_session)


@pytest.mark.parametrize("name", ["vera", "otto"])
@pytest.mark.parametrize(
    ("op", "fields"),
    [
        ("access.connections", {}),
        ("access.close", {"session": 1}),
        ("access.bar", {"address": "192.0.2.7"}),
        ("access.unbar", {"address": "192.0.2.7"}),
    ],
)
async def test_nobody_but_an_admin_may(name: str, op: str, fields: dict[str, object]) -> None:
    rig = GuardedBytes()
    rig.come("192.0.2.9")
    assert ask(user(rig, name), op, **fields)["code"] == V.ROLE_TOO_LOW
    assert not any(each.transport.is_over for each in rig.connected)
    assert rig.desk.login.places.bars(rig.now) == {}


async def test_a_connection_is_closed_at_once_and_what_it_holds_is_free() -> None:
    rig = GuardedBytes()
    ann, otto = user(rig, "ann"), user(rig, "otto", "192.0.2.2")
    otto.tell(Authority(9, AuthorityAction.REQUEST))
    assert rig.core.cell.authority.is_held_by(otto.session)
    assert ask(ann, "access.close", session=otto.session) == {}
    assert otto.transport.is_over
    rig.settle()
    assert not rig.core.cell.authority.is_held_by(otto.session)
    assert noted(rig, AuditEvent.CONNECTION_CLOSED) == [
        {"closed": otto.session, "address": "192.0.2.2", "account": "otto"}
    ]
    assert ask(ann, "access.close", session=otto.session)["code"] == V.UNKNOWN_CONNECTION
    assert ask(ann, "access.close", session=999)["code"] == V.UNKNOWN_CONNECTION


async def test_one_s_own_connection_is_not_closed_so() -> None:
    rig = GuardedBytes()
    ann = user(rig, "ann")
    assert ask(ann, "access.close", session=ann.session)["code"] == V.BAD_ARGUMENT
    assert not ann.transport.is_over


async def test_a_barred_address_is_cut_off_and_told_how_long() -> None:
    rig = GuardedBytes()
    ann, elsewhere = user(rig, "ann"), user(rig, "otto", "192.0.2.2")
    bad = [user(rig, "otto", "192.0.2.7"), rig.come("192.0.2.7")]
    told = ask(ann, "access.bar", address="192.0.2.7", minutes=30)
    assert told == {"closed": 2}
    assert all(each.transport.is_over for each in bad)
    assert not elsewhere.transport.is_over
    rig.settle()
    late = rig.come("192.0.2.7")
    late.tell(hello("again"), Subscribe(1, 25.0))
    *_, said = late.heard()
    assert isinstance(said, Verdict)
    assert (said.code, said.value) == (V.ADDRESS_BARRED, 1_800.0)
    rig.now += 60_000_000_000
    (bar,) = ask(ann, "access.connections")["barred"]
    assert bar == {"address": "192.0.2.7", "remaining": 1_740.0}
    assert ask(ann, "access.unbar", address="192.0.2.7") == {}
    assert not rig.come("192.0.2.7").transport.is_over
    assert noted(rig, AuditEvent.ADDRESS_BARRED) == [
        {"address": "192.0.2.7", "minutes": 30, "closed": 2}
    ]
    assert noted(rig, AuditEvent.ADDRESS_UNBARRED) == [{"address": "192.0.2.7"}]


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"address": TEACHER}, V.BAR_REFUSED),
        ({"address": "127.0.0.1"}, V.BAR_REFUSED),
        ({"address": "192.0.2.3"}, V.BAR_REFUSED),
        ({"address": "here"}, V.BAD_ARGUMENT),
        ({"address": "192.0.2.7", "minutes": 0}, V.BAD_ARGUMENT),
        ({"address": "192.0.2.7", "minutes": 1441}, V.BAD_ARGUMENT),
        ({"address": "192.0.2.7", "minutes": 0.5}, V.BAD_ARGUMENT),
        ({}, V.BAD_ARGUMENT),
    ],
    ids=str,
)
async def test_a_bar_against_oneself_the_machine_or_an_admin_is_refused_and_all_go_on(
    fields: dict[str, object], code: V
) -> None:
    rig = GuardedBytes()
    ann, also = user(rig, "ann"), user(rig, "ann", "192.0.2.3")
    assert ask(ann, "access.bar", **fields)["code"] == code
    assert not ann.transport.is_over
    assert not also.transport.is_over
    assert rig.desk.login.places.bars(rig.now) == {}
    assert noted(rig, AuditEvent.ADDRESS_BARRED) == []
