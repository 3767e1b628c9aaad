"""The snapshot of a cell for a pendant that has just connected, and the list of served cells.

Owns what of a cell is told so: all of it as it is now, read from the cell and what surrounds it.
The list names the cells of the server and their robots, for a pendant that has to choose.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, Self

from openpendant.motion.description.limits import JointLimits

from ...cell.robot_cell import RobotCell
from ...environment import CellEnvironment
from ...refusal import JsonBody
from ...settings.cell_settings import CellSettings


class ServedCell(JsonBody):
    """One cell: its name, for a hello, and the name of its robot."""

    cell: str
    robot: str


class ServedCells(JsonBody):
    """All cells behind the pendant port that was asked."""

    cells: tuple[ServedCell, ...]

    @classmethod
    def of(cls, names: Iterable[tuple[str, str]]) -> Self:
        """Return cells from pairs of their names and their robots' names."""
        return cls(cells=tuple(ServedCell(cell=cell, robot=robot) for cell, robot in names))


_ROBOTS_OWN = ("base", "root")


class JointDescription(JsonBody):
    """One driven joint, controller side; rad, or m for a linear axis."""

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    velocity: float
    acceleration: float


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
    cell: RobotCell, settings: CellSettings, now: int, around: CellEnvironment | None = None
) -> Snapshot:
    """Return the cell as it is now; without surroundings it has no frames of users and no tool."""
    holder, stop, obstacle = cell.authority.holder, cell.stop, cell.obstacle(now)
    program = cell.program
    return Snapshot(
        cell=settings.name,
        robot=settings.robot,
        joints=_joints(cell.limits),
        frames=_ROBOTS_OWN if around is None else tuple(around.world.frames.frames),
        activity=cell.activity.name.lower(),
        link=cell.link_state(now).name.lower(),
        mode=cell.feedback.mode.name.lower(),
        operating_mode=cell.modes.mode(cell.feedback.mode).name.lower(),
        speed=SpeedDescription(
            override=cell.modes.override,
            tool_speed_cap=cell.modes.tool_speed_cap(cell.feedback.mode),
        ),
        tool=None if around is None else around.world.frames.selected_tool,
        signals=_signals(around),
        recording=_recording(around),
        recording_problem=_recording_problem(around),
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
        )
        for index in range(limits.dof)
    )


def _recording(around: CellEnvironment | None) -> RecordingDescription | None:
    status = None if around is None else around.recordings.recorder.status
    if status is None:
        return None
    return RecordingDescription(name=status.name, duration=status.duration, samples=status.samples)


def _recording_problem(around: CellEnvironment | None) -> str:
    broken_off = None if around is None else around.recordings.recorder.broken_off
    return "" if broken_off is None else broken_off.refusal.sentence


def _signals(around: CellEnvironment | None) -> SignalsDescription:
    if around is None:
        return SignalsDescription(offered=False, inputs=(), outputs=())
    signals = around.signals
    return SignalsDescription(
        offered=signals.is_offered, inputs=signals.inputs, outputs=signals.outputs
    )
