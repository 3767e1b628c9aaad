"""All that pendants can do with programs in one cell: keep them, edit them, run them.

Owns how its parts are joined and which of them answers a management request. Decides nothing.
"""

from __future__ import annotations

from pydantic import ValidationError

from ..outgoing import Outgoing
from ..pendant.management_bodies import body_fault
from ..planning.jobs import Planned
from ..programs.program import OwnRobot
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from ..store.questions import AskStore
from ..world.offered_signals import Offer
from . import operations as op
from .breakpoints import Breakpoints
from .desk import ProgramDesk, ToAll
from .dry_run_desk import DryRunDesk
from .kept_breakpoints import KeptBreakpoints
from .library import ProgramLibrary
from .operations import OPERATION, Asker
from .program_work import ProgramWork
from .shelf import ProgramShelf
from .surroundings import BareSurroundings


class CellPrograms:
    """The programs of one cell.

    Attributes:
        desk: runs them.
    """

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotView,
        ask: AskStore,
        to_all: ToAll,
        *,
        cell_name: str,
        robot_name: str,
    ) -> None:
        """Join the parts.

        Args:
            cell: the cell.
            robot: the mathematics of the robot.
            ask: asks the store.
            to_all: sends a message to every pendant of the cell.
            cell_name: name of the cell.
            robot_name: name of the robot.
        """
        self._work = ProgramWork(cell.motions.new_job_id)
        shelf = ProgramShelf(ask, self._work, robot_name, cell.limits)
        kept = KeptBreakpoints(shelf, self._work)
        self.desk = ProgramDesk(cell, robot, shelf, kept, BareSurroundings(), to_all)
        own = OwnRobot(robot_name, cell.limits)
        self._breakpoints = Breakpoints(shelf, self._work, kept, self.desk, own)
        self._library = ProgramLibrary(ask, shelf, self._work, kept, cell, robot, robot_name)
        self._dry_runs = DryRunDesk(cell, robot, shelf, self._offered_signals, cell_name)

    def _offered_signals(self) -> Offer:
        return self.desk.surroundings.offered_signals

    def operation(self, body: bytes, asker: Asker, now: int) -> list[Outgoing]:
        """Carry out a management request about programs; the answer may come later."""
        try:
            asked = OPERATION.validate_json(body)
        except ValidationError as error:
            return asker.refuse(body_fault(error))
        match asked:
            case op.SetBreakpoints():
                return self._breakpoints.ask(asked, asker, now)
            case op.StartDryRun(name=name):
                return self._dry_runs.start(name, asker)
            case op.DryRunProgress():
                return self._dry_runs.progress(asker)
        return self._library.handle(asked, asker, now)

    def planned(self, planned: Planned, now: int) -> list[Outgoing] | None:
        """Take an answer of the planning process; None where it is to a motion."""
        done = self._work.planned(planned, now)
        return self._dry_runs.planned(planned) if done is None else done

    def closed(self, session: int) -> None:
        """Forget a connection that ended."""
        self._library.closed(session)
