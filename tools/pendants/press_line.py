"""The messages of a press: start, beats, release, and the account of how it ended.

Owns press numbers and who waits for which account. How long a key is held is `jog`'s business.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import JogBeat, JogEnded, JogRelease, JogStart, State

from .conversation import Conversation
from .failures import PendantError, Refused, Unanswered
from .joint_values import JogValues, slots
from .judging import judged
from .motions import JogAccount, MotionHandle, PressHandle

PRESS_WITHIN = 5.0
"""A press is not planned; without a verdict for so long nobody knows what the key does [s]."""


class SentPress:
    """A press that left, and whose verdict may still be under way.

    Attributes:
        press: its number.
    """

    def __init__(self, motion: PressHandle, verdict: asyncio.Future[Message]) -> None:
        """Made by `PressLine.press`."""
        self.press = motion.press
        self._motion = motion
        self._verdict = verdict
        self._until = asyncio.get_running_loop().time() + PRESS_WITHIN

    async def begun(self) -> PressHandle:
        """Wait until it has begun; whoever cancels this may wait again.

        Raises:
            Refused: it may not begin; one that was held goes on.
            Unanswered: no verdict came within 5 s of the press.
            ConnectionLost: the connection ended.
        """
        left = self._until - asyncio.get_running_loop().time()
        await asyncio.wait({self._verdict}, timeout=max(0.0, left))
        try:
            judged(self._verdict, PRESS_WITHIN)
        except Refused:
            self._motion.forget()
            raise
        except Unanswered:
            if not self._motion.is_over:  # what ended had begun
                raise
        return self._motion


class PressLine:
    """All presses of one connection; a number that was used never moves again.

    Attributes:
        dof: driven joints of the robot.
        quotable_state: returns a state message that is new enough for a press to quote.
    """

    def __init__(
        self, conversation: Conversation, quotable_state: Callable[[], Awaitable[State]], dof: int
    ) -> None:
        """Make a line without a press.

        Args:
            conversation: the connection.
            quotable_state: returns a state message that is new enough for a press to quote.
            dof: driven joints of the robot.
        """
        self.dof = dof
        self.quotable_state = quotable_state
        self._conversation = conversation
        self._accounts: dict[int, asyncio.Future[JogAccount]] = {}
        self._last = 0

    def next_press(self) -> int:
        """Return the number of the next press."""
        self._last += 1
        return self._last

    def check_link(self) -> None:
        """Raise what ended the connection, where something did.

        Raises:
            ConnectionLost: the connection is over.
        """
        if self._conversation.error is not None:
            raise self._conversation.error

    def press(self, press: int, aim: JogValues, deadline: float, state: State) -> SentPress:
        """Send a press; it takes over from one that is held.

        Args:
            press: a number of `next_press`.
            aim: what it jogs.
            deadline: it ends so long after a beat was missed [s].
            state: of `quotable_state`.

        Returns:
            What tells whether it has begun.

        Raises:
            ConnectionLost: the connection is over.
            WrongArgument: it cannot be written.
        """
        request_id = self._conversation.new_request()
        request = JogStart(
            request_id=request_id,
            press=press,
            state_sequence=state.sequence,
            deadline=deadline,
            space=aim.space,
            frame=aim.frame,
            value_count=len(aim.values),
            values=slots(aim.values),
        )
        outcome = self._conversation.expect_outcome(request_id)
        motion = PressHandle(press, MotionHandle(request_id, outcome), self._expect_account(press))
        try:
            return SentPress(motion, self._conversation.send(request, request_id))
        except PendantError:
            motion.forget()
            raise

    def _expect_account(self, press: int) -> asyncio.Future[JogAccount]:
        account: asyncio.Future[JogAccount] = asyncio.get_running_loop().create_future()
        self._accounts[press] = account
        account.add_done_callback(lambda _: self._accounts.pop(press, None))
        return account

    def beat(self, press: int, beat: int) -> None:
        """Keep a press alive.

        Raises:
            ConnectionLost: the connection is over.
        """
        self._conversation.write(JogBeat(press=press, beat=beat))

    def let_go(self, press: int) -> None:
        """End a press, where nobody waits for the server's word on it.

        Raises:
            ConnectionLost: the connection is over.
        """
        request_id = self._conversation.new_request()
        self._conversation.write(JogRelease(request_id=request_id, press=press))

    async def release(self, press: int) -> None:
        """End a press; the robot ramps to rest.

        Raises:
            Refused: it is not held any more.
            Unanswered: no verdict came within 35 s.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        await self._conversation.ask(JogRelease(request_id=request_id, press=press), request_id)

    def ended(self, message: JogEnded) -> None:
        """Take the server's account of a press that came to rest."""
        account = self._accounts.get(message.press)
        if account is not None and not account.done():
            account.set_result(JogAccount.of(message, self.dof))
