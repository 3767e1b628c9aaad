"""The emulator on real loopback sockets: links, deadlines and back-pressure."""

import asyncio
import socket
import struct
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest
import pytest_asyncio
from rigs.cells.controller_rig import STOP, ControllerRig, full_point, ratio_point

from openpendant.controller_emulator.shell.service import (
    EmulatorListenFailed,
    EmulatorPorts,
    Service,
)
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    CommType,
    Connection,
    JointFeedback,
    JointPosition,
    Message,
    Ping,
    Received,
    ReplyCode,
    Role,
    Status,
    Unasked,
    message_type,
)
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

LOOPBACK = "127.0.0.1"
TIMEOUT_S = 5.0

Start = Callable[..., Awaitable["Running"]]


class Peer:
    """A client that speaks simple message over asyncio streams."""

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        order: ByteOrder = ByteOrder.LITTLE,
    ) -> None:
        self.reader, self.writer = reader, writer
        self.connection = Connection(Role.CLIENT, PENDANT, order)
        self._waiting: list[Received] = []

    async def receive(self) -> Received:
        while not self._waiting:
            data = await asyncio.wait_for(self.reader.read(1024), TIMEOUT_S)
            if not data:
                raise EOFError
            self._waiting += self.connection.receive(data)
        return self._waiting.pop(0)

    async def ask(self, message: Message) -> Message:
        self.writer.write(self.connection.send(message))
        reply = await self.receive()
        assert isinstance(reply, Message)
        return reply

    async def is_closed_by_peer(self) -> bool:
        try:
            return await asyncio.wait_for(self.reader.read(), TIMEOUT_S) == b""
        except ConnectionError:
            return True


class Running:
    """A service on free ports, and the peers that are connected to it."""

    def __init__(self, service: Service, ports: EmulatorPorts) -> None:
        self.service, self.ports = service, ports
        self.peers: list[Peer] = []

    async def connect(self, port: int, order: ByteOrder) -> Peer:
        peer = Peer(*await asyncio.open_connection(LOOPBACK, port), order)
        self.peers.append(peer)
        return peer

    async def motion(self, order: ByteOrder = ByteOrder.LITTLE) -> Peer:
        return await self.connect(self.ports.motion, order)

    async def state(self, order: ByteOrder = ByteOrder.LITTLE) -> Peer:
        return await self.connect(self.ports.state, order)

    async def close(self) -> None:
        for peer in self.peers:
            peer.writer.close()
        await self.service.close()
        await asyncio.sleep(0)


@pytest_asyncio.fixture
async def start() -> AsyncIterator[Start]:
    running: list[Running] = []

    async def begin(**values: object) -> Running:
        loop = asyncio.get_running_loop()
        settings = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0, **values})
        rig = ControllerRig(now=round(loop.time() * 1e9))
        service = Service(rig.controller, settings)
        running.append(Running(service, await service.start()))
        return running[-1]

    yield begin
    for emulator in running:
        await emulator.close()


pytestmark = pytest.mark.virtual_clock


async def test_points_are_answered_and_moved_through(start: Start) -> None:
    emulator = await start()
    peer = await emulator.motion()
    for point in (full_point(0, 0.0, (0.0, 0.0)), full_point(1, 1.0, (0.5, 0.0))):
        assert (await peer.ask(point)).reply_code == ReplyCode.SUCCESS
    await asyncio.sleep(1.1)
    assert emulator.service.controller.motion(emulator.service.now)[0][0] == 0.5


async def test_requests_are_understood_byte_by_byte(start: Start) -> None:
    peer = await (await start()).motion()
    for byte in peer.connection.send(ratio_point(0, (0.1, 0.1), 1.0)):
        peer.writer.write(bytes([byte]))
        await asyncio.sleep(0.001)
    reply = await peer.receive()
    assert isinstance(reply, Message)
    assert message_type(reply) == 11


async def test_a_listener_gets_reports_at_the_rate_that_was_set(start: Start) -> None:
    peer = await (await start(rate=50)).state()
    await asyncio.sleep(2.001)
    received: list[Received] = []
    while not received or len(received) < 200:
        received.append(await peer.receive())
    joints = [m for m in received if isinstance(m, JointPosition)]
    feedback = [m for m in received if isinstance(m, JointFeedback)]
    assert feedback[1].time - feedback[0].time == pytest.approx(0.02, abs=1e-6)
    assert len(joints) == pytest.approx(95, abs=5)


async def test_a_listener_is_told_of_an_emergency_stop_at_once(start: Start) -> None:
    emulator = await start(rate=1)
    listener, peer = await emulator.state(), await emulator.motion()
    event = OperatorEvent(OperatorAction.EMERGENCY_STOP)
    before = asyncio.get_running_loop().time()
    assert (await peer.ask(event)).reply_code == ReplyCode.SUCCESS
    while not (isinstance(status := await listener.receive(), Status) and status.e_stopped):
        pass
    assert asyncio.get_running_loop().time() - before < 0.011


async def test_the_state_port_answers_questions_and_refuses_points(start: Start) -> None:
    peer = await (await start(rate=1)).state()
    assert message_type(await peer.ask(Ping())) == 1
    assert (await peer.ask(ratio_point(0, (0.1, 0.1), 1.0))).reply_code == ReplyCode.FAILURE


@pytest.mark.parametrize("how", ["close", "reset"])
async def test_a_lost_link_stops_the_motion_within_a_tick(start: Start, how: str) -> None:
    emulator = await start()
    peer = await emulator.motion()
    await peer.ask(ratio_point(0, (1.0, 1.0), 2.0))
    await asyncio.sleep(1.0)
    if how == "reset":
        linger = struct.pack("ii", 1, 0)
        peer.writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        peer.writer.transport.abort()
    else:
        peer.writer.close()
    await asyncio.sleep(0.01)
    status = emulator.service.controller.status(emulator.service.now)
    assert status.motion_possible == 0
    assert status.in_error == 1
    await asyncio.sleep(1.0)
    assert emulator.service.controller.motion(emulator.service.now)[1] == (0.0, 0.0)


@pytest.mark.parametrize(
    "garbage",
    [
        b"\0\0\0\0",
        b"\xff\xff\xff\xff",
        b"GET / HTTP/1.1\r\n",
        b"\x08\0\0\0",
        b"\0\x10\0\0",
    ],
)
async def test_a_framing_fault_closes_the_link_and_only_that(start: Start, garbage: bytes) -> None:
    emulator = await start()
    peer, other = await emulator.motion(), await emulator.motion()
    peer.writer.write(garbage)
    assert await peer.is_closed_by_peer()
    assert message_type(await other.ask(Ping())) == 1


async def test_a_frame_that_is_not_completed_within_a_second_closes_the_link(start: Start) -> None:
    peer = await (await start()).motion()
    for byte in STOP_FRAME[:30]:
        peer.writer.write(bytes([byte]))
        await asyncio.sleep(0.05)
    assert await peer.is_closed_by_peer()


async def test_a_client_whose_reads_always_end_inside_a_frame_is_kept(start: Start) -> None:
    peer = await (await start()).motion()
    peer.writer.write(STOP_FRAME[:10])
    for _ in range(30):
        peer.writer.write(STOP_FRAME[10:] + STOP_FRAME[:10])
        await asyncio.sleep(0.1)
        assert isinstance(await peer.receive(), Unasked)  # sent as bytes, so nothing is expected


async def test_silence_between_frames_is_legal(start: Start) -> None:
    peer = await (await start()).motion()
    await peer.ask(Ping())
    await asyncio.sleep(60)
    assert message_type(await peer.ask(Ping())) == 1


async def test_connections_beyond_the_cap_are_closed(start: Start) -> None:
    emulator = await start(max_connections=2)
    first, _ = await emulator.motion(), await emulator.motion()
    await first.ask(Ping())
    assert await (await emulator.motion()).is_closed_by_peer()
    assert message_type(await first.ask(Ping())) == 1


async def test_a_flood_of_pings_is_answered_to_the_last(start: Start) -> None:
    peer = await (await start()).motion()
    peer.writer.write(b"".join(peer.connection.send(Ping()) for _ in range(500)))
    pong = Ping(comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS)
    assert [await peer.receive() for _ in range(500)] == [pong] * 500


async def test_a_listener_that_does_not_read_is_cut_off_and_bounded(start: Start) -> None:
    emulator = await start(rate=250)
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    sock.setblocking(False)
    loop = asyncio.get_running_loop()
    await loop.sock_connect(sock, (LOOPBACK, emulator.ports.state))
    reader = await emulator.state()
    await asyncio.sleep(0.1)
    (stalled, _) = emulator.service.state_links
    largest = heard = 0

    async def listen() -> None:
        nonlocal heard
        while True:
            heard += isinstance(await reader.receive(), Status)

    # All that comes: what is not read waits in buffers of the system, whose size is its own affair.
    listening = asyncio.create_task(listen())
    for _ in range(40):
        before = heard
        await asyncio.sleep(0.25)
        largest = max(largest, stalled.backlog)
        assert heard > before
    listening.cancel()
    sock.close()
    assert 0 < largest < 20 * 1024
    assert len(emulator.service.state_links) == 1


async def test_a_port_in_use_leaves_nothing_open(start: Start) -> None:
    emulator = await start()
    with pytest.raises(EmulatorListenFailed, match="in use"):
        await start(state_port=emulator.ports.motion)


STOP_FRAME = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE).send(STOP)


async def hears(listener: Peer) -> type[Received]:
    """Return what kind of message comes next; a frame in the other order raises an error."""
    message = await listener.receive()
    assert listener.connection.fault is None
    return type(message)


async def test_a_listener_is_told_in_the_order_of_its_motion_link(start: Start) -> None:
    emulator = await start()
    motion = await emulator.motion(ByteOrder.BIG)
    await motion.ask(Ping())
    assert await hears(await emulator.state(ByteOrder.BIG)) is JointPosition


async def test_one_that_was_told_in_the_other_order_is_closed_and_told_rightly_then(
    start: Start, caplog: pytest.LogCaptureFixture
) -> None:
    emulator = await start()
    listener = await emulator.state(ByteOrder.BIG)
    await asyncio.sleep(0.05)
    await (await emulator.motion(ByteOrder.BIG)).ask(Ping())
    assert len(await asyncio.wait_for(listener.reader.read(), TIMEOUT_S)) < 4096
    assert await hears(await emulator.state(ByteOrder.BIG)) is JointPosition
    assert "127.0.0.1 speaks big endian" in caplog.text
    assert "--byte-order big" in caplog.text


async def test_a_listener_that_asks_is_told_in_its_own_order_from_then_on(start: Start) -> None:
    listener = await (await start()).state(ByteOrder.BIG)
    await asyncio.sleep(0.05)
    listener.writer.write(listener.connection.send(Ping()))
    answer = struct.pack(">4i", 12, 1, 3, 1)
    heard = b""
    while answer not in heard:
        heard += await asyncio.wait_for(listener.reader.read(4096), TIMEOUT_S)
    before, after = heard.split(answer)
    assert before.startswith(struct.pack("<i", 56))
    listener.connection.receive(answer + after)
    assert [await hears(listener) for _ in range(4)][-1] in (JointPosition, JointFeedback)


async def test_nobody_is_closed_where_all_speak_alike(start: Start) -> None:
    emulator = await start()
    listener = await emulator.state()
    await (await emulator.motion()).ask(Ping())
    assert JointPosition in {await hears(listener) for _ in range(20)}
