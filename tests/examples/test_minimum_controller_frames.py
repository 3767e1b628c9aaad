"""The minimum controller by itself, compiled with sanitizers: frames in, frames out."""

import asyncio
import contextlib
import functools
import inspect
import math
import random
import signal
import socket
import struct
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE, SCALE
from rigs.peers.minimum_controller import (
    ACCELERATION,
    CODEC,
    FAILURE,
    HOME,
    REPORT_PERIOD,
    SANITIZERS,
    STOP,
    SUCCESS,
    Controller,
    Wire,
    compiled,
    point,
    sharpest,
    turned,
)

from openpendant.simplemsg import GetVersion, JointTrajPt, Ping, Status

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]
"""One loop for all: while one test is waited for, those that begin with it go on."""

BUFFER = 32
STEP = 0.05
"""A point this far in this time from the last is well within the limits [rad, s]."""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("sanitized"), *SANITIZERS)


@pytest_asyncio.fixture(loop_scope="module")
async def controller(program: Path) -> AsyncIterator[Controller]:
    running = await Controller.start(program)
    yield running
    await running.end()


async def linked(controller: Controller) -> AsyncIterator[Wire]:
    async with controller.link() as wire:
        yield wire


link = pytest_asyncio.fixture(linked, loop_scope="module")
other = pytest_asyncio.fixture(linked, loop_scope="module")


@pytest_asyncio.fixture(loop_scope="module")
async def listener(controller: Controller) -> AsyncIterator[Wire]:
    async with controller.listener() as wire:
        yield wire


MOST_AT_ONCE = 6
"""Controllers that run side by side; one more is not to make this process answer late."""

Body = Callable[..., Awaitable[None]]


class Begun:
    """The chosen tests that begin with others, a controller each: they wait more than they work."""

    def __init__(self, program: Path, items: list[pytest.Function]) -> None:
        self._program = program
        self._room = asyncio.Semaphore(MOST_AT_ONCE)
        self._tasks = {item.nodeid: asyncio.create_task(self._run(item)) for item in items}

    async def end(self, item: pytest.Function) -> None:
        """Wait for the end of a test; what it raises is raised here."""
        # What ended once has been taken out: a second attempt begins anew.
        task = self._tasks.pop(item.nodeid, None)
        await (self._run(item) if task is None else task)

    async def cancel(self) -> None:
        """Leave what nobody waits for."""
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)

    async def _run(self, item: pytest.Function) -> None:
        body: Body = item.function.body
        names = inspect.signature(body).parameters
        async with self._room:
            controller = await Controller.start(self._program)
            try:
                async with contextlib.AsyncExitStack() as stack:
                    given: dict[str, Any] = {"controller": controller, "program": self._program}
                    for name in names:
                        if name in ("link", "other"):
                            given[name] = await stack.enter_async_context(controller.link())
                        elif name == "listener":
                            given[name] = await stack.enter_async_context(controller.listener())
                    given |= item.callspec.params if hasattr(item, "callspec") else {}
                    await body(**{name: given[name] for name in names})
            finally:
                await controller.end()


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def begun(program: Path, request: pytest.FixtureRequest) -> AsyncIterator[Begun]:
    begun = Begun(
        program,
        [
            item
            for item in request.session.items
            if isinstance(item, pytest.Function)
            and item.path == request.path
            and hasattr(item.function, "body")
        ],
    )
    yield begun
    await begun.cancel()


def beside_others(body: Body) -> Body:
    """Make a test that begins with the others of its kind."""

    @functools.wraps(body)
    async def test(begun: Begun, request: pytest.FixtureRequest, **_: object) -> None:
        assert isinstance(request.node, pytest.Function)
        await begun.end(request.node)

    own = inspect.signature(test, follow_wrapped=False).parameters
    chosen = [
        each
        for each in inspect.signature(body).parameters.values()
        if each.name not in ("controller", "program", "link", "other", "listener")
    ]
    parameters = [own["begun"], own["request"], *chosen]
    vars(test).update(body=body, __signature__=inspect.Signature(parameters))
    return test


async def begin(link: Wire, far: float = 1.0, duration: float = 1.0) -> None:
    assert await link.ask(point(0, turned(0, far), duration)) == SUCCESS


async def moving(listener: Wire) -> None:
    while True:
        joints, _ = (await listener.rounds(lambda status: status.in_motion == 1))[-1]
        if joints.joints[0] > 0.1:
            return


async def test_a_single_point_is_a_point_to_point_motion(link: Wire, listener: Wire) -> None:
    assert await listener.status() == Status(1, 0, 0, 0, 0, 2, 1)
    await begin(link, 0.4, 0.3)
    rounds = await listener.until_rest_after_motion()
    assert rounds[-1][0].joints[:6] == pytest.approx(turned(0, 0.4), abs=1e-6)
    assert sharpest(rounds) <= ACCELERATION * 1.01


async def test_a_stream_is_followed_in_time_to_its_last_point(link: Wire, listener: Wire) -> None:
    """In time by its own reports, and by the clock here.

    There is a report for every other period of its control, so that they tell exactly how long the
    motion was; it begins 0.05 s after the first point. By the clock here it was also as long as
    this process waited for the processor before it sent the first point's successors and read the
    last report: up to 0.2 s beside two busy loops.
    """
    count, period = 40, 0.02
    assert await link.ask(point(0, HOME, 0.0)) == SUCCESS
    started = asyncio.get_running_loop().time()
    for index in range(1, count + 1):
        part = 0.5 - 0.5 * math.cos(math.pi * index / count)
        assert await link.ask(point(index, turned(1, 0.2 * part), period)) == SUCCESS
    rounds = await listener.until_rest_after_motion()
    took = asyncio.get_running_loop().time() - started
    assert rounds[-1][0].joints[:6] == pytest.approx(turned(1, 0.2), abs=1e-6)
    assert rounds[-1][1].error_code == 0
    assert count * period <= len(rounds) * REPORT_PERIOD < count * period + 0.1
    assert count * period <= took < count * period + 1.0 * SCALE
    assert sharpest(rounds) <= ACCELERATION * 1.05


@pytest.mark.parametrize(
    ("error", "wrong"),
    [
        (101, point(0, turned(2, math.nan), 1.0)),
        (101, point(0, turned(2, -math.inf), 1.0)),
        (101, point(0, turned(2, 0.1), math.nan)),
        (101, point(0, HOME, 1.0, math.nan)),
        (101, point(0, [*HOME, 0.0, 0.0, 0.0, math.inf], 1.0)),
        (102, point(0, turned(0, 6.3), 10.0)),
        (103, point(0, turned(0, 1.0), 0.3)),
        (103, point(0, turned(0, 0.1), 1.0, 1.5)),
        (104, point(0, turned(0, 0.1), 0.1)),
        (105, point(0, turned(0, 0.1), -1.0)),
        (107, point(0, turned(0, 0.1), 0.0)),
    ],
)
async def test_a_point_that_may_not_be_is_refused_and_shown(
    link: Wire, listener: Wire, error: int, wrong: JointTrajPt
) -> None:
    assert await link.ask(wrong) == FAILURE
    shown = (await listener.rounds(lambda status: status.in_error == 1))[-1]
    assert shown[1].error_code == error
    assert shown[1].motion_possible == 1
    assert shown[0].joints[:6] == pytest.approx(HOME, abs=1e-6)
    await begin(link, 0.05, 0.2)
    assert (await listener.rounds(lambda status: status.in_motion == 1))[-1][1].in_error == 0


@pytest.mark.parametrize(
    ("error", "wrong"),
    [
        (106, point(3, HOME, 1.0)),
        (106, point(-3, HOME, 1.0)),
        (101, point(1, [math.nan], 1.0)),
    ],
)
@beside_others
async def test_a_wrong_point_in_motion_ends_it_on_a_ramp(
    link: Wire, listener: Wire, error: int, wrong: JointTrajPt
) -> None:
    await begin(link)
    await moving(listener)
    assert await link.ask(wrong) == FAILURE
    rounds = await listener.until_rest()
    assert rounds[-1][1].error_code == error
    assert rounds[-1][0].joints[0] < 0.5
    assert sharpest(rounds) <= ACCELERATION * 1.01
    assert await link.ask(point(1, HOME, 1.0)) == FAILURE


@beside_others
async def test_the_same_point_again_is_taken_once(link: Wire, listener: Wire) -> None:
    for _ in range(3):
        await begin(link, 0.05, 0.2)
    rounds = await listener.until_rest_after_motion()
    assert rounds[-1][0].joints[0] == pytest.approx(0.05)


@pytest.mark.parametrize("by_another", [False, True])
@pytest.mark.parametrize("as_topic", [False, True])
@beside_others
async def test_a_stop_brings_the_robot_to_rest_on_a_ramp(
    link: Wire, other: Wire, listener: Wire, by_another: bool, as_topic: bool
) -> None:
    await begin(link)
    await moving(listener)
    stopping = other if by_another else link
    if as_topic:
        stopping.writer.write(CODEC.encode(replace(STOP, comm_type=1)))
    else:
        assert await stopping.ask(STOP) == SUCCESS
    rounds = await listener.until_rest()
    assert 0.1 < rounds[-1][0].joints[0] < 0.6
    assert sharpest(rounds) <= ACCELERATION * 1.01
    assert rounds[-1][1].in_error == 0
    await asyncio.sleep(0.05)
    assert await stopping.is_silent(0.05)
    await begin(link, 0.7)


@beside_others
async def test_a_stop_at_rest_and_while_stopping_is_a_success(link: Wire, listener: Wire) -> None:
    assert await link.ask(STOP) == SUCCESS
    await begin(link)
    assert await link.ask(STOP) == SUCCESS
    await begin(link)
    await moving(listener)
    for _ in range(3):
        assert await link.ask(STOP) == SUCCESS
    assert (await listener.until_rest())[-1][0].joints[0] < 0.5


@beside_others
async def test_a_new_trajectory_waits_until_the_robot_rests(link: Wire, listener: Wire) -> None:
    await begin(link, 0.2, 0.3)
    await listener.rounds(lambda status: status.in_motion == 1)
    await begin(link, -0.2, 0.3)
    ways = [message.joints[0] for message, _ in await listener.until_rest()]
    assert ways[-1] == pytest.approx(-0.2)
    assert max(ways) == pytest.approx(0.2)


@beside_others
async def test_a_full_buffer_delays_replies_but_no_stop_behind(link: Wire, listener: Wire) -> None:
    time = asyncio.get_running_loop().time
    points = [point(i, turned(0, STEP * (i + 1)), STEP * 8) for i in range(BUFFER + 4)]
    link.writer.write(b"".join(map(CODEC.encode, points)))
    arrived = []
    for _ in range(BUFFER + 2):
        assert await link.code() == SUCCESS
        arrived.append(time())
    assert arrived[-1] - arrived[-2] > STEP * 2
    link.writer.write(CODEC.encode(STOP))
    assert [await link.code() for _ in range(3)] == [FAILURE, FAILURE, SUCCESS]
    rounds = await listener.until_rest_after_motion()
    assert rounds[-1][0].joints[0] < STEP * BUFFER / 2
    assert rounds[-1][1].error_code == 0


@beside_others
async def test_a_stream_that_ends_at_speed_is_an_under_run(link: Wire, listener: Wire) -> None:
    for index in range(20):
        way = 0.5 * 6.0 * (0.02 * (index + 1)) ** 2
        assert await link.ask(point(index, turned(0, way), 0.02)) == SUCCESS
    rounds = await listener.until_rest_after_motion()
    assert rounds[-1][1].error_code == 109
    assert sharpest(rounds) <= ACCELERATION * 1.05


@beside_others
async def test_only_the_owner_of_a_motion_may_send_its_points(
    link: Wire, other: Wire, listener: Wire
) -> None:
    await begin(link, 0.3, 0.3)
    assert await other.ask(point(1, turned(0, 0.4), 1.0)) == FAILURE
    assert await other.ask(point(0, turned(0, math.nan), 1.0)) == FAILURE
    rounds = await listener.until_rest_after_motion()
    assert rounds[-1][0].joints[0] == pytest.approx(0.3)
    assert rounds[-1][1].in_error == 0
    await begin(other, 0.2, 0.3)


@beside_others
async def test_a_lost_link_stops_its_own_motion_only(controller: Controller) -> None:
    async with controller.listener() as listener:
        async with controller.link() as link:
            async with controller.link():
                await begin(link)
                await moving(listener)
            await asyncio.sleep(0.1)
            assert (await listener.status()).error_code == 0
        rounds = await listener.until_rest()
        assert rounds[-1][1].error_code == 111
        assert rounds[-1][0].joints[0] < 0.8
        assert sharpest(rounds) <= ACCELERATION * 1.01


@beside_others
async def test_a_trajectory_may_go_on_over_another_link_at_rest(controller: Controller) -> None:
    last = point(1, turned(0, 0.1), 0.2)
    async with controller.listener() as listener:
        async with controller.link() as link:
            assert await link.ask(point(0, HOME, 0.0)) == SUCCESS
            assert await link.ask(last) == SUCCESS
            await listener.rounds(lambda status: status.in_motion == 1)
            await listener.until_rest()
        async with controller.link() as link:
            assert await link.ask(last) == SUCCESS
            assert await link.ask(point(2, HOME, 0.2)) == SUCCESS


@beside_others
async def test_an_emergency_stop_and_its_reset_show_in_the_status(
    controller: Controller, link: Wire, listener: Wire
) -> None:
    await begin(link)
    await moving(listener)
    controller.press(signal.SIGUSR1)
    rounds = await listener.rounds(lambda status: status.e_stopped == 1)
    rounds += await listener.until_rest()
    status = rounds[-1][1]
    assert (status.drives_powered, status.motion_possible) == (0, 0)
    assert sharpest(rounds) <= ACCELERATION * 1.01
    assert await link.ask(point(0, HOME, 2.0)) == FAILURE
    controller.press(signal.SIGUSR2)
    status = (await listener.rounds(lambda status: status.e_stopped == 0))[-1][1]
    assert (status.drives_powered, status.motion_possible, status.in_motion) == (1, 1, 0)
    await begin(link, 0.7)


@beside_others
async def test_a_joint_near_the_end_of_its_range_stops_inside(program: Path) -> None:
    controller = await Controller.start(program, joints=(0.0, 6.0))
    async with controller.link() as link, controller.listener() as listener:
        assert await link.ask(point(0, (3.0, 6.28), 1.0)) == SUCCESS
        await listener.rounds(lambda status: status.in_motion == 1)
        await asyncio.sleep(0.85)
        assert await link.ask(STOP) == SUCCESS
        rounds = await listener.until_rest()
        assert max(message.joints[1] for message, _ in rounds) <= 6.28319
        assert sharpest(rounds) <= ACCELERATION * 1.05
    await controller.end()


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (CODEC.encode(Ping()), SUCCESS),
        (struct.pack("<14i", 52, 1, 2, 0, *[0] * 10), SUCCESS),
        (CODEC.encode(GetVersion()), FAILURE),
        (struct.pack("<4i", 12, 99, 2, 0), FAILURE),
        (struct.pack("<4i", 12, 2001, 2, 0), FAILURE),
        (struct.pack("<4i", 148, 14, 2, 0) + bytes(136), FAILURE),
        (struct.pack("<5i", 16, 11, 2, 0, 0), FAILURE),
        (struct.pack("<4i", 12, 11, 2, 0), FAILURE),
        (struct.pack("<4i", 12, 99, 2, 1), FAILURE),
    ],
)
async def test_every_request_has_one_bare_reply(
    link: Wire, listener: Wire, request_: bytes, code: int
) -> None:
    assert await link.ask(request_) == code
    assert await link.is_silent(0.02)
    assert (await listener.status()).error_code == 0


@pytest.mark.parametrize(
    "frame",
    [
        struct.pack("<4i", 12, 99, 1, 0),
        struct.pack("<4i", 12, 1, 3, 1),
        struct.pack("<4i", 12, 1, 1, 0),
        struct.pack("<4i", 12, 0, 2, 0),
        struct.pack("<4i", 12, 1, 0, 0),
        struct.pack("<4i", 12, 1, 77, 0),
        CODEC.encode(replace(point(0, HOME, 1.0), comm_type=1)),
    ],
)
async def test_topics_and_replies_are_never_answered(link: Wire, frame: bytes) -> None:
    link.writer.write(frame)
    assert await link.ask(Ping()) == SUCCESS
    assert await link.is_silent(0.02)


async def test_frames_arrive_in_any_portions(link: Wire, listener: Wire) -> None:
    stream = CODEC.encode(Ping()) + CODEC.encode(point(0, HOME, 0.0))
    stream += CODEC.encode(point(1, turned(0, 0.02), 0.2))
    for at in range(len(stream)):
        link.writer.write(stream[at : at + 1])
        await asyncio.sleep(0)
    assert [await link.code(kind) for kind in (1, 11, 11)] == [SUCCESS] * 3
    await listener.rounds(lambda status: status.in_motion == 1)
    link.writer.write(CODEC.encode(Ping()) * 200)
    assert [await link.code(1) for _ in range(200)] == [SUCCESS] * 200


@pytest.mark.parametrize("length", [0, -1, 1, 11, 1020, 65_536, 2**31 - 1, -(2**31)])
async def test_a_length_that_cannot_be_closes_the_link(controller: Controller, length: int) -> None:
    async with controller.link() as link:
        link.writer.write(struct.pack("<i", length))
        assert await link.is_closed()
    async with controller.link() as link:
        assert await link.ask(Ping()) == SUCCESS


async def test_garbage_harms_nobody(controller: Controller) -> None:
    noise = random.Random(7)
    async with controller.listener() as listener, controller.link() as good:
        for _ in range(60):
            async with controller.link() as link:
                body = noise.randbytes(noise.randrange(1, 3_000))
                length = noise.choice((12, 16, 64, 64, 64, 700, 1019))
                head = struct.pack("<5i", length, noise.choice((1, 11, 11, 13)), 2, 0, 0)
                link.writer.write(noise.choice((head, b"")) + body)
                with contextlib.suppress(ConnectionError):
                    await link.writer.drain()
        assert await good.ask(Ping()) == SUCCESS
        assert (await listener.until_rest())[-1][1].e_stopped == 0


async def test_a_hundred_connections_leave_room_for_the_next(controller: Controller) -> None:
    for connect in (controller.link, controller.listener):
        async with contextlib.AsyncExitStack() as stack:
            for _ in range(50):
                await stack.enter_async_context(connect())
        await asyncio.sleep(0.05)
    async with controller.link() as link, controller.listener() as listener:
        assert await link.ask(Ping()) == SUCCESS
        assert (await listener.status()).e_stopped == 0


def deaf(port: int, receive_buffer: int = 1) -> socket.socket:
    """Connect with a small receive buffer; the system has a smallest one.

    Args:
        receive_buffer: bytes. Whoever is to send must have one that the window fits: in a smaller
            one the system drops segments, with the acknowledgements on them, and sending stands
            still for as long.
    """
    peer = socket.socket()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    peer.connect(("127.0.0.1", port))
    peer.setblocking(False)
    return peer


@beside_others
async def test_who_reads_no_reports_is_dropped_and_holds_up_nobody(
    controller: Controller,
) -> None:
    with deaf(controller.state) as peer:
        async with controller.link() as link, controller.listener() as listener:
            await begin(link, 0.3, 0.5)
            await listener.rounds(lambda status: status.in_motion == 1)
            rounds = await listener.until_rest()
            assert rounds[-1][0].joints[0] == pytest.approx(0.3)
            assert sharpest(rounds) <= ACCELERATION * 1.01
            for _ in range(50):
                await listener.status()
        with contextlib.suppress(ConnectionError):
            async with asyncio.timeout(5 * SCALE):
                while await asyncio.get_running_loop().sock_recv(peer, 65_536):
                    pass


async def test_who_reads_no_replies_is_dropped_and_holds_up_nobody(controller: Controller) -> None:
    with deaf(controller.motion, receive_buffer=32_768) as peer:
        async with controller.link() as link, controller.listener() as listener:
            await begin(link, 0.3, 0.5)
            flood = CODEC.encode(Ping()) * 2_000_000
            with pytest.raises(ConnectionError):
                async with asyncio.timeout(20 * SCALE):
                    await asyncio.get_running_loop().sock_sendall(peer, flood)
            rounds = await listener.until_rest_after_motion()
            assert rounds[-1][0].joints[0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("0", "0"),
        ("0", "0", "0"),
        ("0", "0", "11"),
        ("0", "0", "1", "nan"),
        ("0", "0", "1", "9"),
    ],
)
async def test_wrong_arguments_are_told_in_one_line(program: Path, words: tuple[str, ...]) -> None:
    process = await asyncio.create_subprocess_exec(
        program, *words, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    _, errors = await asyncio.wait_for(process.communicate(), PATIENCE)
    assert (process.returncode, errors.count(b"\n")) == (2, 1)
