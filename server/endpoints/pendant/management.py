"""Management requests of pendants: each is given to who handles it; and the snapshot of a cell.

Owns the handlers of the operations that are about the cell as a whole, the table of all handlers
of a cell, the place where the motion authority is asked for, and under which name an asker is
noted.
"""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Sequence
from typing import Any, Literal, cast

from pydantic import ConfigDict, Field

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.simplemsg import CommType, ReplyCode
from openpendant.simplemsg.pendant import PROTOCOL_VERSION, Management
from openpendant.simplemsg.pendant.management import cell as op
from openpendant.simplemsg.pendant.management.declaration import NeedsAuthority, Request
from openpendant.simplemsg.pendant.management.program_values import ProgramError

from ...cell.robot_cell import RobotCell
from ...cell.why import why
from ...environment import CellEnvironment
from ...events.effects import Effect, Send
from ...events.management_requests import (
    Handler,
    ReplyTo,
    handlers_of,
    handles,
    is_of_topic,
    unknown,
)
from ...programs.program_service import ProgramService
from ...refusal import JsonBody, Refusal, refusal_of
from ...settings.cell_settings import CellSettings
from .access_requests import AccessRequests
from .authority_need import AuthorityNeed
from .notifications import Listeners

_ROBOTS_OWN = ("base", "root")


class JointDescription(JsonBody):
    """One driven joint, controller side; rad, or m for a linear axis."""

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    velocity: float
    acceleration: float
    display_name: str = ""
    """What people call it: Base, Lower-Arm, ..."""


class OwnerDescription(JsonBody):
    """Who holds the motion authority."""

    session: int
    client: str


class StopDescription(JsonBody):
    """The latched stop."""

    session: int
    client: str
    reason: str


class SpeedDescription(JsonBody):
    """The override, and the cap of tool and elbow; null where the mode sets none, m/s."""

    override: float
    tool_speed_cap: float | None


class SignalsDescription(JsonBody):
    """Inputs and outputs as last read; empty where the controller offers none to the server."""

    offered: bool
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]


class RecordingDescription(JsonBody):
    """The recording that is being made; its length so far in seconds and samples."""

    name: str
    duration: float
    samples: int


class ProgramDescription(JsonBody):
    """The program that is under way, which also waits or is paused."""

    name: str
    state: str
    line: int
    revision: int
    """The one that runs, of the program named here; another may be kept by now."""


class Snapshot(JsonBody):
    """The cell as it is now."""

    cell: str
    robot: str
    joints: tuple[JointDescription, ...]
    frames: tuple[str, ...]
    activity: str
    link: str
    mode: str
    """The controller's own."""
    operating_mode: str
    speed: SpeedDescription
    tool: str | None
    """The selected tool; null for the bare flange."""
    signals: SignalsDescription
    recording: RecordingDescription | None
    recording_problem: str
    """Why the last recording ended by itself; empty where it did not."""
    program: ProgramDescription | None
    owner: OwnerDescription | None
    stop: StopDescription | None
    obstacle: str


def snapshot(
    cell: RobotCell, settings: CellSettings, now: int, environment: CellEnvironment | None = None
) -> Snapshot:
    """Return the cell as it is now; without an environment it has no user frames and no tool."""
    holder, stop, obstacle = cell.authority.holder, cell.stop, cell.obstacle(now)
    program = cell.program
    return Snapshot(
        cell=settings.name,
        robot=settings.robot,
        joints=_joints(cell.limits),
        frames=_ROBOTS_OWN if environment is None else tuple(environment.world.frames.frames),
        activity=cell.activity.name.lower(),
        link=cell.link_state(now).name.lower(),
        mode=cell.feedback.mode.name.lower(),
        operating_mode=cell.modes.mode(cell.feedback.mode).name.lower(),
        speed=SpeedDescription(
            override=cell.modes.override,
            tool_speed_cap=cell.modes.tool_speed_cap(cell.feedback.mode),
        ),
        tool=None if environment is None else environment.world.frames.selected_tool,
        signals=_signals(environment),
        recording=_recording(environment),
        recording_problem=_recording_problem(environment),
        program=None
        if program is None or program.is_loading
        else ProgramDescription(
            name=program.name,
            state=program.state.name.lower(),
            line=program.line,
            revision=program.revision,
        ),
        owner=None
        if holder is None
        else OwnerDescription(session=holder.session, client=holder.client),
        stop=None
        if stop is None
        else StopDescription(session=stop.by.session, client=stop.by.client, reason=stop.reason),
        obstacle="" if obstacle is None else obstacle.sentence,
    )


def _joints(limits: JointLimits) -> tuple[JointDescription, ...]:
    return tuple(
        JointDescription(
            name=limits.names[index],
            unit="m" if limits.prismatic[index] else "rad",
            lower=limits.lower[index],
            upper=limits.upper[index],
            velocity=limits.velocity[index],
            acceleration=limits.acceleration[index],
            display_name=limits.display_names[index],
        )
        for index in range(limits.dof)
    )


def _recording(environment: CellEnvironment | None) -> RecordingDescription | None:
    status = None if environment is None else environment.recordings.recorder.status
    if status is None:
        return None
    return RecordingDescription(name=status.name, duration=status.duration, samples=status.samples)


def _recording_problem(environment: CellEnvironment | None) -> str:
    broken_off = None if environment is None else environment.recordings.recorder.broken_off
    return "" if broken_off is None else broken_off.refusal.sentence


def _signals(environment: CellEnvironment | None) -> SignalsDescription:
    if environment is None:
        return SignalsDescription(offered=False, inputs=(), outputs=())
    signals = environment.signals
    return SignalsDescription(
        offered=signals.is_offered, inputs=signals.inputs, outputs=signals.outputs
    )


class Failure(JsonBody):
    """A refused management request."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    # Not docstrings: to read them, pydantic parses this file each time that a server starts.
    code: int = Field(description="Entry of the catalogue.")
    text: str = Field(description="One sentence with the numbers.")
    joint: int = Field(-1, description="Index of the joint at fault, -1 for none.")
    value: float = Field(0.0, description="The value at fault, SI.")
    limit: float = Field(0.0, description="The limit that it breaks, SI.")
    line: int | None = Field(
        None, description="Where a program's text is wrong, from 1; left out where none is."
    )
    column: int | None = Field(None, description="Likewise.")


_NEVER = NeedsAuthority.NEVER  # asked of each request, and members of an enumeration are slow


class ManagementRequests:
    """The management requests of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        settings: CellSettings,
        listeners: Listeners,
        access: AccessRequests,
        programs: ProgramService,
        environment: CellEnvironment | None,
        besides: Sequence[object] = (),
    ) -> None:
        """Join those who answer; a cell without an environment has no scene and no recordings.

        Args:
            besides: who else has handlers.
        """
        self._cell = cell
        self._settings = settings
        self._listeners = listeners
        self._access = access
        self._environment = environment
        self._authority = AuthorityNeed(cell, programs.executor, environment)
        services: tuple[object, ...] = ()
        if environment is not None:
            services = (
                *(environment.service, environment.named, environment.recordings),
                *(environment.kinematics, environment.shapes),
            )
        self._handlers = handlers_of(self, access, access.connections, *services, *besides) | dict(
            programs.handlers
        )

    def answer(
        self,
        session: int,
        message: Management,
        operation: str,
        asked: Request[Any] | Refusal,
        now: int,
    ) -> list[Effect]:
        """Have a request answered by whom it is about, at once or later.

        Whether it needs the motion authority, and who holds that, is judged here and now, however
        long ago its body came.

        Args:
            operation: what its body names; empty for nothing.
        """
        reply = self.reply_to(session, message)
        if isinstance(asked, Refusal):
            is_told_alike = is_of_topic(operation, reply.version)
            return reply.refuse(asked) if is_told_alike else _failed(asked, reply)
        handler = self._handlers.get(type(asked))
        if handler is None:
            return _failed(unknown(operation, reply.version), reply)
        if asked.AUTHORITY is not _NEVER:
            fault = self._authority.fault(asked, session, now)
            if fault is not None:
                self._access.gate.without_authority(session, message, operation, fault, now)
                return reply.refuse(fault)
        return carry_out(handler, asked, reply, now)

    def changes_tool_or_load(self, asked: Request[Any] | Refusal) -> bool:
        """Return True for a change of the selected tool, or of what the robot carries."""
        return not isinstance(asked, Refusal) and self._authority.changes_tool_or_load(asked)

    def reply_to(self, session: int, message: Management) -> ReplyTo[Any]:
        """Return who asks, under the name that stands beside what it saves."""
        listener = self._listeners[session]
        name = unicodedata.normalize("NFC", listener.holder.client).strip() or f"session {session}"
        in_full = self._cell.joint_names.in_full
        return ReplyTo(session, message.request_id, name, listener.version, in_full)

    # The cell as a whole.

    @handles(op.SnapshotRequest)
    def _snapshot(
        self, asked: op.SnapshotRequest, reply: ReplyTo[op.Snapshot], now: int
    ) -> list[Effect]:
        found = snapshot(self._cell, self._settings, now, self._environment)
        return reply.answer(cast(op.Snapshot, found.model_dump(mode="json")))

    @handles(op.CellsRequest)
    def _cells(
        self, asked: op.CellsRequest, reply: ReplyTo[op.ServedCells], now: int
    ) -> list[Effect]:
        if reply.version < PROTOCOL_VERSION:
            return reply.answer({"cells": self._access.lobby.names})
        address = self._listeners[reply.session].address
        return reply.answer(self._access.cells_for(reply.session, address))

    @handles(op.WhyRequest)
    def _why(self, asked: op.WhyRequest, reply: ReplyTo[op.Why], now: int) -> list[Effect]:
        def told(contact: Refusal | None, at: int) -> list[Effect]:
            role, name = self._access.move_fault, self._settings.name
            found = why(self._cell, name, asked, reply.session, at, contact, role, reply.code)
            return reply.answer(cast(op.Why, found.model_dump(mode="json")))

        if self._environment is None or asked.kind == "jog":
            # A jog may always lead away from a contact, so none is in its way.
            return told(None, now)
        return self._environment.contact(told, now)


def _failed(refusal: Refusal, reply: ReplyTo[Any]) -> list[Effect]:
    """Refuse what is about no topic; such answers have blanks behind commas and colons."""
    failure = Failure(code=reply.code(refusal.code), text=refusal.text).model_dump(
        exclude_none=True
    )
    body = json.dumps(failure).encode()
    request_id, code = reply.request_id, ReplyCode.FAILURE
    told = Management(request_id, body, comm_type=CommType.REPLY, reply_code=code)
    return [Send(reply.session, told)]


def carry_out(handler: Handler, asked: Request[Any], reply: ReplyTo[Any], now: int) -> list[Effect]:
    """Carry out a request; an error of motion or of a program refuses it."""
    try:
        return handler(asked, reply, now)
    except MotionError as error:
        return reply.refuse(refusal_of(error))
    except ProgramError as error:
        return reply.refuse_program(error)
