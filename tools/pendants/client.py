"""The asyncio client library of the pendant protocol.

    async with await PendantClient.connect("127.0.0.1", 11010, client="my pendant") as pendant:
        await pendant.take_control()
        move = await pendant.move_joints([0.0, -1.2, 1.2, -1.5, -1.5, 0.0], speed=0.2)
        await move.done()

Angles are radians, lengths metres, quaternions x, y, z, w. It speaks the public protocol and
imports nothing of the server. Every refusal arrives as `Refused`, every aborted motion as
`Aborted`, both with the code of the catalogue and the numbers.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from openpendant.simplemsg import (
    JOINT_SLOTS,
    PENDANT,
    ByteOrder,
    CommType,
    Connection,
    FramingFault,
    HeaderOnly,
    Malformed,
    Message,
    Ping,
    ReplyCode,
    Role,
    Unasked,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    Hello,
    HelloReply,
    JointMove,
    JointPath,
    JointWaypoint,
    Management,
    Motion,
    Outcome,
    OutcomeKind,
    PoseMove,
    PosePath,
    PoseWaypoint,
    ResetStop,
    SoftwareStop,
    State,
    StopChanged,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

DEFAULT_PORT = 11010
"""The server's pendant port where its configuration says nothing else."""

REPLY_TIMEOUT = 35.0
"""A verdict comes after planning, which the server ends after 30 s."""

_PING_PERIOD = 10.0


class PendantError(Exception):
    """Base of what this library raises."""


class ConnectionLost(PendantError):
    """The server closed the connection, or it broke."""


class Refused(PendantError):
    """The server refused a request; nothing moved because of it.

    Attributes:
        code: entry of the catalogue.
        text: one sentence with the numbers.
        joint: index of the joint at fault, -1 for none.
        value: the value at fault, SI.
        limit: the limit that it breaks, SI.
        remedy: what to do about it.
    """

    def __init__(self, code: int, text: str, joint: int, value: float, limit: float) -> None:
        known = code in set(VerdictCode)
        self.code: VerdictCode | int = VerdictCode(code) if known else code
        self.text = text
        self.joint = joint
        self.value = value
        self.limit = limit
        self.remedy = CATALOGUE[VerdictCode(code)].remedy if known else ""
        name = VerdictCode(code).name if known else str(code)
        super().__init__(f"{name}: {text}")


class Aborted(Refused):
    """A motion that had begun was aborted."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the tool is.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
        frame: frame in which both are given.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    frame: str = "base"


@dataclass(frozen=True, slots=True)
class MotionResult:
    """A completed motion.

    Attributes:
        plan_time: time that planning took [s].
        motion_time: planned duration [s].
    """

    plan_time: float
    motion_time: float


class MotionHandle:
    """A motion that the server accepted and began.

    Attributes:
        request_id: its number.
    """

    def __init__(self, request_id: int, outcome: asyncio.Future[Outcome]) -> None:
        """Made by the client's move methods."""
        self.request_id = request_id
        self._outcome = outcome

    async def done(self) -> MotionResult:
        """Wait until the motion ended; cancelling the wait does not stop the robot.

        Raises:
            Aborted: the motion did not arrive.
            ConnectionLost: the connection ended first.
        """
        outcome = await asyncio.shield(self._outcome)
        if outcome.outcome != OutcomeKind.COMPLETED:
            raise Aborted(outcome.code, outcome.text, outcome.joint, outcome.value, outcome.limit)
        return MotionResult(outcome.plan_time, outcome.motion_time)


class _Wire(asyncio.Protocol):
    """Bytes to messages; nothing else."""

    def __init__(self, client: PendantClient) -> None:
        self._client = client
        self.wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        self.transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def data_received(self, data: bytes) -> None:
        while True:
            for received in self.wire.receive(data):
                if not isinstance(received, Malformed | Unasked):
                    self._client._take(received)
            if not self.wire.more:
                break
            data = b""
        if self.wire.fault is not None:
            self._client._lost(self.wire.fault)

    def connection_lost(self, exc: Exception | None) -> None:
        self.transport = None
        self._client._lost(exc)


class PendantClient:
    """One connection to a pendant server.

    Attributes:
        hello: what the server said of itself.
        state: the newest state message, None before the first.
        on_state: called with every state message.
        on_authority: called when the motion authority changes hands.
        on_stop: called when a stop is latched or reset.
    """

    hello: HelloReply

    def __init__(self) -> None:
        """Use `connect` instead."""
        self.state: State | None = None
        self.on_state: Callable[[State], None] | None = None
        self.on_authority: Callable[[AuthorityChanged], None] | None = None
        self.on_stop: Callable[[StopChanged], None] | None = None
        self._wire = _Wire(self)
        # Replies come in the order of verdicts, not of requests: a planned motion is answered
        # late. Each is found by its request id; hello has none and waits under 0.
        self._verdicts: dict[int, asyncio.Future[Message]] = {}
        self._outcomes: dict[int, asyncio.Future[Outcome]] = {}
        self._states: list[asyncio.Future[State]] = []
        self._last_request = 0
        self._error: PendantError | None = None
        self._keeping: asyncio.Task[None] | None = None
        self._beating: asyncio.Task[None] | None = None
        self._closed = asyncio.Event()

    @classmethod
    async def connect(
        cls,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        client: str = "pendant",
        cell: str = "",
        state_rate: float = 25.0,
    ) -> Self:
        """Connect and say hello.

        Args:
            host: address of the server.
            port: its pendant port.
            client: name of this pendant, shown to others; at most 32 bytes.
            cell: name of the cell, empty for the only one.
            state_rate: state messages wanted, Hz; 0 for none.

        Returns:
            A connected client; close it, or use it as a context manager.

        Raises:
            OSError: nobody listens there.
            Refused: the server does not want us.
            ConnectionLost: the connection ended before the hello was answered.
        """
        pendant = cls()
        loop = asyncio.get_running_loop()
        await loop.create_connection(lambda: pendant._wire, host, port)
        try:
            reply = await pendant._ask(
                Hello(
                    protocol_version=PROTOCOL_VERSION,
                    state_rate=state_rate,
                    cell=cell,
                    client=client,
                ),
                0,
            )
            if not isinstance(reply, HelloReply):
                raise ConnectionLost(f"the server answered hello with {reply}")
        except BaseException:
            await pendant.close()
            raise
        pendant.hello = reply
        pendant._keeping = loop.create_task(pendant._repeat(Ping, _PING_PERIOD))
        return pendant

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """End the connection; what it was moving is stopped by the server."""
        await _end(self._keeping)
        await _end(self._beating)
        transport = self._wire.transport
        if transport is not None:
            transport.close()
            await self._closed.wait()

    async def _repeat(self, make: Callable[[], Message], period: float) -> None:
        """Send a message again and again, until cancelled or the connection ends."""
        with contextlib.suppress(ConnectionLost):
            while True:
                await asyncio.sleep(period)
                self._write(make())

    def _write(self, message: Message) -> None:
        if self._error is not None:
            raise self._error
        transport = self._wire.transport
        if transport is None:
            raise ConnectionLost("not connected")
        transport.write(self._wire.wire.send(message))

    def _new_request(self) -> int:
        self._last_request += 1
        return self._last_request

    async def _ask(self, request: Message, request_id: int) -> Message:
        """Send a request and wait for its verdict.

        Raises:
            Refused: the verdict is a failure.
            ConnectionLost: the connection ended, or no verdict came.
        """
        future: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._verdicts[request_id] = future
        try:
            self._write(request)
            async with asyncio.timeout(REPLY_TIMEOUT):
                reply = await future
        except TimeoutError:
            raise ConnectionLost(f"no verdict within {REPLY_TIMEOUT:g} s") from None
        finally:
            self._verdicts.pop(request_id, None)
        if isinstance(reply, Verdict) and reply.reply_code != ReplyCode.SUCCESS:
            raise Refused(reply.code, reply.text, reply.joint, reply.value, reply.limit)
        return reply

    def _take(self, message: Message) -> None:
        """Sort a message of the server."""
        match message:
            case State():
                self.state = message
                waiting, self._states = self._states, []
                for future in waiting:
                    if not future.done():
                        future.set_result(message)
                if self.on_state is not None:
                    self.on_state(message)
            case Verdict(request_id=request_id) | Management(request_id=request_id):
                self._settle(request_id, message)
            case HelloReply():
                self._settle(0, message)
            case Outcome(request_id=request_id):
                outcome = self._outcomes.pop(request_id, None)
                if outcome is not None and not outcome.done():
                    outcome.set_result(message)
            case AuthorityChanged():
                if self.on_authority is not None:
                    self.on_authority(message)
            case StopChanged():
                if self.on_stop is not None:
                    self.on_stop(message)
            case HeaderOnly(comm_type=CommType.REPLY):
                self._lost(ConnectionLost(f"the server does not know type {message.msg_type}"))

    def _settle(self, request_id: int, message: Message) -> None:
        future = self._verdicts.get(request_id)
        if future is not None and not future.done():
            future.set_result(message)

    def _lost(self, cause: Exception | None) -> None:
        """End everything that waits; called once or more when the connection is over."""
        if self._error is None:
            reason = str(cause) if cause else "the server closed the connection"
            self._error = cause if isinstance(cause, PendantError) else ConnectionLost(reason)
        if isinstance(cause, FramingFault) and self._wire.transport is not None:
            self._wire.transport.abort()
        waiting: list[asyncio.Future[Any]] = [
            *self._verdicts.values(),
            *self._outcomes.values(),
            *self._states,
        ]
        for future in waiting:
            if not future.done():
                future.set_exception(self._error)
                # Nobody may be waiting for it any more; that is no fault of its own.
                future.exception()
        self._outcomes.clear()
        if self._wire.transport is None:
            self._closed.set()

    async def take_control(self) -> None:
        """Request the motion authority and keep it with beats until released.

        Raises:
            Refused: somebody else has it.
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        await self._ask(
            Authority(request_id=request_id, action=AuthorityAction.REQUEST), request_id
        )
        await _end(self._beating)
        self._beating = asyncio.get_running_loop().create_task(
            self._repeat(AuthorityBeat, self.hello.authority_timeout / 3)
        )

    async def release_control(self) -> None:
        """Give the motion authority back.

        Raises:
            Refused: we do not have it.
            ConnectionLost: the connection ended.
        """
        await _end(self._beating)
        request_id = self._new_request()
        await self._ask(
            Authority(request_id=request_id, action=AuthorityAction.RELEASE), request_id
        )

    @contextlib.asynccontextmanager
    async def control(self) -> AsyncIterator[None]:
        """Hold the motion authority for the length of the context."""
        await self.take_control()
        try:
            yield
        finally:
            with contextlib.suppress(PendantError):
                await self.release_control()

    async def _motion(self, request: Message, request_id: int) -> MotionHandle:
        outcome: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        self._outcomes[request_id] = outcome
        try:
            await self._ask(request, request_id)
        except BaseException:
            self._outcomes.pop(request_id, None)
            outcome.cancel()
            raise
        return MotionHandle(request_id, outcome)

    async def move_joints(self, joints: Sequence[float], *, speed: float = 0.1) -> MotionHandle:
        """Move all joints in a straight joint line.

        Args:
            joints: (n,) target, controller side [rad, m for a linear axis].
            speed: fraction of the joints' largest speed, above 0, up to 1.

        Returns:
            The motion, accepted and begun; await its `done`.

        Raises:
            Refused: out of range, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        request = JointMove(request_id=request_id, speed=speed, joints=joint_array(joints))
        return await self._motion(request, request_id)

    async def move_to_pose(
        self, pose: Pose, *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool to a pose, by PTP or in a straight line (`Motion.LIN`).

        Raises:
            Refused: unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        request = PoseMove(
            request_id=request_id,
            motion=motion,
            speed=speed,
            frame=pose.frame,
            position=pose.position,
            orientation=pose.orientation,
        )
        return await self._motion(request, request_id)

    async def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float = 0.1
    ) -> MotionHandle:
        """Move through joint positions without stopping; where the robot stands is implied.

        Raises:
            Refused: out of range, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        request = JointPath(
            request_id=request_id,
            speed=speed,
            waypoints=tuple(JointWaypoint(joints=joint_array(point)) for point in waypoints),
        )
        return await self._motion(request, request_id)

    async def follow_poses(
        self, poses: Sequence[Pose], *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool through poses: PTP passes them without stopping, LIN stops at each.

        Raises:
            ValueError: the poses are given in several frames.
            Refused: a pose is unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        frames = {pose.frame for pose in poses}
        if len(frames) != 1:
            raise ValueError(f"the poses of one path need one frame, not {sorted(frames)}")
        request_id = self._new_request()
        request = PosePath(
            request_id=request_id,
            motion=motion,
            speed=speed,
            frame=frames.pop(),
            waypoints=tuple(
                PoseWaypoint(position=pose.position, orientation=pose.orientation) for pose in poses
            ),
        )
        return await self._motion(request, request_id)

    async def stop(self, reason: str = "stop") -> None:
        """Stop the robot and latch the software stop; anybody may. It is no safety device.

        Raises:
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        await self._ask(SoftwareStop(request_id=request_id, reason=reason), request_id)

    async def reset_stop(self) -> None:
        """Unlatch the software stop; moves nothing.

        Raises:
            Refused: we do not have the motion authority, or the robot still moves.
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        await self._ask(ResetStop(request_id=request_id), request_id)

    async def subscribe(self, state_rate: float) -> None:
        """Choose the rate of state messages, Hz; 0 for none.

        Raises:
            Refused: the rate is not 0 or 1 to 125.
            ConnectionLost: the connection ended.
        """
        request_id = self._new_request()
        await self._ask(Subscribe(request_id=request_id, state_rate=state_rate), request_id)

    async def snapshot(self) -> dict[str, Any]:
        """Ask for the whole state of the cell: robot, limits, owner, stop, obstacle.

        Raises:
            PendantError: the server refused or the connection ended.
        """
        request_id = self._new_request()
        request = Management(request_id=request_id, body=b'{"op": "snapshot"}')
        reply = await self._ask(request, request_id)
        if not isinstance(reply, Management):
            raise PendantError(f"the server answered with {type(reply).__name__}")
        body: dict[str, Any] = json.loads(reply.body)
        if reply.reply_code != ReplyCode.SUCCESS:
            raise Refused(body.get("code", 0), body.get("text", ""), -1, 0.0, 0.0)
        return body

    async def next_state(self) -> State:
        """Wait for the next state message.

        Raises:
            ConnectionLost: the connection ended.
        """
        if self._error is not None:
            raise self._error
        future: asyncio.Future[State] = asyncio.get_running_loop().create_future()
        self._states.append(future)
        return await future

    async def wait_until(
        self, condition: Callable[[State], bool], *, within: float = 10.0
    ) -> State:
        """Wait for a state that meets a condition.

        Raises:
            TimeoutError: none came within so many seconds.
            ConnectionLost: the connection ended.
        """
        async with asyncio.timeout(within):
            while True:
                state = await self.next_state()
                if condition(state):
                    return state

    def joints(self) -> tuple[float, ...]:
        """Return the newest joint positions of the robot's own joints [rad, m].

        Raises:
            PendantError: no position is known yet.
        """
        if self.state is None or not self.state.valid_fields & 2:
            raise PendantError("no joint position is known yet")
        return self.state.positions[: min(self.hello.dof, JOINT_SLOTS)]

    def tool_pose(self) -> Pose:
        """Return the newest tool pose in the base frame.

        Raises:
            PendantError: no position is known yet.
        """
        if self.state is None or not self.state.valid_fields & 16:
            raise PendantError("no tool pose is known yet")
        x, y, z = self.state.tool_position
        qx, qy, qz, qw = self.state.tool_orientation
        return Pose((x, y, z), (qx, qy, qz, qw))


async def _end(task: asyncio.Task[None] | None) -> None:
    if task is not None:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
