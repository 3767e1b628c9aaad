"""Management requests of pendants: which part of the server answers which.

Owns the routes, by how the name of an operation begins, and under which name the asker is noted.
What an operation does is the business of the part that has it.
"""

from __future__ import annotations

from collections.abc import Callable

from openpendant.simplemsg import CommType, ReplyCode
from openpendant.simplemsg.pendant import Management

from ..access.desk import AccessDesk
from ..access.operations import PREFIXES as ACCESS_PREFIXES
from ..access.permissions import operation_of
from ..jog.retreat_desk import PREFIX as JOG_PREFIX
from ..jog.retreat_desk import RetreatDesk
from ..outgoing import Outgoing, Send
from ..playback.cell_programs import CellPrograms
from ..playback.operations import PREFIX as PROGRAM_PREFIX
from ..playback.operations import Asker, author_name
from ..recording.operations import PREFIX as RECORDING_PREFIX
from ..robot_cell import RobotCell
from ..settings import CellSettings
from ..world.cell_surroundings import CellSurroundings
from ..world.operations import PREFIXES as WORLD_PREFIXES
from .listeners import Listeners
from .management import answer_management
from .served_cells import ServedCells

_Answer = Callable[[bytes, Asker, int], list[Outgoing]]


class ManagementDesk:
    """The management requests of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        settings: CellSettings,
        listeners: Listeners,
        access: AccessDesk,
        programs: CellPrograms,
        served: ServedCells,
        retreats: RetreatDesk,
    ) -> None:
        """Make a desk that knows no surroundings.

        Args:
            cell: the cell.
            settings: its configuration.
            listeners: the connections.
            access: answers what is about access.
            programs: answers what is about programs.
            served: all cells of the server.
            retreats: tells which key leads out of what holds a jog.
        """
        self._cell = cell
        self._settings = settings
        self._listeners = listeners
        self._served = served
        self._access = access
        self._around: CellSurroundings | None = None
        self._routes: list[tuple[tuple[str, ...], _Answer]] = [
            (ACCESS_PREFIXES, access.operation),
            ((PROGRAM_PREFIX,), programs.operation),
            ((JOG_PREFIX,), retreats.operation),
        ]

    def surround(self, around: CellSurroundings) -> None:
        """Answer requests about the cell's surroundings too."""
        self._around = around
        self._routes.append(((RECORDING_PREFIX, *WORLD_PREFIXES), around.operation))

    def answer(self, session: int, message: Management, now: int) -> list[Outgoing]:
        """Have a request answered by whom it is about, at once or later."""
        operation = operation_of(message.body)
        for prefixes, answer in self._routes:
            if operation.startswith(prefixes):
                return answer(message.body, self.asker(session, message), now)
        told = answer_management(
            message.body,
            self._cell,
            self._settings,
            now,
            session,
            self._around,
            self._served,
            self._access.move_fault,
        )
        reply = Management(
            request_id=message.request_id,
            body=told.text,
            comm_type=CommType.REPLY,
            reply_code=ReplyCode.SUCCESS if told.ok else ReplyCode.FAILURE,
        )
        return [Send(session, reply)]

    def asker(self, session: int, message: Management) -> Asker:
        """Return who asks, under the name that stands beside what it saves."""
        name = author_name(session, self._listeners[session].client)
        return Asker(session, message.request_id, name)
