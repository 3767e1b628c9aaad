"""The messages of a press: start, beats, release, and the account of how it ended.

Owns press numbers and who waits for which account. How long a key is held is `jog`'s business.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from openpendant.simplemsg.pendant import JogBeat, JogEnded, JogRelease, JogStart, State

from .conversation import Conversation
from .joint_values import JogValues, slots
from .motions import JogAccount, PressHandle


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

    async def press(self, press: int, aim: JogValues, deadline: float, state: State) -> PressHandle:
        """Send a press, before anything is awaited; it takes over from one that is held.

        Args:
            press: a number of `next_press`.
            aim: what it jogs.
            deadline: it ends so long after a beat was missed [s].
            state: of `quotable_state`.

        Returns:
            Its motion, begun.

        Raises:
            Refused: it may not begin; one that was held goes on.
            ConnectionLost: the connection ended.
        """
        account: asyncio.Future[JogAccount] = asyncio.get_running_loop().create_future()
        self._accounts[press] = account
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
        try:
            _, motion = await self._conversation.begin_motion(request, request_id)
        except BaseException:
            self._accounts.pop(press, None)
            raise
        return PressHandle(press, motion, account)

    def beat(self, press: int, beat: int) -> None:
        """Keep a press alive.

        Raises:
            ConnectionLost: the connection is over.
        """
        self._conversation.write(JogBeat(press=press, beat=beat))

    async def release(self, press: int) -> None:
        """End a press; the robot ramps to rest.

        Raises:
            Refused: it is not held any more.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        await self._conversation.ask(JogRelease(request_id=request_id, press=press), request_id)

    def ended(self, message: JogEnded) -> None:
        """Take the server's account of a press that came to rest."""
        account = self._accounts.pop(message.press, None)
        if account is not None:
            account.set_result(JogAccount.of(message, self.dof))
