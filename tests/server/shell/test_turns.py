"""Turns of the loop: when one ends, and what waits behind a body that is read elsewhere."""

import asyncio
import json
from typing import Any

import pytest
from promises.promise_table import figure
from rigs.cells.admission_desk import BOOK, Desk
from rigs.cells.byte_rig import ByteClient, ByteRig
from rigs.peers.server_clients import hello

from openpendant.server.access.request_gate import Granted
from openpendant.server.events.effects import Cancel, SendToController
from openpendant.server.events.events import Event, Port
from openpendant.server.planning import jobs
from openpendant.server.refusal import Refusal
from openpendant.server.scene.imports import FramesImport, SceneImport, ToolsImport
from openpendant.server.shell.clients import READ_AHEAD
from openpendant.server.shell.waiting_line import MOST_WAITING
from openpendant.simplemsg import CommType, Message, Ping, joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Enabling,
    EnablingPosition,
    JogBeat,
    JogRelease,
    JogSpace,
    JogStart,
    JointMove,
    Management,
    OperatingMode,
    SetMode,
    SoftwareStop,
    State,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PING = Ping(comm_type=CommType.REQUEST)
LARGE = 5_000
SHARE = figure(53, "share").ns


def asking(number: int, size: int = 0, **body: object) -> Management:
    """Return a request whose body is made so large with blanks [bytes]."""
    return Management(number, json.dumps({"op": "why"} | body).encode().ljust(size))


def move(number: int) -> JointMove:
    return JointMove(number, 0.5, 2, joint_array((0.5, 0.5)))


def in_control(state_rate: float = 0.0) -> tuple[ByteRig, ByteClient]:
    rig = ByteRig(plans_at_once=False)
    client = rig.client()
    client.tell(hello(state_rate=state_rate), Authority(0, AuthorityAction.REQUEST))
    client.heard()
    return rig, client


def at_the_keys() -> tuple[ByteRig, ByteClient]:
    """Return a client that sees the state, in a mode in which it may jog."""
    rig, client = in_control(50.0)
    client.tell(SetMode(1, OperatingMode.MANUAL_HIGH), Enabling(EnablingPosition.HELD))
    return rig, client


def press(rig: ByteRig, client: ByteClient, number: int, of: int) -> JogStart:
    """Return the press of a key by somebody who sees the newest state."""
    rig.wait(50)
    seen = [each.sequence for each in client.heard() if isinstance(each, State)]
    rates = joint_array((1.0, 0.0))
    return JogStart(number, of, seen[-1], 0.15, JogSpace.JOINTS, "", 2, rates)


def answered(client: ByteClient) -> list[int]:
    return [each.request_id for each in client.heard() if isinstance(each, Management | Verdict)]


def codes(client: ByteClient) -> dict[int, V]:
    return {each.request_id: V(each.code) for each in client.heard() if isinstance(each, Verdict)}


def refusal(message: Any) -> dict[str, Any]:
    assert isinstance(message, Management)
    told: dict[str, Any] = json.loads(message.body)
    return told


class Costly:
    """Has each event of a core cost some processor time."""

    def __init__(self, rig: ByteRig, cost: int) -> None:
        handle = rig.core.handle

        def handled(event: Event, now: int) -> Any:
            rig.used += cost
            return handle(event, now)

        rig.core.handle = handled  # type: ignore[method-assign]  # what it costs counts here


@pytest.mark.parametrize(
    ("cost", "taken"),
    [
        (SHARE + 1, [1, 2, 3, 4]),
        (SHARE, [1, 2, 3, 4]),
        (SHARE - 1, [2, 4, 6, 8]),
        (0, [16, 20, 20, 20]),
    ],
)
async def test_promise_53_a_turn_ends_once_it_has_cost_its_share(
    cost: int, taken: list[int]
) -> None:
    rig, client = in_control()
    Costly(rig, cost)
    client.tell(*(asking(number) for number in range(2, 22)))
    counts = [len(answered(client))]
    for _ in taken[1:]:
        await asyncio.sleep(0)
        counts.append(counts[-1] + len(answered(client)))
    assert counts == taken


async def test_a_turn_of_a_ros_client_ends_by_its_cost_too() -> None:
    rig = ByteRig()
    client = rig.client(Port.ROS_MOTION)
    Costly(rig, SHARE)
    client.tell(*[PING] * 3)
    assert len(client.heard()) == 1
    await client.until_handled()
    assert len(client.heard()) == 2


async def test_what_a_turn_has_left_is_overtaken_by_a_stop_that_comes_then() -> None:
    rig, client = in_control()
    Costly(rig, SHARE)
    client.tell(PING, move(2), move(3))
    client.tell(SoftwareStop(4, "now"))
    assert rig.core.cell.stop is not None
    await client.until_handled()
    assert codes(client) == {2: V.OVERTAKEN_BY_STOP, 3: V.OVERTAKEN_BY_STOP, 4: V.ACCEPTED}
    assert not rig.jobs


# Behind a body that is read elsewhere.


async def test_what_comes_behind_a_large_body_waits_for_its_answer_in_order() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE), asking(3))
    client.tell(move(4))
    client.tell(asking(5, LARGE), asking(6))
    await client.until_handled()
    assert answered(client) == []
    assert [type(job) for job in rig.jobs] == [jobs.ReadBody]
    rig.plan()
    assert answered(client) == [2]
    await client.until_handled()
    assert answered(client) == [3, 4]
    assert [type(job) for job in rig.jobs] == [jobs.ReadBody]
    rig.plan()
    await client.until_handled()
    assert [each for each in answered(client) if each != 4] == [5, 6]


@pytest.mark.parametrize("size", [figure(53, "large").bytes, figure(53, "large").bytes + 1])
async def test_promise_53_a_body_is_read_elsewhere_from_the_bound_on(size: int) -> None:
    rig, client = in_control()
    client.tell(asking(2, size))
    assert len(rig.jobs) == (size > figure(53, "large").bytes)
    assert answered(client) == ([] if rig.jobs else [2])


@pytest.mark.parametrize(
    ("topic", "kind"),
    [("frames", FramesImport), ("tools", ToolsImport), ("scene", SceneImport)],
)
@pytest.mark.parametrize("size", [0, LARGE])
async def test_promise_53_an_import_of_whatever_size_is_made_ready_where_it_is_read(
    topic: str, kind: type, size: int
) -> None:
    rig, client = in_control()
    content = {"schema": "openpendant-frames/1"}
    client.tell(asking(2, size, op=f"{topic}.import", content=content, expected_revision=0))
    (job,) = rig.jobs
    assert isinstance(job, jobs.ReadBody)
    assert type(job.read(job.body)[1]) is kind


SMALL_IMPORT = asking(2, op="frames.import", content={}, expected_revision=0)


async def test_an_import_whose_name_is_written_with_escapes_is_one_all_the_same() -> None:
    rig, client = in_control()
    client.tell(
        Management(2, SMALL_IMPORT.body.replace(b"frames.import", rb"\u0066rames\u002eimport"))
    )
    (job,) = rig.jobs
    assert isinstance(job, jobs.ReadBody)
    assert type(job.read(job.body)[1]) is FramesImport


@pytest.mark.parametrize(
    "body",
    [
        b'{"op": "why", "kind": "frames.import"}',
        b'{"op": ["frames.import"]}',
        rb'["frames.import", "\u0066"]',
        b'{"op": "frames.import", ',
        b"[" * 4_000 + b'".import"',
    ],
    ids=["other operation", "list", "no object", "unsound", "deep"],
)
async def test_what_only_speaks_of_an_import_is_answered_at_once(body: bytes) -> None:
    rig, client = in_control()
    client.tell(Management(2, body))
    assert answered(client) == [2]
    assert not rig.jobs


async def test_what_comes_behind_a_small_import_waits_for_its_answer_in_order() -> None:
    rig, client = in_control()
    client.tell(SMALL_IMPORT, asking(3))
    client.tell(move(4))
    await client.until_handled()
    assert answered(client) == []
    rig.plan()
    await client.until_handled()
    assert answered(client) == [2, 3, 4]


async def test_a_stop_behind_a_small_import_acts_at_once() -> None:
    rig, client = in_control()
    client.tell(SMALL_IMPORT, asking(3))
    client.tell(SoftwareStop(4, "now"))
    assert rig.core.cell.stop is not None
    assert codes(client) == {4: V.ACCEPTED}


async def test_a_small_import_is_not_read_for_who_has_not_logged_in() -> None:
    rig = ByteRig(Desk(BOOK).login, plans_at_once=False)
    client = rig.client()
    client.tell(hello())
    client.heard()
    client.tell(SMALL_IMPORT)
    (told,) = client.heard()
    assert refusal(told)["code"] == V.LOGIN_NEEDED
    assert not rig.jobs


async def test_a_stop_behind_a_large_body_acts_at_once_and_overtakes_what_waits() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE), move(3), asking(4))
    client.tell(move(5))
    client.tell(SoftwareStop(6, "now"))
    assert rig.core.cell.stop is not None
    assert codes(client) == {6: V.ACCEPTED}
    client.tell(move(7))
    rig.plan()
    await client.until_handled()
    got = client.heard()
    assert [each.request_id for each in got] == [2, 3, 4, 5, 7]
    refused = {each.request_id: V(each.code) for each in got if isinstance(each, Verdict)}
    assert refused[3] is refused[5] is V.OVERTAKEN_BY_STOP
    assert refused[7] is V.STOP_LATCHED


async def test_a_stop_behind_others_in_a_later_read_overtakes_the_line_too() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE), move(3))
    client.tell(move(4), SoftwareStop(5, "now"))
    assert rig.core.cell.stop is not None
    rig.plan()
    await client.until_handled()
    got = codes(client)
    assert got[3] is got[4] is V.OVERTAKEN_BY_STOP


async def test_a_stop_in_the_same_read_as_a_large_body_overtakes_that_too() -> None:
    rig, client = in_control()
    body = asking(2, LARGE, op="signals.set", output=1, value=True)
    client.tell(body, SoftwareStop(3, "now"))
    rig.plan()
    (told,) = [each for each in client.heard() if isinstance(each, Management)]
    assert refusal(told)["code"] == V.OVERTAKEN_BY_STOP


async def test_a_stop_that_comes_while_a_body_is_read_overtakes_it() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE, op="signals.set", output=1, value=True))
    client.tell(SoftwareStop(3, "now"))
    client.heard()
    rig.plan()
    (told,) = client.heard()
    assert refusal(told)["code"] == V.OVERTAKEN_BY_STOP


async def test_beats_and_the_release_of_a_key_act_at_once_behind_a_large_body() -> None:
    rig, client = at_the_keys()
    client.tell(press(rig, client, 2, 1))
    assert codes(client) == {2: V.ACCEPTED}
    client.tell(asking(3, LARGE), asking(4))
    for beat in range(1, 11):
        client.tell(JogBeat(1, beat), AuthorityBeat(), Enabling(EnablingPosition.HELD))
        rig.wait(50)
    assert rig.activity() is Activity.JOGGING
    client.tell(JogRelease(5, 1))
    assert codes(client)[5] is V.ACCEPTED
    rig.wait(500)
    assert rig.activity() is Activity.IDLE
    assert [type(job) for job in rig.jobs] == [jobs.ReadBody]


async def test_a_press_whose_key_was_let_go_while_it_waited_never_begins() -> None:
    rig, client = at_the_keys()
    key = press(rig, client, 3, 1)
    client.tell(asking(2, LARGE), key, JogBeat(1, 1), JogRelease(4, 1))
    before = len(rig.log)
    rig.plan()
    await client.until_handled()
    assert codes(client)[3] is V.OVERTAKEN_BY_STOP
    rig.wait(100)
    assert not any(isinstance(item, SendToController) for _, item in rig.log[before:])


async def test_the_release_of_another_key_leaves_a_press_that_waits() -> None:
    rig, client = at_the_keys()
    client.tell(asking(2, LARGE), press(rig, client, 3, 2), JogRelease(4, 1))
    rig.plan()
    await client.until_handled()
    assert codes(client)[3] is V.ACCEPTED


def logged_in(name: str) -> tuple[Desk, ByteRig, ByteClient]:
    desk = Desk(BOOK)
    rig = ByteRig(desk.login, plans_at_once=False)
    client = rig.client()
    client.tell(hello())
    desk.log_in(client.session, name, rig.now)
    client.heard()
    return desk, rig, client


async def test_what_a_connection_may_do_is_judged_when_its_body_was_read() -> None:
    desk, rig, client = logged_in("ann")
    client.tell(asking(2, LARGE, op="users.list"))
    assert isinstance(desk.login.grant_of(client.session), Granted)
    desk.login.logout(client.session, rig.now)
    rig.plan()
    (told,) = client.heard()
    assert refusal(told)["code"] == V.LOGIN_NEEDED


async def test_promise_53_before_login_a_larger_body_is_refused_unread() -> None:
    most = figure(53, "unread").bytes
    rig = ByteRig(Desk(BOOK).login, plans_at_once=False)
    client = rig.client()
    client.tell(hello())
    client.heard()
    client.tell(Management(2, b"{" * (most + 1)), Management(3, b"{" * most))
    large, small = map(refusal, client.heard())
    assert (large["code"], large["value"], large["limit"]) == (V.LOGIN_NEEDED, most + 1, most)
    assert "Invalid JSON" not in large["text"]
    assert (small["code"], small["limit"]) == (V.LOGIN_NEEDED, 0.0)
    assert not rig.jobs


async def test_an_overtaken_body_of_a_stranger_is_not_read_either() -> None:
    rig = ByteRig(Desk(BOOK).login, plans_at_once=False)
    client = rig.client()
    client.tell(hello())
    client.heard()
    client.tell(Management(2, b"{" * LARGE), SoftwareStop(3, "now"))
    told = next(each for each in client.heard() if isinstance(each, Management))
    assert refusal(told)["limit"] == 1_024


async def test_a_body_whose_process_dies_is_refused_and_the_rest_goes_on() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE), asking(3))
    rig.plan(Refusal(V.PLANNER_FAILED))
    await client.until_handled()
    first, second = client.heard()
    assert refusal(first)["code"] == V.PLANNER_FAILED
    assert second.request_id == 3


async def test_a_body_that_outlives_its_connection_is_withdrawn_and_its_answer_dropped() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE), move(3))
    (job,) = rig.jobs
    before = len(rig.log)
    client.shell.connection_lost(None)
    assert Cancel(job.job_id) in [item for _, item in rig.log[before:]]
    assert rig.plan() == []
    await asyncio.sleep(0)
    assert not rig.jobs


async def test_two_connections_wait_for_their_own_bodies_only() -> None:
    rig, client = in_control()
    other = rig.client()
    other.tell(hello())
    other.heard()
    client.tell(asking(2, LARGE), asking(3))
    other.tell(asking(4))
    assert answered(other) == [4]


def fill(client: ByteClient, message: Message) -> int:
    """Send so often what a connection reads; return how often that was."""
    frame = client.frames(message)
    count = 0
    while client.transport.reads:
        client.say(frame * 64)
        count += 64
    return count


async def test_the_line_is_bounded_and_goes_on_from_its_bound() -> None:
    rig, client = in_control()
    client.tell(asking(2, LARGE))
    client.tell(*[PING] * (MOST_WAITING + 10))
    await client.until_handled()
    assert len(client.shell._line) == MOST_WAITING
    sent = MOST_WAITING + 10 + fill(client, PING)
    assert client.shell.wire.waiting < READ_AHEAD + 64 * 16
    client.shell.data_received(client.frames(SoftwareStop(3, "now")))
    assert rig.core.cell.stop is not None
    rig.plan()
    await client.until_handled()
    assert sum(isinstance(each, Ping) for each in client.heard()) == sent
    assert client.transport.reads


async def test_large_requests_in_the_line_count_by_their_bytes() -> None:
    _, client = in_control()
    client.tell(asking(2, LARGE))
    sent = 0
    while client.transport.reads:
        client.tell(asking(3 + sent, 60_000))
        sent += 1
        await client.until_handled()
    assert READ_AHEAD // 60_000 <= sent <= READ_AHEAD // 60_000 + 2
