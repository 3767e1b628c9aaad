"""A program that was asked for and is still being loaded.

Owns what everybody may see of it meanwhile. That it is loaded, and what ends that, is the business
of the shelf and of the desk.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import ProgramRun, ProgramState

from ..authority import Holder
from ..outgoing import Send
from ..pendant.replies import verdict
from ..refusal import Refusal
from .running_program import RunningProgram


@dataclass(frozen=True, slots=True, eq=False)
class Loading:
    """A request to run a program, which has no verdict yet; each is another.

    Attributes:
        by: who asked.
        message: for what.
    """

    by: Holder
    message: ProgramRun

    @property
    def shown(self) -> RunningProgram:
        """What everybody may see of the program; it is in the way of any other motion."""
        return RunningProgram(self.message.program, ProgramState.NONE, 0, self.message.revision)

    def verdict(self, refusal: Refusal | None = None) -> Send:
        """Return the answer to the request."""
        return Send(self.by.session, verdict(self.message.request_id, refusal))
