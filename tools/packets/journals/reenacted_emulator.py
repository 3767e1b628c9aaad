"""Reenacted emulator: the real service, fed from its journal, with no I/O."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.links import EmulatorLink
from openpendant.controller_emulator.shell.service import Service
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.motion.errors import MotionError
from openpendant.simplemsg.pendant import OperatorAction

from .journal_file import Header, JournalError, JournalEvent
from .reenactment import (
    NullTransport,
    ReplayedJournal,
    is_number,
    unknown_event,
    unusable_settings,
)


class ReenactedEmulator:
    """The emulator of a journal; needs a running loop, which never gets to run anything."""

    def __init__(self, header: Header, replayed: ReplayedJournal) -> None:
        """Build the emulator that wrote the journal; JournalError where it cannot be had here."""
        try:
            settings = EmulatorSettings.model_validate(header.settings)
            self._controller = build_controller(settings, header.now)
        except ValidationError as error:
            raise unusable_settings(error) from None
        except MotionError as error:
            raise JournalError(f"its robot: {error}") from None
        self._journal = replayed
        self._service = Service(
            self._controller, settings, journal=replayed, clock=lambda: replayed.now
        )
        self._links: dict[str, EmulatorLink] = {}

    def play(self, happening: JournalEvent) -> None:
        """Let an event happen."""
        service = self._service
        match happening.event:
            case "tick" if is_number(happening.link):
                service.tick(int(happening.link))
            case "in":
                self._link(happening).data_received(happening.data)
            case "opened":
                is_motion = happening.more.get("port") == "motion"
                link = service.motion_link() if is_motion else service.state_link()
                self._links[happening.link] = link
                link.connection_made(NullTransport(happening.more.get("address", "")))
            case "closed":
                self._link(happening).connection_lost(None)
                del self._links[happening.link]
            case "operate" if happening.link in _ACTIONS:
                service.operate(_ACTIONS[happening.link])
            case "hang-up":
                service.close_links()
            case _:
                raise unknown_event(happening)

    def _link(self, happening: JournalEvent) -> EmulatorLink:
        link = self._links.get(happening.link)
        if link is None:
            raise JournalError(f"event {happening.number}: link {happening.link} was never opened")
        return link

    def state(self) -> dict[str, Any]:
        """Return what the controller knows: its motion, its STATUS, and the referee's record."""
        now = self._journal.now
        self._controller.advance(now)
        position, velocity, acceleration = self._controller.motion(now)
        status = self._controller.status(now)
        return {
            "joint_names": list(self._controller.joint_names),
            "joint_position": list(position),
            "joint_velocity": list(velocity),
            "joint_acceleration": list(acceleration),
            "status": {name: int(getattr(status, name)) for name in status.FIELDS},
            "links": sorted(self._links, key=int),
            "referee": self._controller.referee.as_dict(),
        }


_ACTIONS = {str(int(action)): action for action in OperatorAction}
