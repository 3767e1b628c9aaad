"""Operations on the cell: its snapshot, its neighbours, why it does not move, and the ways out."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum
from typing import Annotated, Literal, NotRequired, TypeAlias, TypedDict

from ..roles import Permission
from .declaration import ReadAs, Request, operation


class JointFacts(TypedDict):
    """One driven joint, controller side; rad, or m for a linear axis, and per second.

    Attributes:
        name: its name.
        unit: rad, or m for a linear axis.
        lower: lower limit [rad or m].
        upper: upper limit [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        display_name: what people call it, as on a pendant's keys.
    """

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    velocity: float
    acceleration: float
    display_name: NotRequired[str]


class Owner(TypedDict):
    """Who holds the motion authority.

    Attributes:
        session: number of the connection.
        client: name of the pendant.
    """

    session: int
    client: str


class Speed(TypedDict):
    """The override, and the cap of tool and elbow, m/s; None where the mode sets none.

    Attributes:
        override: fraction of the planned speed.
        tool_speed_cap: cap of tool and elbow [m/s]; None where the mode sets none.
    """

    override: float
    tool_speed_cap: float | None


class Signals(TypedDict):
    """Inputs and outputs as last read; empty where the controller offers none to the server.

    Attributes:
        offered: whether the controller offers any to the server.
        inputs: values, from input 0.
        outputs: values, from output 0.
    """

    offered: bool
    inputs: list[bool]
    outputs: list[bool]


class RecordingUnderWay(TypedDict):
    """The recording that is being made; its length so far in seconds and samples.

    Attributes:
        name: its name.
        duration: so far [s].
        samples: so far.
    """

    name: str
    duration: float
    samples: int


class ProgramUnderWay(TypedDict):
    """The program that runs, waits or is paused, with its line in the text.

    Attributes:
        name: its name.
        state: running, waiting or paused.
        line: its line in the text, from 1.
        revision: the one that runs; another may be kept by now.
    """

    name: str
    state: str
    line: int
    revision: int


class LatchedStop(TypedDict):
    """The latched stop: who, and why.

    Attributes:
        session: number of the connection that asked for it.
        client: name of its pendant.
        reason: in the words of whoever stopped.
    """

    session: int
    client: str
    reason: str


class Snapshot(TypedDict):
    """A cell as it was when it was asked.

    Attributes:
        cell: its name.
        robot: name of the robot.
        joints: its driven joints, base to tip.
        frames: names of the frames that a pose or a tool jog may use.
        activity: what it is doing, in lower case.
        link: the controller connection: down, up or stale.
        mode: the controller's own mode.
        operating_mode: the mode that rules here.
        speed: override and cap.
        tool: the selected tool; None for the bare flange.
        signals: inputs and outputs.
        recording: what is being recorded; None for nothing.
        recording_problem: why the last recording ended by itself; empty where it did not.
        program: what is under way; None for nothing.
        owner: who holds the motion authority; None for nobody.
        stop: the latched stop; None where there is none.
        obstacle: why no motion may start now; empty where it may.
    """

    cell: str
    robot: str
    joints: list[JointFacts]
    frames: list[str]
    activity: str
    link: str
    mode: str
    operating_mode: str
    speed: Speed
    tool: str | None
    signals: Signals
    recording: RecordingUnderWay | None
    recording_problem: str
    program: ProgramUnderWay | None
    owner: Owner | None
    stop: LatchedStop | None
    obstacle: str


class Wish(StrEnum):
    """What somebody would like to do."""

    MOVE = "move"
    JOG = "jog"
    PROGRAM = "program"


WishName: TypeAlias = Literal["move", "jog", "program"]


class ServedCell(TypedDict):
    """One cell: its name, for `connect`, its robot, and what it is doing.

    Version 2 is told the first two alone. The last three are told to whoever has logged in, or may
    look on from his address without.

    Attributes:
        cell: its name, for `connect`.
        robot: name of its robot.
        display: manufacturer and model of the robot.
        emulated: whether its controller is known to be emulated.
        login_needed: whether whoever comes from this address has to log in to move it.
        holder: name of who has the motion authority; empty where nobody has it.
        moving: whether the robot moves, as far as anyone knows.
        connections: how many pendants it has.
    """

    cell: str
    robot: str
    display: NotRequired[str]
    emulated: NotRequired[bool]
    login_needed: NotRequired[bool]
    holder: NotRequired[str]
    moving: NotRequired[bool]
    connections: NotRequired[int]


class ServedCells(TypedDict):
    """All cells behind the pendant port; version 2 is told no more than `cells`.

    Attributes:
        server: name and version of the server.
        version: newest version of the pendant protocol that it speaks.
        joins: whether a class may be joined; no server has one yet.
        cells: in the order of the server's configuration.
    """

    server: NotRequired[str]
    version: NotRequired[int]
    joins: NotRequired[bool]
    cells: list[ServedCell]


class Condition(TypedDict):
    """One condition of a motion; the last five are empty where it holds.

    Attributes:
        condition: its name.
        meaning: what has to hold.
        holds: whether it does.
        code: entry of the catalogue.
        name: of that entry.
        text: one sentence with the numbers.
        cause: what happened.
        remedy: what to do about it.
    """

    condition: str
    meaning: str
    holds: bool
    code: int
    name: str
    text: str
    cause: str
    remedy: str


class End(TypedDict):
    """Why a motion ended before its goal.

    Attributes:
        code: entry of the catalogue.
        name: of that entry.
        text: one sentence with the numbers.
        cause: what happened.
        remedy: what to do about it.
    """

    code: int
    name: str
    text: str
    cause: str
    remedy: str


class Why(TypedDict):
    """The chain of conditions in the order in which they are examined.

    Attributes:
        cell: name of the cell.
        kind: what shall move it.
        ready: whether all hold.
        broken: the first that is broken; empty where all hold.
        conditions: all of them.
        ended: why the last motion ended before its goal; None where it arrived or another began.
        remarks: what else is to be known, such as that the robot moved without a command; empty
            from an older server, whose answer has none.
        enabling_deadline: the enabling device (training) of whoever was asked about counts as let
            go after so long a silence [s]; an older server says nothing of it.
    """

    cell: str
    kind: WishName
    ready: bool
    broken: str
    conditions: list[Condition]
    ended: End | None
    remarks: NotRequired[list[str]]
    enabling_deadline: NotRequired[float]


class WayOut(TypedDict):
    """One key that leads out, or two or three to be held together.

    Attributes:
        press: the name, as `Upper-Arm towards -`, `tool Z+ in base`, or
            `Upper-Arm towards + and Wrist-Pitch towards -`.
        space: 1 joints, 2 tool.
        frame: of a tool key; empty for joints.
        values: parts of the jog speed, one per joint, or along and about the frame's axes.
    """

    press: str
    space: int
    frame: str
    values: list[float]


class Hold(TypedDict):
    """One thing that the robot stands at.

    Attributes:
        reason: `joint-limit`, `singularity` or `collision`.
        text: what it is, with its numbers.
        ways: what leads out, the best first; empty where nothing is known.
    """

    reason: str
    text: str
    ways: list[WayOut]


class Retreat(TypedDict):
    """All that the robot stands at; empty where it stands free.

    Attributes:
        holds: one thing that the robot stands at.
    """

    holds: list[Hold]


@operation("snapshot", needs=Permission.OBSERVE)
class SnapshotRequest(Request[Snapshot]):
    """Return the whole state of the cell: robot, limits, owner, stop, obstacle."""


@operation("cells", needs=Permission.OBSERVE)
class CellsRequest(Request[ServedCells]):
    """Return which cells and robots the server has behind this port, as a lobby tells them."""


@operation("why", needs=Permission.OBSERVE)
class WhyRequest(Request[Why]):
    """Return what keeps the robot from moving: every condition, and the first broken one."""

    kind: Annotated[WishName, ReadAs(Wish)] = field(default="move", kw_only=True)
    """what shall move it."""
    whose: Literal["holder", "mine"] = field(default="holder", kw_only=True)
    """for whoever is in control, so that an onlooker may ask, or for this connection."""


@operation("jog.retreat", needs=Permission.OBSERVE)
class RetreatRequest(Request[Retreat]):
    """Return at what limit, singularity or contact the robot stands, and what leads out.

    One entry for each; none where it stands free. Show `press`, or jog by `jog_out`.

    Raises:
        Refused: MOVING, FEEDBACK_STALE.
    """
