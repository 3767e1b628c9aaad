"""Program service of a cell: keeps, edits and runs its programs.

Owns the connection of its parts and what of them others may use. Decides nothing.
"""

from __future__ import annotations

from ..cell.robot_cell import RobotCell
from ..cell.robot_model import RobotModel
from ..events.management_requests import Handlers, handlers_of
from ..events.pending import Pending
from .execution.breakpoints import Breakpoints
from .execution.dry_run_service import DryRunService, KeepPreview
from .execution.program_executor import ProgramExecutor, ToAll
from .execution.program_run import RunEnvironment
from .language.program import OwnRobot
from .library.kept_breakpoints import KeptBreakpoints
from .library.program_changes import ProgramChanges
from .library.program_library import ProgramLibrary
from .library.program_loader import ProgramLoader, ProgramWork


class ProgramService:
    """Programs of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotModel,
        pending: Pending,
        to_all: ToAll,
        *,
        cell_name: str,
        robot_name: str,
        environment: RunEnvironment,
        keep_preview: KeepPreview,
    ) -> None:
        work = ProgramWork(cell.motions.new_job_id, pending)
        loader = ProgramLoader(pending.ask, work, robot_name, cell.limits)
        kept = KeptBreakpoints(loader, work)
        own = OwnRobot(robot_name, cell.limits)
        self.executor = ProgramExecutor(cell, robot, loader, kept, environment, to_all, pending)
        self._breakpoints = Breakpoints(loader, work, kept, self.executor, own)
        self._changes = ProgramChanges(pending.ask, loader, work, kept, cell, robot, own)
        self._library = ProgramLibrary(pending.ask, loader, work, kept, own, self._changes)
        self._dry_runs = DryRunService(
            *(cell, robot, loader, self.executor, pending, cell_name), keep_preview
        )

    @property
    def handlers(self) -> Handlers:
        """Handlers of the requests about programs."""
        return handlers_of(self._breakpoints, self._dry_runs, self._library, self._changes)

    def closed(self, session: int) -> None:
        """Forget a connection that ended."""
        self._library.closed(session)
