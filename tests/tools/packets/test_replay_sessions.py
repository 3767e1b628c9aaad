"""Replaying a recording: what is sent when, what counts as a difference, and absent peers."""

import asyncio
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from rigs.peers.loopback_peers import LOOPBACK, PING, PONG, Server, connect

from openpendant.simplemsg.framing import Cut
from openpendant.tools.packets.console import PacketToolError
from openpendant.tools.packets.live.endpoints import Endpoint
from openpendant.tools.packets.live.playback import (
    Pace,
    PlayedSide,
    Player,
    RecordedSession,
    sessions_of,
)
from openpendant.tools.packets.live.replaying import Replay, ReplaySummary
from openpendant.tools.packets.replay import chosen, main
from openpendant.tools.packets.trace import (
    Entry,
    Event,
    Packet,
    TraceDirection,
    entry_line,
    header_line,
)

pytestmark = pytest.mark.virtual_clock

SECOND = 1_000_000_000
UP, DOWN = TraceDirection.TO_SERVER, TraceDirection.TO_CLIENT
FAILED = PONG[:12] + bytes([2, 0, 0, 0])
STATUS = bytes.fromhex("280000000d0000000100000000000000") + bytes(28)
FAST = Pace(None)


def conversation(rounds: int = 3, step: float = 1.0) -> list[Entry]:
    """A ping each `step` seconds, answered a tenth of it later; a status before each answer."""
    entries: list[Entry] = [Event(0, "client-connected", 11000, 1)]
    for index in range(rounds):
        at = round((index + 1) * step * SECOND)
        later = at + round(step * SECOND / 10)
        entries.append(Packet(at, UP, PING, 11000))
        entries.append(Packet(later, DOWN, STATUS, 11000))
        entries.append(Packet(later, DOWN, PONG, 11000))
    return entries


def player(
    part: PlayedSide = PlayedSide.CLIENT, pace: Pace = FAST, entries: Iterable[Entry] | None = None
) -> Player:
    entries = conversation() if entries is None else entries
    (session,) = sessions_of(entries, part, exact=pace.exact)
    made = Player(session, part, pace)
    made.start(0)
    return made


def frame(data: bytes) -> Cut:
    return Cut(data, is_frame=True)


def test_at_recorded_times_packets_leave_at_recorded_times() -> None:
    run = player(pace=Pace(2.0))
    assert run.due(SECOND // 2 - 1) == []
    assert run.due(SECOND // 2) == [PING]
    assert run.next_due(SECOND // 2) == SECOND
    assert run.due(10 * SECOND) == [PING, PING]
    assert run.next_due(10 * SECOND) is None


def test_as_fast_as_replies_the_next_packet_waits_for_the_reply_and_not_for_topics() -> None:
    run = player()
    assert run.due(0) == [PING]
    assert run.due(9 * SECOND) == []
    assert not run.take(frame(STATUS))
    assert run.due(9 * SECOND) == []
    assert run.take(frame(PONG))
    assert run.due(9 * SECOND) == [PING]


def test_a_server_sends_no_reply_before_its_request() -> None:
    run = player(PlayedSide.SERVER, Pace(1.0))
    assert run.due(5 * SECOND) == [STATUS]
    run.take(frame(PING))
    assert run.due(5 * SECOND) == [PONG, STATUS]


DIFFERENCES = {
    "as recorded": ([PONG, PONG, PONG], Pace(None), 0, ""),
    "a failure": (
        [PONG, FAILED, PONG],
        Pace(None),
        1,
        "port 11000, connection 1: packet 2 should be a reply success of type 1 (ping), and is a"
        " reply failure of type 1 (ping)",
    ),
    "one too many": ([PONG] * 4, Pace(None), 1, "packet 4 should be none"),
    "topics do not matter": ([STATUS, PONG, STATUS, PONG, PONG], Pace(None), 0, ""),
    "topics matter": ([PONG], Pace(None, exact=True), 1, "packet 1 should be a topic of type 13"),
    "a byte": ([STATUS[:-1] + b"\1"], Pace(None, exact=True), 1, "byte 43 differs, of 44 and 44"),
}


@pytest.mark.parametrize("case", DIFFERENCES)
def test_what_comes_back_is_compared(case: str) -> None:
    answers, pace, count, first = DIFFERENCES[case]
    run = player(pace=pace)
    for answer in answers:
        run.take(frame(answer))
    assert run.differences == count
    assert first in run.first
    assert bool(run.first) == bool(count)


def test_bytes_that_are_no_frame_are_a_difference_however_they_are_cut() -> None:
    run = player()
    for _ in range(3):
        run.take(Cut(b"garbage", is_frame=False))
    assert run.differences == 1
    assert "is 7 bytes that are no frame" in run.first


def test_connections_are_told_apart() -> None:
    entries: list[Entry] = [
        Packet(0, UP, PING, 11000, 1),
        Packet(1, UP, PING, 11000, 2),
        Event(2, "end", 0),
    ]
    sessions = sessions_of(entries, PlayedSide.CLIENT, exact=False)
    assert [(session.port, session.number) for session in sessions] == [(11000, 1), (11000, 2)]


def test_one_part_of_a_capture_must_be_chosen() -> None:
    entries = [Packet(0, UP, PING, scenario="one"), Packet(0, UP, PING, scenario="two")]
    with pytest.raises(PacketToolError, match="'one', 'two'"):
        list(chosen(entries, None, None))
    assert list(chosen(entries, None, "two")) == entries[1:]
    assert list(chosen(entries, 5, "two")) == []


class Answers(Server):
    """A server that answers each 16 bytes with the next of its answers, then with nothing."""

    def __init__(self, answers: Iterator[bytes]) -> None:
        super().__init__()
        self._answers = answers

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await super()._accept(reader, writer)
        while await reader.read(16):
            writer.write(next(self._answers, b""))
        writer.close()


async def _play(answers: list[bytes], pace: Pace = FAST) -> ReplaySummary:
    server = Answers(iter(answers))
    await server.start()
    sessions = sessions_of(conversation(), PlayedSide.CLIENT, exact=pace.exact)
    replay = Replay(sessions, PlayedSide.CLIENT, pace, within=1.0)
    summary = await replay.play_client({11000: Endpoint(LOOPBACK, server.port)})
    await server.close()
    return summary


@pytest.mark.parametrize("pace", [FAST, Pace(1.0), Pace(100.0)])
async def test_a_server_that_answers_as_recorded_passes(pace: Pace) -> None:
    loop = asyncio.get_running_loop()
    before = loop.time()
    summary = await _play([STATUS + PONG] * 3, pace)
    assert (summary.sent, summary.received, summary.code) == (3, 3, 0)
    expected = 3.1 / pace.speed if pace.speed else 0
    assert loop.time() - before == pytest.approx(expected + 0.2, abs=0.15)


@pytest.mark.parametrize(
    ("answers", "code", "differences", "said"),
    [
        ([PONG, FAILED, PONG], 1, 1, "packet 2"),
        ([PONG, PONG, PONG + PONG], 1, 1, "packet 4 should be none"),
        ([PONG, b""], 3, 0, "2 packets are missing"),
        ([PONG, STATUS * 1000], 3, 0, "2 packets are missing"),
    ],
    ids=["otherwise", "one too many", "no more", "topics for ever"],
)
async def test_a_server_that_answers_otherwise_is_found_out(
    answers: list[bytes], code: int, differences: int, said: str
) -> None:
    summary = await _play(answers)
    assert (summary.code, summary.differences) == (code, differences)
    assert said in summary.first + summary.failure


async def test_a_peer_that_is_not_there_is_said() -> None:
    sessions = sessions_of(conversation(), PlayedSide.CLIENT, exact=False)
    replay = Replay(sessions, PlayedSide.CLIENT, FAST, within=1.0)
    summary = await replay.play_client({11000: Endpoint(LOOPBACK, 1)})
    assert summary.code == 3
    assert "Connection refused" in summary.failure


async def _serve(sessions: list[RecordedSession], pace: Pace = FAST) -> tuple[Replay, int]:
    replay = Replay(sessions, PlayedSide.SERVER, pace, within=1.0)
    ports = await replay.listen({11000: Endpoint(LOOPBACK, 0)})
    return replay, ports[11000]


@pytest.mark.parametrize("request_", [PING, STATUS[:8] + PING[8:12] + bytes(32)])
async def test_the_server_side_answers_a_client(request_: bytes) -> None:
    sessions = sessions_of(conversation(), PlayedSide.SERVER, exact=False)
    replay, port = await _serve(sessions)
    playing = asyncio.create_task(replay.play_server())
    client = await connect(port)
    for _ in range(3):
        client.write(request_)
        assert await client.read(60) == STATUS + PONG
    summary = await playing
    assert summary.code == (0 if request_ == PING else 1)
    client.writer.close()
    await asyncio.sleep(0.01)


async def test_a_client_that_never_comes_is_said() -> None:
    sessions = sessions_of(conversation(), PlayedSide.SERVER, exact=False)
    replay, _ = await _serve(sessions)
    summary = await replay.play_server()
    assert summary.code == 3
    assert "no client connected for connection 1 of port 11000 within 1 s" in summary.failure


@pytest.fixture
def trace(tmp_path: Path) -> str:
    file = tmp_path / "trace.jsonl"
    point = bytes.fromhex("400000000b0000000200000000000000") + bytes(52)
    entries = [Packet(0, UP, point, 11000), Packet(1, DOWN, STATUS, 11002)]
    lines = [header_line("2026-01-01T00:00:00+00:00"), *map(entry_line, entries)]
    file.write_text("\n".join(lines) + "\n")
    return str(file)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--as", "client"], "the recording has port 11000, 11002: --to 11000=[HOST:]PORT"),
        (["--as", "client", "--to", "1"], "or choose --port"),
        (["--as", "client", "--to", "12=1"], "the recording has port"),
        (["--as", "client", "--to", "x=1"], "--to x=1: invalid literal"),
        (["--as", "client", "--port", "11000", "--to", "1:2:x"], "is no [HOST:]PORT"),
        (["--as", "client", "--port", "11000", "--to", "1"], "--yes-it-may-move"),
        (["--as", "client", "--port", "7", "--to", "1"], "no connection to play"),
        (["--as", "nobody"], "invalid choice"),
        (["--as", "client", "--speed", "0"], "is no number from"),
    ],
)
def test_wrong_arguments_are_said(
    trace: str, arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([trace, *arguments]) == 2
    errors = capsys.readouterr().err
    assert reason in errors
    assert "Traceback" not in errors


def test_a_trace_that_is_none_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "trace.jsonl"
    file.write_bytes(b"\x00\x01\x02")
    assert main([str(file), "--as", "client", "--to", "1"]) != 0
    assert len(capsys.readouterr().err.splitlines()) == 1
