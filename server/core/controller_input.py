"""What each kind of message of a controller means to a cell.

Owns which message is an answer that was owed, one that nobody asked for, a question to us, or a
report, on each of the three connections. What follows from it is the cell's business.
"""

from __future__ import annotations

from openpendant.simplemsg import (
    CommType,
    Malformed,
    Ping,
    ReplyCode,
    Unasked,
    accepted,
    message_type,
    refused,
)
from openpendant.simplemsg.pendant import OperatorEvent

from ..cell.robot_cell import RobotCell
from ..environment import CellEnvironment
from ..events.effects import AnswerController, Effect
from ..events.events import ControllerReport
from ..settings.cell_settings import ControllerPath

# Each report of each robot comes by here, and members of an enumeration are slow to look up.
_REPLY, _REQUEST = CommType.REPLY, CommType.REQUEST
_NO_MESSAGE = (Unasked, Malformed)
_MOTION, _STATE = ControllerPath.MOTION, ControllerPath.STATE
_IDENTITY = OperatorEvent.PLACE.msg_type


class ControllerInput:
    """The messages of the controller of one cell."""

    def __init__(self, cell: RobotCell, around: CellEnvironment | None) -> None:
        """Join the cell with what surrounds its robot; None in a cell without."""
        self._cell = cell
        self._around = around

    def take(self, event: ControllerReport, now: int) -> list[Effect]:
        """Hand a message of the controller to whom it is for."""
        cell, around = self._cell, self._around
        path, received = event.path, event.message
        if isinstance(received, _NO_MESSAGE):
            return _misheard(cell, path, received, now)
        is_motion = path is _MOTION
        kind = received.comm_type
        if kind == _REPLY:
            if is_motion:
                return cell.answered(received, event.pending, now)
            if path is _STATE and message_type(received) == _IDENTITY:
                return cell.identified(received.reply_code, now)
            asked = around if path is _STATE else None
            return [] if asked is None else asked.answered(received, now)
        if kind == _REQUEST:
            # But for a ping a controller has nothing to ask of us; an answer is still owed.
            is_ping = isinstance(received, Ping)
            return [AnswerController(path, accepted(received) if is_ping else refused(received))]
        if path is not _STATE:
            return []
        out = cell.reported(received, now)
        return out if around is None else out + around.reported(now)


def _misheard(
    cell: RobotCell, path: ControllerPath, received: Unasked | Malformed, now: int
) -> list[Effect]:
    """Take what is no message: an answer that nobody asked for, or one that cannot be read."""
    if path is _STATE:
        return _misidentified(cell, received, now)
    if path is not _MOTION:
        return []
    if isinstance(received, Unasked):
        return cell.misanswered("the controller answered although nothing was asked", now)
    return cell.misanswered(str(received.error), now) if received.comm_type == _REPLY else []


def _misidentified(cell: RobotCell, received: Unasked | Malformed, now: int) -> list[Effect]:
    """Take an answer to whether the controller is emulated that came twice, or cannot be read."""
    if isinstance(received, Malformed):
        is_answer = received.msg_type == _IDENTITY and received.comm_type == _REPLY
        return cell.identified(ReplyCode.FAILURE, now) if is_answer else []
    again = received.message
    return cell.identified(again.reply_code, now) if message_type(again) == _IDENTITY else []
