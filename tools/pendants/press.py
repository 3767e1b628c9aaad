"""Presses: their messages, their beats, and those of a jog that the server may take as held.

Owns press numbers and the waiters for each account; `jog` decides how long a key is held.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass

from openpendant.simplemsg import Message, joint_array
from openpendant.simplemsg.pendant import JogBeat, JogEnded, JogRelease, JogSpace, JogStart, State

from .connection_errors import (
    ConnectionLost,
    PendantError,
    Refused,
    Unanswered,
    WrongArgument,
    judged,
)
from .conversation import Conversation
from .motions import JogAccount, MotionHandle, PressHandle


def slots(values: Sequence[float]) -> tuple[float, ...]:
    """Return values in the slots of a message, padded with zeros.

    Raises:
        WrongArgument: there are more values than slots.
    """
    try:
        return joint_array(values)
    except ValueError as error:
        raise WrongArgument(str(error)) from None


@dataclass(frozen=True, slots=True)
class JogValues:
    """Aim of a jog or a step: values of some joints, or of the tool.

    Attributes:
        frame: frame of the axes; empty for joints.
        values: (n,) by joint, or (6,) along x, y, z and about x, y, z.
    """

    space: JogSpace
    frame: str
    values: tuple[float, ...]

    @classmethod
    def of_joints(cls, joints: Mapping[int, float], dof: int) -> JogValues:
        """Return values by joint index, 0 for the joints that are not named.

        Raises:
            WrongArgument: the robot has no such joint.
        """
        for index in joints:
            if index not in range(dof):
                raise WrongArgument(f"no joint {index}; the robot has joints 0 to {dof - 1}")
        return cls(JogSpace.JOINTS, "", tuple(joints.get(index, 0.0) for index in range(dof)))

    @classmethod
    def of_tool(cls, values: Sequence[float], frame: str) -> JogValues:
        """Return values along x, y, z and about x, y, z of a frame."""
        return cls(JogSpace.TOOL, frame, tuple(values))


class Beats:
    """Beats of one press: their number, and whether all were sent in time.

    The server ends a press once no beat arrived within the deadline. A beat that was not sent in
    time cannot arrive in time; so the press is over, even before the server's account arrives.
    """

    def __init__(self, deadline: float, now: float) -> None:
        """Start with the press itself, which counts as a beat.

        Args:
            deadline: the longest gap that the server accepts [s].
            now: when the press is sent [s].
        """
        self._deadline = deadline
        self._count = 0
        self._latest = now
        self._longest = 0.0

    def next(self, now: float) -> int:
        """Return the number of the beat that is sent now."""
        self._longest = self.longest_gap(now)
        self._latest = now
        self._count += 1
        return self._count

    def longest_gap(self, now: float) -> float:
        """Return the longest gap between beats so far, including that since the latest [s]."""
        return max(self._longest, now - self._latest)

    def are_late(self, now: float) -> bool:
        """Return True if a beat was sent too late, or the next one is too late by now."""
        return self.longest_gap(now) >= self._deadline


PRESS_WITHIN = 5.0
"""A press is not planned; without a verdict for so long nobody knows what the key does [s]."""


class SentPress:
    """A sent press, whose verdict may still be pending."""

    def __init__(self, motion: PressHandle, verdict: asyncio.Future[Message]) -> None:
        self.press = motion.press
        self._motion = motion
        self._verdict = verdict
        self._until = asyncio.get_running_loop().time() + PRESS_WITHIN

    async def begun(self) -> PressHandle:
        """Wait until it has started; a cancelled wait may be repeated.

        Raises:
            Refused: it may not start; a press that was held continues.
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
    """All presses of one connection; a used number never moves the robot again.

    Whatever sends raises `ConnectionLost` once the connection is over.

    Attributes:
        dof: driven joints of the robot.
        quotable_state: returns a state message that is new enough for a press to quote.
    """

    def __init__(
        self,
        conversation: Conversation,
        quotable_state: Callable[[], Awaitable[State]],
        dof: int,
        enabling: Callable[[], Sequence[Message]],
    ) -> None:
        """Press nothing yet.

        Args:
            enabling: returns the sign of the enabling device that goes in front of each press and
                beat, in one write; nothing where none is held. What falls silent with its key does
                so no sooner: the server ramps the robot to rest, and does not stop it.
        """
        self.dof = dof
        self.quotable_state = quotable_state
        self._enabling = enabling
        self._conversation = conversation
        self._accounts: dict[int, asyncio.Future[JogAccount]] = {}
        self._last = 0

    def next_press(self) -> int:
        """Return the number for the next press."""
        self._last += 1
        return self._last

    def check_link(self) -> None:
        """Raise the error that ended the connection, if it has ended."""
        if self._conversation.error is not None:
            raise self._conversation.error

    def press(self, press: int, aim: JogValues, deadline: float, state: State) -> SentPress:
        """Send a press; it takes over from one that is held.

        Args:
            deadline: it ends so long after a beat was missed [s].

        Raises:
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
            ahead = self._enabling()
            verdict = self._conversation.send(request, request_id, ahead=ahead)
            return SentPress(motion, verdict)
        except PendantError:
            motion.forget()
            raise

    def _expect_account(self, press: int) -> asyncio.Future[JogAccount]:
        account: asyncio.Future[JogAccount] = asyncio.get_running_loop().create_future()
        self._accounts[press] = account
        account.add_done_callback(lambda _: self._accounts.pop(press, None))
        return account

    def beat(self, beats: Mapping[int, int]) -> None:
        """Keep presses alive, each by the number of its next beat."""
        signs = [JogBeat(press=press, beat=beat) for press, beat in beats.items()]
        self._conversation.write(*self._enabling(), *signs)

    def let_go(self, press: int) -> None:
        """End a press without waiting for the server's verdict."""
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
        """Take the server's account of an ended press."""
        account = self._accounts.get(message.press)
        if account is not None and not account.done():
            account.set_result(JogAccount.of(message, self.dof))


class HeldPresses:
    """The held presses of one jog, as this side knows them.

    Attributes:
        why_given_up: why this side released all by itself; empty if it did not.
    """

    def __init__(self, line: PressLine, deadline: float) -> None:
        """Hold none."""
        self.why_given_up = ""
        self._line = line
        self._deadline = deadline
        self._beats: dict[int, Beats] = {}
        self._doubtful: dict[int, SentPress] = {}

    async def press(self, aim: JogValues, state: State) -> PressHandle:
        """Send a press before the first await; it takes over from the earlier ones.

        Raises:
            Refused: it may not start; a press that was held continues.
            Unanswered: no verdict came within 5 s; all were released.
            ConnectionLost: the connection ended.
        """
        press, earlier = self._line.next_press(), list(self._beats)
        sent = self._line.press(press, aim, self._deadline, state)
        self._beats[press] = Beats(self._deadline, asyncio.get_running_loop().time())
        try:
            motion = await sent.begun()
        except (Refused, ConnectionLost):
            self._beats.pop(press, None)
            raise
        except BaseException as error:
            self._beats.pop(press, None)
            self._doubtful[press] = sent
            if isinstance(error, Unanswered):
                # Nobody knows which press drives, so none may.
                within = f"no verdict came within {PRESS_WITHIN:g} s of press {press}"
                self.let_go()
                self.why_given_up = f"{within}, and it let go"
            raise
        for dead in earlier:
            self._beats.pop(dead, None)
        return motion

    def why_late(self, now: float) -> str:
        """Return why the server must have ended the held presses by now [s]; empty if not."""
        if not self._beats:
            return ""
        # With a take-over under way it is the new press that must not be late.
        beats = self._beats[max(self._beats)]
        if not beats.are_late(now):
            return ""
        gap = beats.longest_gap(now)
        return f"no beat left for {gap:.3f} s; the deadline is {self._deadline:g} s"

    def beat(self, now: float) -> None:
        """Send a beat for each press that is not late yet [s].

        Raises:
            ConnectionLost: the connection is over.
        """
        due = {
            press: beats.next(now)
            for press, beats in self._beats.items()
            if not beats.are_late(now)
        }
        if due:
            self._line.beat(due)

    def let_go(self) -> None:
        """End all presses that may be held, without waiting for verdicts."""
        with contextlib.suppress(ConnectionLost):
            for press in self.unbeaten():
                self._line.let_go(press)

    def unbeaten(self) -> list[int]:
        """Stop all beats; return the presses still to be released, the newest first."""
        presses = set() if self.why_given_up else {*self._beats, *self._doubtful}
        self._beats.clear()
        return sorted(presses, reverse=True)

    async def newest(self, motion: PressHandle) -> PressHandle:
        """Return the press that drove the robot last, even if its wait was given up.

        Raises:
            ConnectionLost: the connection ended.
        """
        for press, sent in sorted(self._doubtful.items()):
            if press > motion.press:
                with contextlib.suppress(Refused, Unanswered):
                    motion = await sent.begun()
        self._doubtful.clear()
        return motion
