"""The management requests about signals, the robot itself and the trace of its tool, as JSON.

Owns the fields of each request; what a request does is told by `desk`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ..operation_body import OperationBody


class ReadAllSignals(OperationBody):
    """Asks for all inputs and outputs."""

    op: Literal["signals.read"]


class SetSignal(OperationBody):
    """Gives an output a value; answered once the controller has done it."""

    op: Literal["signals.set"]
    output: int
    value: bool


class ListRobots(OperationBody):
    """Asks which robots the server knows, and which one this cell has."""

    op: Literal["robots.list"]


class DescribeRobot(OperationBody):
    """Asks for a robot's specification; this cell's where no name is given."""

    op: Literal["robots.describe"]
    name: str | None = None


class LoadRobot(OperationBody):
    """Asks that this cell has a certain robot; refused unless it has it already."""

    op: Literal["robots.load"]
    name: str


class ShowTrace(OperationBody):
    """Asks for the way of the tool since the trace was cleared."""

    op: Literal["trace.show"]
    first: Annotated[int, Field(ge=0)] = 0
    """Points to leave out at the beginning."""


class ClearTrace(OperationBody):
    """Forgets the way of the tool."""

    op: Literal["trace.clear"]
