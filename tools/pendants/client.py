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
from collections.abc import AsyncIterator, Callable, Sequence
from types import TracebackType
from typing import Any, Self

from openpendant.simplemsg import JOINT_SLOTS, Message, Ping, ReplyCode, joint_array
from openpendant.simplemsg.pendant import (
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
    PoseMove,
    PosePath,
    PoseWaypoint,
    ResetStop,
    SoftwareStop,
    State,
    StateField,
    StopChanged,
    Subscribe,
)

from .conversation import HELLO, Conversation
from .failures import Aborted, ConnectionLost, PendantError, Refused, WrongArgument
from .motions import MotionHandle, MotionResult, Pose

__all__ = [
    "Aborted",
    "ConnectionLost",
    "Motion",
    "MotionHandle",
    "MotionResult",
    "PendantClient",
    "PendantError",
    "Pose",
    "Refused",
    "State",
    "WrongArgument",
]

DEFAULT_PORT = 11010
"""The server's pendant port where its configuration says nothing else."""

_PING_PERIOD = 10.0


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
        self._conversation = Conversation(self._take_news)
        self._states: list[asyncio.Future[State]] = []
        self._keeping: asyncio.Task[None] | None = None
        self._beating: asyncio.Task[None] | None = None

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
        await loop.create_connection(lambda: pendant._conversation, host, port)
        try:
            reply = await pendant._conversation.ask(
                Hello(
                    protocol_version=PROTOCOL_VERSION,
                    state_rate=state_rate,
                    cell=cell,
                    client=client,
                ),
                HELLO,
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
        self._conversation.close()
        await self._conversation.closed.wait()

    def abort(self) -> None:
        """Break the connection at once, as a program that dies would."""
        self._conversation.abort()

    async def _repeat(self, make: Callable[[], Message], period: float) -> None:
        """Send a message again and again, until cancelled or the connection ends."""
        with contextlib.suppress(ConnectionLost):
            while True:
                await asyncio.sleep(period)
                self._conversation.write(make())

    def _take_news(self, message: Message) -> None:
        match message:
            case State():
                self.state = message
                waiting, self._states = self._states, []
                for future in waiting:
                    if not future.done():
                        future.set_result(message)
                if self.on_state is not None:
                    self.on_state(message)
            case AuthorityChanged() if self.on_authority is not None:
                self.on_authority(message)
            case StopChanged() if self.on_stop is not None:
                self.on_stop(message)

    async def take_control(self) -> None:
        """Request the motion authority and keep it with beats until released.

        Raises:
            Refused: somebody else has it.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        await self._conversation.ask(
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
        request_id = self._conversation.new_request()
        await self._conversation.ask(
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

    async def move_joints(self, joints: Sequence[float], *, speed: float = 0.1) -> MotionHandle:
        """Move all joints in a straight joint line.

        Args:
            joints: (n,) target, controller side [rad, m for a linear axis].
            speed: fraction of the joints' largest speed, above 0, up to 1.

        Returns:
            The motion, accepted and begun; await its `done`.

        Raises:
            Refused: out of range, wrong joint count, not in control, robot busy, …
            WrongArgument: more joints than a message has room for.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        request = JointMove(
            request_id=request_id,
            speed=speed,
            joint_count=len(joints),
            joints=_slots(joints),
        )
        return await self._conversation.begin_motion(request, request_id)

    async def move_to_pose(
        self, pose: Pose, *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool to a pose, by PTP or in a straight line (`Motion.LIN`).

        Raises:
            Refused: unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        request = PoseMove(
            request_id=request_id,
            motion=motion,
            speed=speed,
            frame=pose.frame,
            position=pose.position,
            orientation=pose.orientation,
        )
        return await self._conversation.begin_motion(request, request_id)

    async def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float = 0.1
    ) -> MotionHandle:
        """Move through joint positions without stopping; where the robot stands is implied.

        Raises:
            Refused: out of range, not in control, robot busy, …
            WrongArgument: no waypoints, or waypoints of different lengths.
            ConnectionLost: the connection ended.
        """
        counts = {len(point) for point in waypoints}
        if len(counts) != 1:
            raise WrongArgument(f"the waypoints of one path hold {sorted(counts)} joints each")
        request_id = self._conversation.new_request()
        request = JointPath(
            request_id=request_id,
            speed=speed,
            joint_count=counts.pop(),
            waypoints=tuple(JointWaypoint(joints=_slots(point)) for point in waypoints),
        )
        return await self._conversation.begin_motion(request, request_id)

    async def follow_poses(
        self, poses: Sequence[Pose], *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool through poses: PTP passes them without stopping, LIN stops at each.

        Raises:
            WrongArgument: no poses, or poses in several frames.
            Refused: a pose is unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        frames = {pose.frame for pose in poses}
        if len(frames) != 1:
            raise WrongArgument(f"the poses of one path need one frame, not {sorted(frames)}")
        request_id = self._conversation.new_request()
        request = PosePath(
            request_id=request_id,
            motion=motion,
            speed=speed,
            frame=frames.pop(),
            waypoints=tuple(
                PoseWaypoint(position=pose.position, orientation=pose.orientation) for pose in poses
            ),
        )
        return await self._conversation.begin_motion(request, request_id)

    async def stop(self, reason: str = "stop") -> None:
        """Stop the robot and latch the software stop; anybody may. It is no safety device.

        Raises:
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        await self._conversation.ask(SoftwareStop(request_id=request_id, reason=reason), request_id)

    async def reset_stop(self) -> None:
        """Unlatch the software stop; moves nothing.

        Raises:
            Refused: we do not have the motion authority, or the robot still moves.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        await self._conversation.ask(ResetStop(request_id=request_id), request_id)

    async def subscribe(self, state_rate: float) -> None:
        """Choose the rate of state messages, Hz; 0 for none.

        Raises:
            Refused: the rate is not 0 or 1 to 125.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        await self._conversation.ask(
            Subscribe(request_id=request_id, state_rate=state_rate), request_id
        )

    async def snapshot(self) -> dict[str, Any]:
        """Ask for the whole state of the cell: robot, limits, owner, stop, obstacle.

        Raises:
            PendantError: the server refused or the connection ended.
        """
        request_id = self._conversation.new_request()
        request = Management(request_id=request_id, body=b'{"op": "snapshot"}')
        reply = await self._conversation.ask(request, request_id)
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
        future = self._conversation.expect(State)
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
        if self.state is None or not self.state.valid_fields & StateField.POSITION:
            raise PendantError("no joint position is known yet")
        return self.state.positions[: min(self.hello.dof, JOINT_SLOTS)]

    def tool_pose(self) -> Pose:
        """Return the newest tool pose in the base frame.

        Raises:
            PendantError: no position is known yet.
        """
        if self.state is None or not self.state.valid_fields & StateField.TOOL:
            raise PendantError("no tool pose is known yet")
        x, y, z = self.state.tool_position
        qx, qy, qz, qw = self.state.tool_orientation
        return Pose((x, y, z), (qx, qy, qz, qw))


def _slots(joints: Sequence[float]) -> tuple[float, ...]:
    try:
        return joint_array(joints)
    except ValueError as error:
        raise WrongArgument(str(error)) from None


async def _end(task: asyncio.Task[None] | None) -> None:
    if task is not None:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
