"""The presses of one jog that the server may take for held: which are beaten, which to let go of.

Mostly one. While one takes over from another both are, for the server may refuse the new one; so is
one whose verdict was not waited for, because the server may have taken it.
"""

from __future__ import annotations

import asyncio
import contextlib

from openpendant.simplemsg.pendant import State

from .beats import Beats
from .failures import ConnectionLost, Refused, Unanswered
from .joint_values import JogValues
from .motions import PressHandle
from .press_line import PRESS_WITHIN, PressLine, SentPress


class HeldPresses:
    """Which presses are held, as far as this side knows.

    Attributes:
        why_given_up: why all were let go by themselves; empty where they were not.
    """

    def __init__(self, line: PressLine, deadline: float) -> None:
        """Hold none.

        Args:
            line: sends the messages.
            deadline: a press ends so long after a beat was missed [s].
        """
        self.why_given_up = ""
        self._line = line
        self._deadline = deadline
        self._beats: dict[int, Beats] = {}
        self._doubtful: dict[int, SentPress] = {}

    async def press(self, aim: JogValues, state: State) -> PressHandle:
        """Send a press, before anything is awaited; it takes over from those before it.

        Args:
            aim: what it jogs.
            state: the message that it quotes.

        Returns:
            Its motion, begun.

        Raises:
            Refused: it may not begin; one that was held goes on.
            Unanswered: no verdict came within 5 s; all were let go.
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
        """Return why the server must have ended what is held by now [s]; empty where it has not."""
        if not self._beats:
            return ""
        # With a take-over under way it is the new press that must not be late.
        beats = self._beats[max(self._beats)]
        if not beats.are_late(now):
            return ""
        gap = beats.longest_gap(now)
        return f"no beat left for {gap:.3f} s; the deadline is {self._deadline:g} s"

    def beat(self, now: float) -> None:
        """Keep alive what is not late yet [s].

        Raises:
            ConnectionLost: the connection is over.
        """
        for press, beats in self._beats.items():
            if not beats.are_late(now):
                self._line.beat(press, beats.next(now))

    def let_go(self) -> None:
        """End all that may be held, without waiting for the server's word."""
        with contextlib.suppress(ConnectionLost):
            for press in self.unbeaten():
                self._line.let_go(press)

    def unbeaten(self) -> list[int]:
        """Beat none any more; return which are still to be released, the newest first."""
        presses = set() if self.why_given_up else {*self._beats, *self._doubtful}
        self._beats.clear()
        return sorted(presses, reverse=True)

    async def newest(self, motion: PressHandle) -> PressHandle:
        """Return the press that drove the robot last, which may be one that was given up.

        Args:
            motion: the newest that is known to have begun.

        Raises:
            ConnectionLost: the connection ended.
        """
        for press, sent in sorted(self._doubtful.items()):
            if press > motion.press:
                with contextlib.suppress(Refused, Unanswered):
                    motion = await sent.begun()
        self._doubtful.clear()
        return motion
