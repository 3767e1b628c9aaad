"""`send`: words to packets, consent, and every kind of peer."""

import asyncio
import io
import json
import sys
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from rigs.peers.loopback_peers import LOOPBACK, PING, PONG, Server

from openpendant.simplemsg import (
    MOTOMAN,
    PENDANT,
    STANDARD,
    Dialect,
    HeaderOnly,
    JointTrajPt,
    Opaque,
    Ping,
    codec_for,
)
from openpendant.simplemsg.pendant import Login, Management
from openpendant.tools.packets.console import PacketToolError, PeerError
from openpendant.tools.packets.live.consent import may_act
from openpendant.tools.packets.live.endpoints import Endpoint, Peer
from openpendant.tools.packets.live.typed_message import message_from_words
from openpendant.tools.packets.send import main, talk

pytestmark = pytest.mark.virtual_clock

ZEROS = (0.0,) * 10
REFUSAL = bytes.fromhex("0c000000010000000300000002000000")
STATUS = bytes.fromhex("280000000d0000000100000000000000") + bytes(28)


@pytest.mark.parametrize("dialect", [STANDARD, MOTOMAN, PENDANT], ids=lambda each: str(each.name))
def test_every_message_can_be_named_and_its_fields_left_out(dialect: Dialect) -> None:
    codec = codec_for(dialect)
    for cls in dialect.messages:
        count = ["num_groups=1"] if cls.PLACE.msg_type == 2016 else []
        assert codec.encode(message_from_words(cls.PLACE.name, count, codec))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("ping", Ping()),
        ("1", Ping()),
        ("stop", JointTrajPt(-4, ZEROS, 0.0, 0.0)),
        (
            "joint_traj_pt sequence=0x2 joints=0.5,-1 velocity=.25",
            JointTrajPt(2, (0.5, -1.0, *ZEROS[2:]), 0.25, 0.0),
        ),
        ("joint_traj_pt comm=topic", JointTrajPt(0, ZEROS, 0.0, 0.0, comm_type=1)),
        ("ping comm=reply reply_code=2", HeaderOnly(1, reply_code=2)),
        ("65001 body={}", Management(0, b"{}")),
        ("4711 body=00ff", Opaque(4711, b"\0\xff")),
    ],
)
def test_words_make_a_message(words: str, message: object) -> None:
    name, *fields = words.split()
    assert message_from_words(name, fields, codec_for(PENDANT)) == message


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("pin", "did you mean ping?"),
        ("joint_traj_pt foo=1", "has no field 'foo'; its fields: sequence, joints"),
        ("joint_traj_pt sequence", "'sequence' is no field=value"),
        ("joint_traj_pt sequence=x", "'x' is no integer"),
        ("joint_traj_pt velocity=fast", "'fast' is no real number"),
        ("joint_traj_pt joints=" + "1," * 11, "has 10 values, not 11"),
        ("joint_traj points=[", "is no JSON list"),
        ("4711 body=xyz", "'xyz' is no hexadecimal"),
        ("4711 foo=1", "no field but body"),
        ("ping comm=chat", "comm_type: 'chat' is no integer"),
    ],
)
def test_words_that_make_none_say_why(words: str, reason: str) -> None:
    name, *fields = words.split()
    with pytest.raises(PacketToolError) as error:
        message_from_words(name, fields, codec_for())
    assert reason in str(error.value)


def test_a_reply_that_is_named_has_its_body() -> None:
    codec = codec_for(MOTOMAN)
    assert len(codec.encode(message_from_words("motoman_motion_reply", ["result=1"], codec))) == 76


def _made(words: str, dialect: Dialect = STANDARD) -> bytes:
    codec = codec_for(dialect)
    name, *fields = words.split()
    return codec.encode(message_from_words(name, fields, codec))


@pytest.mark.parametrize(
    ("data", "acts"),
    [
        (_made("ping"), False),
        (_made("stop"), False),
        (_made("joint_traj_pt"), True),
        (_made("joint_traj_pt comm=topic"), True),
        (_made("joint_traj_pt_full sequence=-4"), False),
        (_made("joint_traj_pt_full sequence=-3"), True),
        (_made("joint_traj"), True),
        (_made("motoman_motion_ctrl command=200121", MOTOMAN), True),
        (_made("motoman_motion_ctrl command=200111", MOTOMAN), False),
        (_made("joint_move", PENDANT), True),
        (_made("software_stop", PENDANT), False),
        (PING + _made("joint_traj_pt"), True),
        (b"\0\0\0\0", True),
        (PING[:8], True),
        (bytes.fromhex("0c0000000b0000000200000000000000"), True),
        (_made("motoman_write_single_io", MOTOMAN), True),
        (_made("motoman_write_group_io", MOTOMAN), True),
        (_made("motoman_write_mregister", MOTOMAN), True),
        (_made("21"), True),
        (_made("motoman_read_single_io", MOTOMAN), False),
        (_made("motoman_read_mregister", MOTOMAN), False),
        (_made("20"), False),
    ],
)
def test_what_may_move_or_switch_is_known(data: bytes, acts: bool) -> None:
    assert may_act(data) is acts


def test_a_point_is_not_sent_without_consent(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("yes\n"))
    assert main(["1", "joint_traj_pt"]) == 2
    assert "--yes-it-may-move" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["1"],
        ["0", "ping"],
        ["x:y", "ping"],
        ["1", "--hex", "0"],
        ["1", "ping", "--hex", "00"],
        ["1", "joint_traj_pt", "sequence=999999999999"],
        ["1", "99999999999"],
    ],
)
def test_wrong_arguments_are_a_usage_error(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--dialect", "pendant", "joint_mov"], ["--json", "pin"]])
def test_options_may_stand_before_the_name(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["1", *arguments, "speed=1"]) == 2
    assert "did you mean" in capsys.readouterr().err


def test_json_from_standard_input_is_read_as_encode_reads_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b'\n{"msg_type": NaN}\n')))
    assert main(["1", "-"]) == 2
    assert capsys.readouterr().err.startswith("line 2: no JSON: NaN")


class Scripted(Server):
    """A server that says one thing to each connection, whatever it is sent."""

    def __init__(self, says: bytes | None, *, closes: bool) -> None:
        super().__init__()
        self._says, self._closes = says, closes

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await super()._accept(reader, writer)
        if self._says is not None:
            await reader.read(1)
            writer.write(self._says)
        if self._closes:
            writer.close()


@pytest.fixture
async def peer() -> AsyncIterator[Callable[..., Any]]:
    servers: list[Server] = []

    async def start(says: bytes | None, *, closes: bool = False) -> Endpoint:
        servers.append(Scripted(says, closes=closes))
        await servers[-1].start()
        return Endpoint(LOOPBACK, servers[-1].port)

    yield start
    for server in servers:
        await server.close()


@pytest.mark.parametrize(
    ("answer", "code", "printed"),
    [
        (PONG, 0, '"reply_code": 1'),
        (REFUSAL, 1, '"reply_code": 2'),
        (STATUS * 3 + PONG, 0, '"name": "ping"'),
        (b"\0\0\0\0garbage", 1, '"malformed": "in these bytes no frame can be found"'),
        (bytes.fromhex("0c000000010000000300000000000000"), 1, '"malformed": "reply code 0'),
        (bytes.fromhex("0000000c000000010000000300000001"), 0, '"order": "big"'),
    ],
)
async def test_an_answer_is_printed_as_it_is(
    peer: Callable[..., Any],
    capsys: pytest.CaptureFixture[str],
    answer: bytes,
    code: int,
    printed: str,
) -> None:
    assert await talk(await peer(answer), [PING], codec_for(), within=1.0, as_json=True) == code
    (line,) = capsys.readouterr().out.splitlines()
    assert printed in line
    assert json.loads(line)["latency_ms"] >= 0


@pytest.mark.parametrize(
    ("says", "closes", "reason"),
    [
        (None, True, "closed the connection|broke off"),
        (None, False, "no answer from .* within 1 s$"),
        (PONG[:9], False, "within 1 s, but 9 bytes of a frame that does not end"),
        (STATUS * 5000, False, "no answer from .* within 1 s"),
    ],
)
async def test_a_peer_that_does_not_answer_is_one_clear_line(
    peer: Callable[..., Any], says: bytes | None, closes: bool, reason: str
) -> None:
    endpoint = await peer(says, closes=closes)
    with pytest.raises(PeerError, match=reason):
        await talk(endpoint, [PING], codec_for(), within=1.0)


async def test_the_next_topics_are_printed(
    peer: Callable[..., Any], capsys: pytest.CaptureFixture[str]
) -> None:
    endpoint = await peer(STATUS * 5)
    topic = codec_for().encode(JointTrajPt(0, ZEROS, 0.0, 0.0, comm_type=1))
    assert await talk(endpoint, [topic], codec_for(), within=1.0, topics=3) == 0
    assert capsys.readouterr().out.count("13 status topic") == 3


STOPPED = bytes.fromhex("0c0000000b0000000300000001000000")
FANUC = bytes.fromhex("380000000a0000000300000001000000") + bytes(44)


def _motion_reply(command: int, result: int = 0) -> bytes:
    return _made(f"motoman_motion_reply command={command} result={result}", MOTOMAN)


CONTROL = "motoman_motion_ctrl command=200111"
FULL_POINT, READ = "joint_traj_pt_full", "motoman_read_single_io"
READ_REPLY = _made("motoman_read_single_io_reply", MOTOMAN)
WRITE_REPLY = _made("motoman_write_single_io_reply", MOTOMAN)
ABOUT = "a motion reply about command"


@pytest.mark.parametrize(
    ("request_words", "answer", "code", "remark"),
    [
        ("stop", STOPPED, 0, ""),
        ("stop", PONG, 1, "a reply of type 1 is no answer to type 11"),
        ("stop", FANUC, 0, "type 11 was answered by type 10, a habit of Fanuc's"),
        (FULL_POINT, FANUC, 1, "a reply of type 10 is no answer to type 14"),
        (
            FULL_POINT,
            _motion_reply(14),
            0,
            "type 14 was answered by type 2002, a habit of Motoman's",
        ),
        (FULL_POINT, _motion_reply(200111), 1, f"{ABOUT} 200111 is no answer to type 14"),
        (CONTROL, _motion_reply(200111), 0, ""),
        (CONTROL, _motion_reply(200101), 1, f"{ABOUT} 200101 is no answer to type 2001"),
        ("motoman_joint_traj_pt_full_ex num_groups=1", _motion_reply(2016), 0, ""),
        ("motoman_select_tool", _motion_reply(2018), 0, ""),
        (READ, READ_REPLY, 0, ""),
        (READ, WRITE_REPLY, 1, "a reply of type 2006 is no answer to type 2003"),
    ],
)
async def test_an_answer_belongs_to_the_request_by_its_type(
    peer: Callable[..., Any],
    capsys: pytest.CaptureFixture[str],
    request_words: str,
    answer: bytes,
    code: int,
    remark: str,
) -> None:
    endpoint = await peer(answer)
    packet = _made(request_words, MOTOMAN)
    assert await talk(endpoint, [packet], codec_for(MOTOMAN), within=1.0) == code
    assert capsys.readouterr().err == (f"{remark}\n" if remark else "")


@pytest.mark.parametrize("name", ["joint_move", "software_stop", "hello"])
async def test_a_verdict_answers_requests_of_the_pendant_protocol(
    peer: Callable[..., Any], name: str
) -> None:
    endpoint = await peer(_made("verdict", PENDANT))
    assert await talk(endpoint, [_made(name, PENDANT)], codec_for(PENDANT), within=1.0) == 0


@pytest.mark.parametrize(
    ("request_words", "answer", "remark"),
    [
        (
            "motoman_motion_ctrl command=200121",
            _made("motoman_motion_reply command=200121 result=5 subcode=5007", MOTOMAN),
            "    NOT_READY/NOT_READY_HOLD: Hold is active. Release it at the controller.",
        ),
        (
            "motoman_read_single_io",
            _made("motoman_read_single_io_reply result_code=1001", MOTOMAN),
            "    READ_ADDRESS_INVALID: This address cannot be read. See the address ranges",
        ),
    ],
)
@pytest.mark.parametrize("as_json", [False, True])
async def test_a_failure_of_motomans_is_explained_to_people(
    peer: Callable[..., Any],
    capsys: pytest.CaptureFixture[str],
    request_words: str,
    answer: bytes,
    remark: str,
    as_json: bool,
) -> None:
    endpoint = await peer(answer)
    packet = _made(request_words, MOTOMAN)
    assert await talk(endpoint, [packet], codec_for(MOTOMAN), within=1.0, as_json=as_json) == 1
    _, *remarks = capsys.readouterr().out.splitlines()
    assert [line[: len(remark)] for line in remarks] == ([] if as_json else [remark])


@pytest.mark.parametrize("strict", [False, True])
async def test_a_login_for_another_machine_is_warned_of_and_not_sent_where_it_is_strict(
    strict: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Peer, "is_here", False)
    secret = "canary-of-send"
    codec = codec_for(PENDANT)
    login = codec.encode(Login(request_id=1, kind=1, name="ann", secret=secret))
    server = Server()
    await server.start()
    where = Endpoint(LOOPBACK, server.port)
    task = asyncio.create_task(talk(where, [login], codec, within=5.0, strict=strict))
    peer = await server.next()
    if strict:
        with pytest.raises(PacketToolError, match="not sent: it holds a password in clear text"):
            await task
        assert await peer.rest() == b""
    else:
        assert await peer.read(len(login)) == login
        peer.write(PONG)
        await task
        told = capsys.readouterr().err
        assert told.startswith("warning: a password leaves in clear text for 127.0.0.1:")
        assert secret not in told
    await server.close()


async def test_what_holds_no_secret_or_stays_on_this_machine_has_no_warning(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    codec = codec_for(PENDANT)
    login = codec.encode(Login(request_id=1, kind=1, name="ann", secret="canary"))
    for packet, is_here in ((login, True), (PING, False)):
        with monkeypatch.context() as patched:
            if not is_here:
                patched.setattr(Peer, "is_here", False)
            server = Server()
            await server.start()
            where = Endpoint(LOOPBACK, server.port)
            task = asyncio.create_task(talk(where, [packet], codec, within=5.0, strict=True))
            peer = await server.next()
            assert await peer.read(len(packet)) == packet
            peer.write(PONG)
            await task
            await server.close()
    assert "clear text" not in capsys.readouterr().err
