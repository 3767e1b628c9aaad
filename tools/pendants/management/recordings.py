"""Continuous recordings of a motion: begun, ended, cut, and played back at another speed.

Times are seconds from the first sample.
"""

from __future__ import annotations

from typing import NotRequired, TypedDict

from .calls import Request, asks, call


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


class RecordingCalls:
    """The operations on recordings; `play` moves the robot and is the clients' own."""

    @call
    def list(self, *, first: int = 0) -> Request[Recordings]:
        """Return which recordings there are, 100 at a time, and which one is under way.

        Args:
            first: how many to leave out at the beginning.
        """
        return asks("recordings.list", first=first)

    @call
    def describe(self, name: str) -> Request[RecordingDescription]:
        """Return what a recording is: robot, joints, rate, duration, gaps, problem.

        Args:
            name: name of the recording.

        Raises:
            Refused: NOT_FOUND.
        """
        return asks("recordings.describe", name=name)

    @call
    def start(self, name: str) -> Request[RecordingMade]:
        """Begin a recording; answered once it is kept.

        Where it ends by itself, an aborted OUTCOME of the request says why; so does `list`.

        Args:
            name: name of the new recording.

        Raises:
            Refused: RECORDING_RUNNING, BAD_NAME, REVISION_CONFLICT: there is one of this name.
        """
        return asks("recordings.start", name=name)

    @call
    def stop(self) -> Request[RecordingMade]:
        """End the recording under way; answered once all of it is kept.

        Raises:
            Refused: NOT_RECORDING, or why the recording ended by itself before.
        """
        return asks("recordings.stop")

    @call
    def trim(
        self, name: str, new_name: str, *, begins: float = 0.0, ends: float | None = None
    ) -> Request[ChangedRecording]:
        """Save a part of a recording as a new one.

        Args:
            name: name of the recording.
            new_name: name of the part.
            begins: first time that is kept [s].
            ends: last time that is kept [s]; None for the end.

        Raises:
            Refused: NOT_FOUND, BAD_NAME, REVISION_CONFLICT: the new name is taken.
        """
        return asks("recordings.trim", name=name, new_name=new_name, begins=begins, ends=ends)

    @call
    def rename(self, name: str, new_name: str, expected_revision: int) -> Request[ChangedRecording]:
        """Give a recording another name.

        Args:
            name: name of the recording.
            new_name: the name that it has afterwards.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: NOT_FOUND, BAD_NAME, REVISION_CONFLICT, RECORDING_RUNNING.
        """
        return asks(
            "recordings.rename", name=name, new_name=new_name, expected_revision=expected_revision
        )

    @call
    def delete(self, name: str, expected_revision: int) -> Request[ChangedRecording]:
        """Delete a recording; its samples are gone at once.

        Args:
            name: name of the recording.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: NOT_FOUND, REVISION_CONFLICT, RECORDING_RUNNING.
        """
        return asks("recordings.delete", name=name, expected_revision=expected_revision)


def play(
    name: str,
    *,
    factor: float = 1.0,
    tolerance: float | None = None,
    repeats: int = 1,
    begins: float = 0.0,
    ends: float | None = None,
    bridge: float = 0.25,
) -> Request[PlaybackAccount]:
    """Play a recording back; answered when it is planned, and the motion begins with the answer.

    The robot goes softly to the first sample first. The end is told by an OUTCOME of the request.

    Args:
        name: name of the recording.
        factor: speed relative to the recording, 0.1 to 4; the limits keep it down.
        tolerance: how far the path may lie from a sample in any joint [rad or m]; None for as near
            as it can without following noise, 0.002 at best and 0.01 at most.
        repeats: how many times; in between the robot goes softly back to the first sample.
        begins: first time of the recording that is played [s].
        ends: last time that is played [s]; None for the end.
        bridge: longest gap that is played across [s].

    Raises:
        Refused: NOT_FOUND, NOT_IN_CONTROL, RECORDING_RUNNING, RECORDING_WRONG_ROBOT,
            RECORDING_GAP, TOO_LARGE, NOT_TIMEABLE, PATH_IN_COLLISION, and whatever refuses
            a motion.
    """
    return asks(
        "recordings.play",
        name=name,
        factor=factor,
        tolerance=tolerance,
        repeats=repeats,
        begins=begins,
        ends=ends,
        bridge=bridge,
    )
