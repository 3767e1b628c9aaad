"""Operations on recordings of a motion: begun, ended, cut, and played back at another speed.

Times are seconds from the first sample.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, NotRequired, TypeAlias, TypedDict

from ..roles import Permission
from .declaration import Count, NeedsAuthority, Number, Request, operation

SLOWEST, FASTEST = 0.1, 4.0
"""Bounds of the speed of a playback, relative to its recording."""

MOST_REPEATS = 1_000
"""How many times one request can play a recording."""

Time: TypeAlias = Annotated[float, Number(0, finite=True)]
"""Time from the first sample [s]."""


class RecordingHeading(TypedDict):
    """A recording in the list; of a damaged one only what is wrong with it is known.

    Attributes:
        name: name of the recording.
        revision: of its description: rename or delete it from this one.
        saved_by: who made it.
        problem: why it ended by itself, or what is wrong with it; empty where all is well.
        robot: name of the robot.
        finished: it was stopped, not cut off.
        samples: how many.
        duration: from the first to the last sample [s].
        rate: samples a second, gaps left out [Hz].
    """

    name: str
    revision: int
    saved_by: str
    problem: str
    robot: NotRequired[str]
    finished: NotRequired[bool]
    samples: NotRequired[int]
    duration: NotRequired[float]
    rate: NotRequired[float]


class RecordingProgress(TypedDict):
    """The recording under way.

    Attributes:
        name: its name.
        duration: from the first to the last sample [s].
        samples: so far.
        kept: samples that are on the disk.
        gaps: between samples, so far.
    """

    name: str
    duration: float
    samples: int
    kept: int
    gaps: int


class Recordings(TypedDict):
    """Which recordings there are.

    Attributes:
        recordings: up to 100 of them, by name.
        total: how many there are.
        recording: the one under way; None where nothing is recorded.
        problem: why the last one ended by itself; empty where it did not.
    """

    recordings: list[RecordingHeading]
    total: int
    recording: RecordingProgress | None
    problem: str


class RecordingMade(TypedDict):
    """What a recording is.

    Attributes:
        columns: names of the values of a sample: time, each joint, mark of a gap.
        robot: name of the robot.
        joints: names of its joints.
        period: how often the controller was expected to report [s].
        finished: it was stopped, not cut off.
        problem: why it ended by itself; empty where it was stopped.
        samples: how many.
        duration: from the first to the last sample [s].
        rate: samples a second, gaps left out [Hz].
        gaps: between samples.
        longest_gap: the longest of them [s].
    """

    columns: list[str]
    robot: str
    joints: list[str]
    period: float
    finished: bool
    problem: str
    samples: int
    duration: float
    rate: float
    gaps: int
    longest_gap: float


class RecordingDescription(RecordingMade):
    """What a recording that is kept is.

    Attributes:
        name: name of the recording.
        revision: of its description: rename or delete it from this one.
        columns: names of the values of a sample: time, each joint, mark of a gap.
        robot: name of the robot.
        joints: names of its joints.
        period: how often the controller was expected to report [s].
        finished: it was stopped, not cut off.
        problem: why it ended by itself; empty where it was stopped.
        samples: how many.
        duration: from the first to the last sample [s].
        rate: samples a second, gaps left out [Hz].
        gaps: between samples.
        longest_gap: the longest of them [s].
    """

    name: str
    revision: int


class ChangedRecording(TypedDict):
    """What is kept now: make the next change from this revision.

    Attributes:
        name: name of the recording.
        revision: the one that is kept now: make the next change from it.
    """

    name: str
    revision: int


class PlaybackAccount(TypedDict):
    """What was asked of a playback and what is possible.

    Attributes:
        samples: how many are played.
        recorded: how long their recording took [s].
        asked: how long playing them once was to take [s].
        possible: how long it takes under the limits [s].
        approach: time of the soft way to the first sample [s]; 0 where the robot stands there.
        total: time of the whole motion, repeats and ways back included [s].
        deviation: greatest distance of a sample from the path, in any joint [rad or m].
        dropped: samples whose time did not advance.
        gaps: gaps that are played across.
        longest_gap: the longest of them [s].
        factor: speed relative to the recording that is possible.
    """

    samples: int
    recorded: float
    asked: float
    possible: float
    approach: float
    total: float
    deviation: float
    dropped: int
    gaps: int
    longest_gap: float
    factor: float


@operation("recordings.list", needs=Permission.OBSERVE)
class ListRecordings(Request[Recordings]):
    """Return which recordings there are, 100 at a time, and which one is under way."""

    first: Annotated[int, Count(0)] = field(default=0, kw_only=True)
    """how many to leave out at the beginning."""


@operation("recordings.describe", needs=Permission.OBSERVE)
class DescribeRecording(Request[RecordingDescription]):
    """Return what a recording is: robot, joints, rate, duration, gaps, problem.

    Raises:
        Refused: NOT_FOUND.
    """

    name: str
    """name of the recording."""


@operation("recordings.start", needs=Permission.EDIT_PROGRAM)
class StartRecording(Request[RecordingMade]):
    """Begin a recording; answered once it is kept.

    Where it ends by itself, an aborted OUTCOME of the request says why; so does `list`.

    Raises:
        Refused: RECORDING_RUNNING, BAD_NAME, REVISION_CONFLICT: there is one of this name.
    """

    name: str
    """name of the new recording."""


@operation("recordings.stop", needs=Permission.EDIT_PROGRAM)
class StopRecording(Request[RecordingMade]):
    """End the recording under way; answered once all of it is kept.

    Raises:
        Refused: NOT_RECORDING, or why the recording ended by itself before.
    """


@operation("recordings.trim", needs=Permission.EDIT_PROGRAM)
class TrimRecordingPart(Request[ChangedRecording]):
    """Save a part of a recording as a new one.

    Raises:
        Refused: NOT_FOUND, BAD_NAME, REVISION_CONFLICT: the new name is taken.
    """

    name: str
    """name of the recording."""
    new_name: str
    """name of the part."""
    begins: Time = field(default=0.0, kw_only=True)
    """first time that is kept [s]."""
    ends: Time | None = field(default=None, kw_only=True)
    """last time that is kept [s]; None for the end."""


@operation("recordings.rename", needs=Permission.EDIT_PROGRAM)
class RenameARecording(Request[ChangedRecording]):
    """Give a recording another name.

    Raises:
        Refused: NOT_FOUND, BAD_NAME, REVISION_CONFLICT, RECORDING_RUNNING.
    """

    name: str
    """name of the recording."""
    new_name: str
    """the name that it has afterwards."""
    expected_revision: Annotated[int, Count(1)]
    """the one that the change was made from."""


@operation("recordings.delete", needs=Permission.EDIT_PROGRAM)
class DeleteRecording(Request[ChangedRecording]):
    """Delete a recording; its samples are gone at once.

    Raises:
        Refused: NOT_FOUND, REVISION_CONFLICT, RECORDING_RUNNING.
    """

    name: str
    """name of the recording."""
    expected_revision: Annotated[int, Count(1)]
    """the one that the change was made from."""


@operation(
    "recordings.play", needs=Permission.RUN_PROGRAM, authority=NeedsAuthority.ALWAYS, in_order=True
)
class PlayRecording(Request[PlaybackAccount]):
    """Play a recording back; answered when it is planned, and the motion begins with the answer.

    The robot goes softly to the first sample first. The end is told by an OUTCOME of the request.

    Raises:
        Refused: NOT_FOUND, NOT_IN_CONTROL, RECORDING_RUNNING, RECORDING_WRONG_ROBOT, RECORDING_GAP,
            TOO_LARGE, NOT_TIMEABLE, PATH_IN_COLLISION, and whatever refuses a motion.
    """

    name: str
    """name of the recording."""
    factor: Annotated[float, Number(SLOWEST, FASTEST)] = field(default=1.0, kw_only=True)
    """speed relative to the recording, 0.1 to 4; the limits keep it down."""
    tolerance: Annotated[float, Number(1e-5, 0.1)] | None = field(default=None, kw_only=True)
    """how far the path may lie from a sample in any joint [rad or m]; None for as near as it can
    without following noise, 0.002 at best and 0.01 at most."""
    repeats: Annotated[int, Count(1, MOST_REPEATS)] = field(default=1, kw_only=True)
    """how many times; in between the robot goes softly back to the first sample."""
    begins: Time = field(default=0.0, kw_only=True)
    """first time of the recording that is played [s]."""
    ends: Time | None = field(default=None, kw_only=True)
    """last time that is played [s]; None for the end."""
    bridge: Annotated[float, Number(0, 2)] = field(default=0.25, kw_only=True)
    """longest gap that is played across [s]."""
