"""The management requests about recordings, as JSON.

Owns the fields of each request; what a request does is told by `desk`.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, TypeAdapter

from ..operation_body import OperationBody
from ..planning.recording_job import FASTEST, MOST_REPEATS, SLOWEST

PREFIX = "recordings."

Time = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class ListRecordings(OperationBody):
    """Asks which recordings there are, 100 at a time, and which one is under way."""

    op: Literal["recordings.list"]
    first: Annotated[int, Field(ge=0)] = 0
    """How many to leave out at the beginning."""


class DescribeRecording(OperationBody):
    """Asks for the description of a recording: robot, joints, rate, duration, gaps, problem."""

    op: Literal["recordings.describe"]
    name: str


class StartRecording(OperationBody):
    """Begins a recording; answered once its document is kept.

    Where it then ends by itself, an aborted Outcome of the request's id says why.
    """

    op: Literal["recordings.start"]
    name: str


class StopRecording(OperationBody):
    """Ends the recording under way; answered once all of it is kept.

    Refused with the reason where the recording ended by itself before.
    """

    op: Literal["recordings.stop"]


class TrimRecordingPart(OperationBody):
    """Saves a part of a recording as a new one."""

    op: Literal["recordings.trim"]
    name: str
    new_name: str
    begins: Time = 0.0
    """First time that is kept, s."""
    ends: Time | None = None
    """Last time that is kept, s; null for the end."""


class RenameARecording(OperationBody):
    """Gives a recording another name."""

    op: Literal["recordings.rename"]
    name: str
    new_name: str
    expected_revision: Annotated[int, Field(ge=1)]


class DeleteRecording(OperationBody):
    """Deletes a recording; its samples are gone at once."""

    op: Literal["recordings.delete"]
    name: str
    expected_revision: Annotated[int, Field(ge=1)]


class PlayRecording(OperationBody):
    """Plays a recording back, or says what would happen.

    Answered when it is planned: with what was asked and what is possible, and the way to the first
    sample. The motion begins with that answer; its end is told by an Outcome of the request's id.
    """

    op: Literal["recordings.play"]
    name: str
    factor: Annotated[float, Field(ge=SLOWEST, le=FASTEST)] = 1.0
    """Speed relative to the recording; the limits keep it down where they must."""
    tolerance: Annotated[float, Field(ge=1e-5, le=0.1)] | None = None
    """How far the path may lie from a sample in any joint, rad or m; null for as near as it can
    without following noise, 0.002 at best and 0.01 at most."""
    repeats: Annotated[int, Field(ge=1, le=MOST_REPEATS)] = 1
    """How many times; in between the robot goes softly back to the first sample."""
    begins: Time = 0.0
    """First time of the recording that is played, s."""
    ends: Time | None = None
    """Last time that is played, s; null for the end."""
    bridge: Annotated[float, Field(ge=0, le=2)] = 0.25
    """Longest gap that is played across, s."""


RecordingOperation: TypeAlias = (
    ListRecordings
    | DescribeRecording
    | StartRecording
    | StopRecording
    | TrimRecordingPart
    | RenameARecording
    | DeleteRecording
    | PlayRecording
)

RECORDING_OPERATION: TypeAdapter[RecordingOperation] = TypeAdapter(
    Annotated[RecordingOperation, Field(discriminator="op")]
)
"""Reads the JSON of a request about recordings."""
