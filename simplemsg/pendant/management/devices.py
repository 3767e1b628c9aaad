"""Operations on devices: a controller's inputs and outputs, the robot, the trace of its tool."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Any, NotRequired, TypedDict

from ..roles import Permission
from .declaration import Count, Done, NeedsAuthority, Request, operation


class SignalValues(TypedDict):
    """All inputs and outputs as last read, counted from 0.

    Attributes:
        offered: whether the controller offers any to the server.
        inputs: values.
        outputs: values.
    """

    offered: bool
    inputs: list[bool]
    outputs: list[bool]


@operation("signals.read", needs=Permission.OBSERVE)
class ReadAllSignals(Request[SignalValues]):
    """Return all inputs and outputs."""


@operation(
    "signals.set", needs=Permission.SET_OUTPUT, authority=NeedsAuthority.ALWAYS, in_order=True
)
class SetSignal(Request[Done]):
    """Give an output a value; answered once the controller has done it.

    Raises:
        Refused: NO_SIGNAL, SIGNALS_UNAVAILABLE, CONTROLLER_REFUSED.
    """

    output: int
    """its number, from 0."""
    value: bool
    """on or off."""


class Robots(TypedDict):
    """The robots that the server knows, and the one that this cell has.

    Attributes:
        robots: names of all that the server knows.
        loaded: the one that this cell has.
    """

    robots: list[str]
    loaded: str


class LoadedRobot(TypedDict):
    """The robot that this cell has.

    Attributes:
        loaded: its name.
    """

    loaded: str


class JointTable(TypedDict):
    """The driven joints of a robot, base to tip, controller side.

    Attributes:
        names: of the joints.
        display_names: as people call them.
        lower: lower limits [rad, m for a linear axis].
        upper: upper limits [rad, m for a linear axis].
        velocity: greatest speeds [rad/s or m/s].
        acceleration: greatest accelerations [rad/s² or m/s²].
    """

    names: list[str]
    display_names: list[str]
    lower: list[float]
    upper: list[float]
    velocity: list[float]
    acceleration: list[float]


class RobotSpecification(TypedDict):
    """What a robot is.

    Attributes:
        facts: its robot file: kind, tables, sources, frames.
        limits: of its joints; missing for a robot without a chain of joints.
        home_position: of its joints [rad, m for a linear axis]; likewise.
        planners: names of those that find ways around obstacles here, the default first; from
            version 3 of the protocol.
    """

    facts: dict[str, Any]
    limits: NotRequired[JointTable]
    home_position: NotRequired[list[float]]
    planners: NotRequired[list[str]]


@operation("robots.list", needs=Permission.OBSERVE)
class ListRobots(Request[Robots]):
    """Return which robots the server knows, and which one this cell has."""


@operation("robots.describe", needs=Permission.OBSERVE)
class DescribeRobot(Request[RobotSpecification]):
    """Return the specification of this cell's robot.

    Raises:
        Refused: ROBOT_FIXED.
    """

    name: str | None = field(default=None, kw_only=True)
    """name of the robot; None for this cell's, which is the only one that it describes."""


@operation("robots.load", needs=Permission.CHANGE_SCENE)
class LoadRobot(Request[LoadedRobot]):
    """Demand that this cell has a certain robot; refused unless it has it already.

    Raises:
        Refused: ROBOT_FIXED.
    """

    name: str
    """name of the robot."""


class Trace(TypedDict):
    """The way of the tool since the trace was cleared.

    Attributes:
        points: up to 800 of them: x, y, z in base [m].
        total: how many there are.
    """

    points: list[list[float]]
    total: int


@operation("trace.show", needs=Permission.OBSERVE)
class ShowTrace(Request[Trace]):
    """Return the way of the tool since the trace was cleared."""

    first: Annotated[int, Count(0)] = field(default=0, kw_only=True)
    """points to leave out at the beginning."""


@operation("trace.clear", needs=Permission.RUN_PROGRAM, overtaken=False)
class ClearTrace(Request[Done]):
    """Forget the way of the tool."""
