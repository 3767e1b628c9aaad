"""The shell round one cell's core: hands it events, and carries out what follows.

Owns the connections to the cell's controller, and that a fault of the cell stays with the cell: the
only `try` round a core. Decides nothing itself.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb

from openpendant.motion.description.robot import SerialRobot
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

from ..core.cell_core import CellCore
from ..events.events import ClientEvent, ClientFailed, Event, Skipped
from ..planning.jobs import Planner
from ..planning.plan_store import PlanStore
from ..settings.cell_settings import CellSettings, ControllerPath
from .controller_connection import ControllerConnection
from .outbox import Outbox

log = logging.getLogger("openpendant.server")


@dataclass(frozen=True, slots=True)
class CellParts:
    """A cell that a server is to serve.

    Attributes:
        settings: its configuration.
        robot: its robot.
        planner: who plans for it; the server's planning processes where left out.
        plans: where its motions are kept; nowhere where left out.
    """

    settings: CellSettings
    robot: SerialRobot
    planner: Planner | None = None
    plans: PlanStore | None = None


class CellShell:
    """One cell of a running server.

    Attributes:
        core: its pure core.
        label: begins the names of its links, so that those of several cells differ; empty for the
            only cell.
        links: the connections to the controller.
        outbox: carries out what the core asks for.
    """

    def __init__(
        self,
        core: CellCore,
        label: str,
        links: Mapping[ControllerPath, ControllerConnection],
        outbox: Outbox,
    ) -> None:
        """Join the parts of a cell; they are described above."""
        self.core = core
        self.label = label
        self.links = links
        self.outbox = outbox

    def deliver(self, event: Event, now: int) -> None:
        """Hand an event to the core, and carry out what follows."""
        skipped: list[int] = []
        try:
            out = self.core.handle(event, now)
            if out:
                skipped = self.outbox.perform(out)
        except Exception as error:
            if isinstance(event, ClientEvent):
                self.client_failed(event.session, error, now)
            else:
                self._fail(error, now)
        if skipped:
            self.deliver(Skipped(tuple(skipped)), now)

    def client_failed(self, session: int, error: Exception, now: int) -> None:
        """Stop the robot and part with a client that we failed on; say so in one line."""
        incident = f"{session}-{now // 1_000_000}"
        log.error(
            "incident %s: cell %s stopped, session %d closed: %s: %s (%s)",
            *(incident, self.core.name, session, type(error).__name__),
            *(" ".join(str(error).split()), _place_of(error)),
        )
        self.deliver(ClientFailed(session, incident), now)

    def _fail(self, error: Exception, now: int) -> None:
        """Stop the robot and part with everybody; say so once."""
        problem = f"{type(error).__name__}: {error}"
        entry = CATALOGUE[VerdictCode.CELL_FAULTED]
        log.error("cell %s: %s %s (%s)", self.core.name, entry.cause, entry.remedy, problem)
        log.info("cell %s: where it went wrong", self.core.name, exc_info=error)
        self.outbox.perform(self.core.fail(problem, now))

    def hang_up(self) -> None:
        """Close the connections to the controller because the server is going down."""
        for link in self.links.values():
            link.end()


def _place_of(error: Exception) -> str:
    """Return file and line where an error was raised; a user is shown no more of it."""
    frames = extract_tb(error.__traceback__)
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "nowhere"
