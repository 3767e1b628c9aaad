"""The lobby: which cells there are, for a pendant that has not chosen one yet."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.admission_desk import BOOK, Desk
from rigs.cells.byte_rig import ByteClient
from rigs.cells.expectations import only
from rigs.cells.guarded_bytes import GuardedBytes
from rigs.cells.guarded_rig import GuardedRig
from rigs.cells.server_rig import LIMITS, MS, NoTool, ready, worked_out
from rigs.peers.server_clients import hello

from openpendant.server.core.cell_core import CellCore
from openpendant.server.core.server_core import ServerCore
from openpendant.server.endpoints.pendant.access_requests import CoreAccess, Identity
from openpendant.server.endpoints.pendant.lobby import CellGlance, CellLobby, LobbyCell
from openpendant.server.events.effects import Send
from openpendant.server.events.events import ClientEvent, Closed, Opened, Port, Received
from openpendant.server.settings.cell_settings import make_settings
from openpendant.simplemsg import Opaque, Ping, ReplyCode
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Hello, HelloReply, LobbyReply, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

SECOND = 1_000 * MS
LAN = "192.0.2.7"


def asked(request_id: int = 1) -> messages.Lobby:
    return messages.Lobby(request_id)


def told(answers: list[Any]) -> dict[str, Any]:
    body: dict[str, Any] = json.loads(only(LobbyReply, answers).body)
    return body


class Room:
    """A server of several cells without accounts; 127.0.0.1 is its single user's."""

    def __init__(self, *names: str) -> None:
        access = CoreAccess()
        self.cores = [_core(name, access) for name in names]
        self._server = ServerCore(self.cores)
        self.now = SECOND
        self.login = access.login

    def handle(self, event: ClientEvent) -> list[Any]:
        out = []
        for number, each in self._server.route(event):
            out += worked_out(self.cores[number].handle(each, self.now))
        return [item.message for item in out if isinstance(item, Send)]

    def come(self, session: int, address: str = "127.0.0.1") -> None:
        self.handle(Opened(session, Port.PENDANT, address))

    def lobby(self, session: int) -> dict[str, Any]:
        return told(self.handle(Received(session, asked())))


def _core(name: str, access: CoreAccess) -> CellCore:
    identity = Identity(name, "two-joints", "openpendant test", "Maker Model 2")
    settings = make_settings({"name": name}, "test")
    return CellCore(settings, LIMITS, identity, NoTool(), access=access)


def test_before_a_hello_names_a_cell_the_lobby_tells_all_of_them() -> None:
    room = Room("left", "middle", "right")
    room.come(1)
    lobby = room.lobby(1)
    cells = lobby.pop("cells")
    assert lobby == {"server": "openpendant test", "version": 3, "joins": False}
    assert [each["cell"] for each in cells] == ["left", "middle", "right"]
    assert cells[1] == {
        "cell": "middle",
        "robot": "two-joints",
        "display": "Maker Model 2",
        "emulated": False,
        "login_needed": False,
        "holder": "",
        "moving": False,
        "connections": 0,
    }


def test_a_hello_after_the_lobby_leads_to_the_cell_that_it_names() -> None:
    room = Room("left", "right")
    room.come(1)
    room.lobby(1)
    reply = only(HelloReply, room.handle(Received(1, Hello(3, 0.0, "right", "tester"))))
    assert reply.cell == "right"
    room.now += SECOND
    assert [each["connections"] for each in room.lobby(1)["cells"]] == [0, 1]


def test_it_says_who_holds_a_cell_and_how_many_pendants_that_has() -> None:
    room = Room("left", "right")
    for session, cell in ((1, "right"), (2, "right"), (3, "left")):
        room.come(session)
        room.handle(Received(session, Hello(3, 0.0, cell, f"pendant {session}")))
    request = messages.AuthorityAction.REQUEST
    room.handle(Received(2, messages.Authority(1, request)))
    room.come(4)
    left, right = room.lobby(4)["cells"]
    assert (left["holder"], left["connections"]) == ("", 1)
    assert (right["holder"], right["connections"]) == ("pendant 2", 2)


def test_a_hello_does_not_make_the_next_lobby_come_sooner() -> None:
    room = Room("left", "right")
    room.come(1)
    room.lobby(1)
    room.handle(Received(1, Hello(3, 0.0, "right", "tester")))
    verdict = only(Verdict, room.handle(Received(1, asked())))
    assert verdict.code == V.TOO_OFTEN


def test_a_cell_that_failed_is_still_there_and_nobody_holds_it() -> None:
    room = Room("left", "right")
    room.come(1)
    room.handle(Received(1, Hello(3, 0.0, "right", "tester")))
    room.handle(Received(1, messages.Authority(1, messages.AuthorityAction.REQUEST)))
    room.cores[1].fail("it broke", room.now)
    room.handle(Closed(1))
    room.come(2)
    right = room.lobby(2)["cells"][1]
    assert (right["cell"], right["holder"], right["moving"]) == ("right", "", False)


def test_it_says_that_a_robot_moves_and_is_emulated() -> None:
    rig = ready()
    holder = rig.holder()
    (before,) = told(rig.stranger().send(asked()))["cells"]
    holder.move(0.5, 0.0)
    rig.wait(300)
    rig.core.cell.feedback.says_emulated = rig.core.cell._is_told_emulated = True
    (after,) = told(rig.stranger().send(asked()))["cells"]
    assert [before[key] for key in ("moving", "emulated", "holder")] == [False, False, "holder"]
    assert [after[key] for key in ("moving", "emulated")] == [True, True]


# Who is told how much.

_SECRET_KEYS = {"holder", "moving", "connections"}


@pytest.mark.parametrize(
    ("has_accounts", "address", "login_needed", "looks_on"),
    [
        (False, "127.0.0.1", False, True),
        (False, LAN, True, False),
        (True, "127.0.0.1", True, True),
        (True, LAN, True, False),
    ],
)
async def test_who_may_not_look_on_is_not_told_what_a_cell_is_doing(
    has_accounts: bool, address: str, login_needed: bool, looks_on: bool
) -> None:
    desk = Desk(BOOK if has_accounts else type(BOOK)(), single_user_host=not has_accounts)
    rig = GuardedBytes(desk=desk)
    client = rig.come(address)
    client.tell(asked())
    (cell,) = told(client.heard())["cells"]
    assert cell["login_needed"] == login_needed
    assert (cell.keys() >= _SECRET_KEYS, cell.keys() & _SECRET_KEYS == set()) == (
        looks_on,
        not looks_on,
    )


async def test_who_has_logged_in_is_told_from_wherever_he_comes() -> None:
    rig = GuardedBytes()
    client = rig.come(LAN)
    client.tell(hello("a browser"))
    assert rig.log_in(client, "vera") is V.ACCEPTED
    client.tell(asked())
    (cell,) = told(client.heard())["cells"]
    assert cell["connections"] == 1


def test_the_operation_cells_gives_the_same_answer() -> None:
    pendant = GuardedRig().user("vera")
    lobby = told(pendant.send(asked(7)))
    assert lobby["cells"][0]["connections"] == 1
    assert pendant.ask("cells") == lobby


# How often, and for how long.


def test_it_is_answered_once_a_second_and_refused_with_the_seconds_to_wait() -> None:
    rig = ready()
    pendant = rig.stranger()
    told(pendant.send(asked(1)))
    rig.now += 250 * MS
    verdict = only(Verdict, pendant.send(asked(2)))
    assert (verdict.code, verdict.request_id) == (V.TOO_OFTEN, 2)
    assert verdict.value == pytest.approx(0.75)
    told(rig.stranger().send(asked(1)))
    rig.now += 750 * MS - 1
    assert only(Verdict, pendant.send(asked(3))).code == V.TOO_OFTEN
    rig.now += 1
    told(pendant.send(asked(4)))


def silent_for(rig: GuardedBytes, client: ByteClient, seconds: float) -> bool:
    """Let time pass; return True if the connection is still open."""
    for _ in range(round(seconds * 10)):
        rig.now += 100 * MS
        rig.perform(rig.core.pendants.tick(rig.now))
    return not client.transport.is_over


async def test_after_a_lobby_a_hello_may_take_a_minute() -> None:
    rig = GuardedBytes()
    silent, browsing = rig.come(LAN), rig.come(LAN)
    browsing.tell(asked())
    assert silent_for(rig, silent, 2.0)
    assert not silent_for(rig, silent, 0.1)
    assert silent_for(rig, browsing, 57.9)
    assert not silent_for(rig, browsing, 0.1)


async def test_the_minute_begins_anew_with_each_answer_alone() -> None:
    rig = GuardedBytes()
    client = rig.come(LAN)
    client.tell(asked(1))
    assert silent_for(rig, client, 59.0)
    client.tell(asked(2), Ping())
    assert silent_for(rig, client, 59.9)
    client.tell(Ping())
    assert silent_for(rig, client, 0.1)
    assert not silent_for(rig, client, 0.1)


async def test_who_is_in_the_lobby_counts_among_the_strangers() -> None:
    rig = GuardedBytes()
    crowd = [rig.come(LAN) for _ in range(16)]
    for client in crowd:
        client.tell(asked())
        told(client.heard())
    rig.come(LAN)
    assert [each.transport.is_over for each in crowd] == [True, *[False] * 15]


# Versions.


def test_a_lobby_before_hello_has_no_version_and_after_a_hello_of_version_2_is_unknown() -> None:
    rig = ready()
    pendant = rig.stranger()
    told(pendant.send(asked(1)))
    pendant.hello(version=2)
    rig.now += 2 * SECOND
    (refused,) = pendant.send(asked(2))
    assert not isinstance(refused, Verdict | LobbyReply)
    assert refused.reply_code == ReplyCode.FAILURE


def test_a_lobby_of_another_size_is_malformed() -> None:
    rig = GuardedBytes()
    client = rig.come(LAN)
    client.tell(Opaque(messages.Lobby.PLACE.msg_type, b"12345678", comm_type=2))
    assert only(Verdict, client.heard()).code == V.MALFORMED


# Sizes.


def room_of(count: int, name: str, glance: CellGlance) -> CellLobby:
    lobby = CellLobby()
    for _ in range(count):
        lobby.join(LobbyCell(name, name * 4, name * 4, lambda: glance))
    return lobby


@pytest.mark.parametrize("letter", ["x", "ä", "€", "😀"])
def test_128_cells_fit_a_frame(letter: str) -> None:
    name = letter * (32 // len(letter.encode()))
    glance = CellGlance(name, is_moving=False, is_emulated=False)
    described = room_of(128, name, glance).describe(Desk().login, 1, "127.0.0.1", "openpendant 1.0")
    body = json.dumps(described, ensure_ascii=False, separators=(",", ":")).encode()
    assert len(body) <= MAX_PENDANT_FRAME - 64


@given(st.text(max_size=80))
def test_whatever_a_robot_and_a_holder_are_called_the_lobby_is_one_line_of_text(name: str) -> None:
    glance = CellGlance(name, is_moving=True, is_emulated=True)
    lobby = room_of(1, name, glance)
    (cell,) = lobby.describe(Desk().login, 1, "127.0.0.1", "openpendant")["cells"]
    for text, most in ((cell["robot"], 64), (cell["display"], 64), (cell["holder"], 32)):
        assert len(text.encode()) <= most
        assert text.isprintable()


# Exposure.


@pytest.mark.parametrize("has_accounts", [False, True])
async def test_anybody_is_told_how_the_server_is_exposed(has_accounts: bool) -> None:
    desk = Desk(BOOK if has_accounts else type(BOOK)(), single_user_host=not has_accounts)
    rig = GuardedBytes(desk=desk)
    client = rig.come(LAN)
    client.tell(hello("a gateway"))
    client.heard()
    client.tell(messages.Management(1, b'{"op":"access.exposure"}'))
    (reply,) = client.heard()
    assert json.loads(reply.body) == {"logins_demanded": has_accounts, "tls": False}


def test_and_whether_its_port_is_encrypted() -> None:
    pendant = ready(tls={"certificate": "here.pem", "key": "here.key"}).pendant()
    assert pendant.ask("access.exposure") == {"logins_demanded": False, "tls": True}
