"""Whether the controller says that it is emulated: the question, and what its answers are worth.

Owns when it is asked, how long an answer is waited for, and what a late, second or contradicting
one means. The question is OPERATOR_EVENT with the action IDENTIFY, which does nothing. It is asked
once at each connect, and on the state connection only: there vendors' programs read nothing, while
some of their motion servers end on a message that they do not know. Silence means a real one.
"""

from __future__ import annotations

from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent
from openpendant.simplemsg.verdicts import VerdictCode

from ..events.effects import Effect, LogLine, QueryController
from ..refusal import Refusal
from .execution.feedback import Feedback

PATIENCE_NS = 2_000_000_000
"""An answer that takes longer says nothing: whoever gives it is taken for a real controller."""


class Identification:
    """Asks the controller of a cell what it is, and keeps `Feedback.says_emulated`."""

    def __init__(self, feedback: Feedback) -> None:
        """Have nobody to ask yet.

        Args:
            feedback: what the controller says of itself; forgets it all with the connection.
        """
        self._feedback = feedback
        self._asked = 0
        self._said: bool | None = None  # what the first answer on this connection was taken for
        self._is_told = False  # that an answer too many or too late came

    def link(self, up: bool, now: int) -> list[Effect]:
        """Take note that the state connection came or went; ask on a new one."""
        self._feedback.says_emulated = False
        self._said, self._is_told, self._asked = None, False, now
        return [QueryController(OperatorEvent(OperatorAction.IDENTIFY))] if up else []

    def answered(self, reply_code: int, now: int) -> list[Effect] | Refusal:
        """Take an answer, asked for or not.

        The first one in time counts. No later one makes a controller emulated; one that says
        otherwise takes that back until the next connect.

        Returns:
            A line for the log where it is odd, once a connection; why nothing may move on where
            the controller contradicts what it was believed.
        """
        says_so = reply_code == ReplyCode.SUCCESS
        late = now - self._asked
        if self._said is None and late <= PATIENCE_NS:
            self._said = self._feedback.says_emulated = says_so
            return []
        if self._said is None:
            self._said = False
            after = f"{late / 1e9:.1f} s after it was asked, more than {PATIENCE_NS / 1e9:g} s"
            return self._odd(f"the controller said whether it is emulated {after}")
        if self._feedback.says_emulated and not says_so:
            self._said = self._feedback.says_emulated = False
            text = "the controller said that it is emulated, and then that it is not"
            return Refusal(VerdictCode.CONTROLLER_MISMATCH, text)
        return self._odd("the controller said more than once whether it is emulated")

    def _odd(self, what: str) -> list[Effect]:
        if self._is_told:
            return []
        self._is_told = True
        taken_for = "emulated" if self._feedback.says_emulated else "a real one"
        return [LogLine(f"{what}; it is taken for {taken_for}")]
