"""The client's view of the cell: the stream of its state, its snapshot, and any data it keeps."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from typing import Any

from openpendant.simplemsg import JOINT_SLOTS, Message
from openpendant.simplemsg.pendant import Management, State, StateField, Subscribe

from .failures import PendantError, WrongArgument
from .management.calls import AsyncCalls
from .management.cell import CellCalls
from .motions import MotionHandle, Pose
from .session import PendantSession

_QUOTABLE = 0.25
"""A press quotes a state message that came at most so long ago; the server takes 0.5 s [s]."""


class Observing(PendantSession, CellCalls, AsyncCalls):
    """State and data, which need no authority."""

    def __init__(self) -> None:
        """Use `connect` instead."""
        PendantSession.__init__(self)
        AsyncCalls.__init__(self, self.manage)
        self._waiting: list[asyncio.Future[State]] = []
        self._last_state = 0.0

    def _state_came(self, state: State) -> None:
        self._last_state = asyncio.get_running_loop().time()
        waiting, self._waiting = self._waiting, []
        for future in waiting:
            if not future.done():
                future.set_result(state)

    async def subscribe(self, state_rate: float) -> None:
        """Choose the rate of state messages, Hz; 0 for none.

        Raises:
            Refused: the rate is not 0 or 1 to 125.
            ConnectionLost: the connection ended.
        """
        await self._ask(lambda request_id: Subscribe(request_id=request_id, state_rate=state_rate))
        self._state_rate = state_rate

    async def next_state(self) -> State:
        """Wait for the next state message.

        Raises:
            ConnectionLost: the connection ended.
        """
        future = self._conversation.expect(State)
        self._waiting.append(future)
        return await future

    async def states(self) -> AsyncIterator[State]:
        """Yield state messages as they come, the newest only: whoever is slow misses some.

        Raises:
            ConnectionLost: the connection ended.
        """
        seen: State | None = None
        while True:
            newest = self.state
            seen = await self.next_state() if newest is None or newest is seen else newest
            yield seen

    async def wait_until(
        self, condition: Callable[[State], bool], *, within: float = 10.0
    ) -> State:
        """Wait for a state that meets a condition.

        Raises:
            TimeoutError: none came within so many seconds.
            ConnectionLost: the connection ended.
        """
        try:
            async with asyncio.timeout(within):
                while True:
                    state = await self.next_state()
                    if condition(state):
                        return state
        except TimeoutError:
            raise TimeoutError(f"no such state came within {within:g} s") from None

    async def _quotable_state(self) -> State:
        """Return a state message that is new enough for a press to quote."""
        if not self._state_rate:
            raise WrongArgument("a jog quotes a state message: subscribe to the state first")
        age = asyncio.get_running_loop().time() - self._last_state
        if self.state is None or age > _QUOTABLE:
            return await self.next_state()
        return self.state

    async def manage(self, request: dict[str, Any]) -> dict[str, Any]:
        """Send a management request, a JSON object with its `op`, and return the answer.

        Raises:
            Refused: the server refused it.
            WrongArgument: it is no JSON, or larger than a frame.
            ConnectionLost: the connection ended.
        """
        body = _body(request)
        reply = await self._ask(lambda request_id: Management(request_id=request_id, body=body))
        return _answer(reply)

    async def _manage_motion(self, request: dict[str, Any]) -> tuple[dict[str, Any], MotionHandle]:
        """Send a management request that moves the robot; return the answer and the motion.

        Raises:
            Refused: the server refused it.
            WrongArgument: it is no JSON, or larger than a frame.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        message = Management(request_id=request_id, body=_body(request))
        reply, motion = await self._conversation.begin_motion(message, request_id)
        return _answer(reply), motion

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


def _body(request: dict[str, Any]) -> bytes:
    try:
        return json.dumps(request, allow_nan=False).encode()
    except (TypeError, ValueError) as error:
        raise WrongArgument(f"the request is no JSON: {error}") from None


def _answer(reply: Message) -> dict[str, Any]:
    if not isinstance(reply, Management):
        raise PendantError(f"the server answered with {type(reply).__name__}")
    answer: dict[str, Any] = json.loads(reply.body)
    return answer
