"""The client's view of the cell: the stream of its state, its snapshot, and any data it keeps."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from typing import Any

from openpendant.simplemsg import JOINT_SLOTS, Message
from openpendant.simplemsg.pendant import Management, State, StateField, Subscribe
from openpendant.simplemsg.verdicts import VerdictCode

from .connection_errors import PendantError, Refused, StateSilent, WrongArgument, answer_of
from .conversation import REPLY_TIMEOUT
from .management.calls import AsyncCalls
from .management.groups import GroupedCalls
from .motions import MotionHandle, Pose
from .session import PendantSession

_QUOTABLE = 0.25
"""A press quotes a state message that came at most so long ago; the server takes 0.5 s [s].

It waits no longer for one either: a press that leaves late would move the robot late.
"""

_PERIODS = 2
"""Of the state, that a press waits for one."""

_PATIENCE = 0.1
"""Least wait of a press for a state [s]: a busy machine delays frequent state messages."""

_STATES_WITHIN = 5.0
"""Time without a state until a server that answers counts as silent [s]; rates start at 1 Hz."""

_LOGIN_WITHIN = 60.0
"""Likewise, before the first state: who may not look on without a login is sent none, and may be
typing the secret meanwhile [s]."""

_PLANNED = frozenset({"programs.dry_run", "recordings.play"})
"""Operations that are planned, behind those of others, and so are waited for without a bound."""

_UNASKED = "no states were asked for: subscribe to the state first"


class Observing(PendantSession, GroupedCalls[AsyncCalls]):
    """State and data, which need no authority."""

    def __init__(self) -> None:
        PendantSession.__init__(self)
        GroupedCalls.__init__(self, AsyncCalls(self.manage))
        # Who waits for a state, and since when [s].
        self._waiting: dict[asyncio.Future[State], float] = {}
        self._last_state = 0.0

    def _state_came(self, state: State) -> None:
        self._last_state = asyncio.get_running_loop().time()
        for future in list(self._waiting):
            if not future.done():
                future.set_result(state)

    def _misses_states(self, now: float, heard: float) -> bool:
        is_missed = False
        may_be_nobody = self.state is None and self._logged_in is None
        within = _LOGIN_WITHIN if may_be_nobody else _STATES_WITHIN
        for future, since in list(self._waiting.items()):
            begun = max(since, self._last_state, self._logged_in or 0.0)
            is_missed = is_missed or now > begun + within
            if heard > begun + within and not future.done():
                future.set_exception(self._silence(now - begun))
        return is_missed

    def _silence(self, seconds: float) -> StateSilent:
        text = f"no state for {seconds:.0f} s, though the server answers"
        if self._logged_in is None:
            text += "; this connection never logged in: log in where the server has accounts, else"
            return StateSilent(f"{text} connect again and look")
        return StateSilent(f"{text}; connect again and look")

    def _sent_away(self, why: Refused) -> None:
        self._end_waits(why)

    def _end_waits(self, why: PendantError) -> None:
        for future in list(self._waiting):
            if not future.done():
                future.set_exception(why)

    async def subscribe(self, state_rate: float) -> None:
        """Choose the rate of state messages, Hz; 0 for none, which ends every wait for one.

        Raises:
            Refused: the rate is not 0 or 1 to 125.
            ConnectionLost: the connection ended.
        """
        await self._ask(lambda request_id: Subscribe(request_id=request_id, state_rate=state_rate))
        self._state_rate = state_rate
        if not state_rate:
            self._end_waits(WrongArgument(_UNASKED))

    async def next_state(self) -> State:
        """Wait for the next state message.

        Raises:
            Refused: our login ended, and without one we may not look on; log in again.
            StateSilent: the server answers and sends none, for about 5 s; before the first one
                and without a login, which we may have to show first, for about 60 s.
            WrongArgument: none were asked for: the rate is 0, or became 0 meanwhile.
            ConnectionLost: the connection ended.
        """
        if not self._state_rate:
            raise WrongArgument(_UNASKED)
        if self._away is not None:
            raise self._away
        future = self._conversation.expect(State)
        self._waiting[future] = asyncio.get_running_loop().time()
        try:
            return await future
        finally:
            del self._waiting[future]

    async def states(self) -> AsyncIterator[State]:
        """Yield state messages as they come, the newest only: whoever is slow misses some.

        Raises:
            Refused: our login ended, and without one we may not look on.
            StateSilent: none come any more, as in `next_state`.
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
            Refused: our login ended, and without one we may not look on.
            StateSilent: none come any more, as in `next_state`.
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

    @property
    def has_quotable_state(self) -> bool:
        """True if a press would be sent at once; else it waits for a newer state message."""
        age = asyncio.get_running_loop().time() - self._last_state
        return self.state is not None and age <= _QUOTABLE

    async def _quotable_state(self) -> State:
        """Return a state message that is new enough for a press to quote.

        Raises:
            Refused: PRESS_STALE, none came in time.
            WrongArgument: none were asked for.
            ConnectionLost: the connection ended.
        """
        if not self._state_rate:
            raise WrongArgument("a jog quotes a state message: subscribe to the state first")
        if self.state is not None and self.has_quotable_state:
            return self.state
        loop = asyncio.get_running_loop()
        pressed = loop.time()
        patience = self._patience()
        state = None
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(patience):
                await self.next_state()
                # What came at once with it, after a stall of this program, is newer.
                state = self.state
        # A program that hung meanwhile finds both a state and that it is too late for it.
        waited = loop.time() - pressed
        if state is None or waited > patience:
            text = f"no state came within {patience:.3g} s of the press; look at the link"
            raise Refused(VerdictCode.PRESS_STALE, text, -1, waited, patience)
        return state

    def _patience(self) -> float:
        """Return how long a press waits for a state, by the rate that was granted [s]."""
        rate = min(self._state_rate, self.hello.max_state_rate)
        if rate * _QUOTABLE <= _PERIODS:
            return _QUOTABLE
        return max(_PERIODS / rate, _PATIENCE)

    async def manage(self, request: dict[str, Any]) -> dict[str, Any]:
        """Send a management request, a JSON object with its `op`, and return the answer.

        Raises:
            Refused: the server refused it.
            WrongArgument: it is no JSON, or larger than a frame.
            Unanswered: no answer came within 35 s to what is not planned.
            ConnectionLost: the connection ended.
        """
        body = _body(request)
        request_id = self._conversation.new_request()
        message = Management(request_id=request_id, body=body)
        within = None if str(request.get("op")) in _PLANNED else REPLY_TIMEOUT
        return _answer(await self._conversation.ask(message, request_id, within=within))

    async def _manage_motion(self, request: dict[str, Any]) -> tuple[dict[str, Any], MotionHandle]:
        """Send a management request that moves the robot; return the answer and the motion."""
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
    return answer_of(reply)
