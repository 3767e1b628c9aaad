"""What the server tells of a cell when asked for everything at once, as plain typed data."""

from __future__ import annotations

from typing import Literal, TypedDict


class JointFacts(TypedDict):
    """One driven joint, controller side; rad, or m for a linear axis, and per second.

    Attributes:
        name: its name.
        unit: rad, or m for a linear axis.
        lower: lower limit [rad or m].
        upper: upper limit [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
    """

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    velocity: float
    acceleration: float


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
