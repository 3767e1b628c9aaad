"""Signals of the controller, the robot itself, and the trace of its tool."""

from __future__ import annotations

from typing import Any, NotRequired, TypedDict

from .calls import Request, asks, call


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


class Done(TypedDict):
    """Nothing more is told: it is done."""


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
    """

    facts: dict[str, Any]
    limits: NotRequired[JointTable]
    home_position: NotRequired[list[float]]


class Trace(TypedDict):
    """The way of the tool since the trace was cleared.

    Attributes:
        points: up to 800 of them: x, y, z in base [m].
        total: how many there are.
    """

    points: list[list[float]]
    total: int


class SignalCalls:
    """The operations on signals."""

    @call
    def read(self) -> Request[SignalValues]:
        """Return all inputs and outputs."""
        return asks("signals.read")

    @call
    def set(self, output: int, value: bool) -> Request[Done]:
        """Give an output a value; answered once the controller has done it.

        Args:
            output: its number, from 0.
            value: on or off.

        Raises:
            Refused: NO_SIGNAL, SIGNALS_UNAVAILABLE, CONTROLLER_REFUSED.
        """
        return asks("signals.set", output=output, value=value)


class RobotCalls:
    """The operations on the robot itself."""

    @call
    def list(self) -> Request[Robots]:
        """Return which robots the server knows, and which one this cell has."""
        return asks("robots.list")

    @call
    def describe(self, *, name: str | None = None) -> Request[RobotSpecification]:
        """Return the specification of this cell's robot.

        Args:
            name: name of the robot; None for this cell's, which is the only one that it describes.

        Raises:
            Refused: ROBOT_FIXED.
        """
        return asks("robots.describe", name=name)

    @call
    def load(self, name: str) -> Request[LoadedRobot]:
        """Demand that this cell has a certain robot; refused unless it has it already.

        Args:
            name: name of the robot.

        Raises:
            Refused: ROBOT_FIXED.
        """
        return asks("robots.load", name=name)


class TraceCalls:
    """The operations on the trace of the tool."""

    @call
    def show(self, *, first: int = 0) -> Request[Trace]:
        """Return the way of the tool since the trace was cleared.

        Args:
            first: points to leave out at the beginning.
        """
        return asks("trace.show", first=first)

    @call
    def clear(self) -> Request[Done]:
        """Forget the way of the tool."""
        return asks("trace.clear")
