"""Operations on user frames: shown with the tools, changed, taught, transformed into each other.

Lengths are m, quaternions x, y, z, w. Frames and tools have a revision each, which every change
names; `show` tells both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated, Any, TypedDict

from ..roles import Permission
from .declaration import Content, Length, Number, ReadAs, Request, Revision, Vector, operation
from .poses import ORIGIN, FoundPose, Placed
from .replies import Changed


class Frames(TypedDict):
    """All frames and tools.

    Attributes:
        content: user frames and tools, as in a file of schema `openpendant-frames/1`.
        names: of all frames, the robot's own among them.
        frames_revision: what a change of frames is made from.
        tools_revision: what a change of tools is made from.
        problems: what is wrong with a document of the store, by its kind.
    """

    content: dict[str, Any]
    names: list[str]
    frames_revision: int
    tools_revision: int
    problems: dict[str, str]


class TaughtFrame(TypedDict):
    """The frame of some points, and how well they determine it.

    Attributes:
        pose: the frame in base.
        angle: between the directions taught for x and y [rad]; π/2 determines best.
        tilt_per_error: by how much the frame tilts where a point is off [rad per m of error].
        skew: by how much the axes miss the right angle [rad]; 0 for three points.
    """

    pose: FoundPose
    angle: float
    tilt_per_error: float
    skew: float


class TransformedPose(TypedDict):
    """The pose in the target frame.

    Attributes:
        pose: in the target frame.
    """

    pose: FoundPose


@operation("frames.show", needs=Permission.OBSERVE)
class ShowFrames(Request[Frames]):
    """Return all frames and tools, which tool is selected, and the revisions."""


@operation("frames.add", needs=Permission.CHANGE_FRAMES)
class AddFrame(Request[Changed]):
    """Add a user frame.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the frame."""
    parent: str = field(default="base", kw_only=True)
    """the frame that it hangs from."""
    pose: Placed
    """of the frame in its parent."""
    expected_revision: Revision
    """the one of the frames that the change was made from."""


@operation("frames.move", needs=Permission.CHANGE_FRAMES)
class MoveFrame(Request[Changed]):
    """Put a user frame elsewhere.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the frame."""
    parent: str | None = field(default=None, kw_only=True)
    """the frame that it hangs from afterwards; None for the same."""
    pose: Placed
    """of the frame in its parent."""
    expected_revision: Revision
    """the one of the frames that the change was made from."""


@operation("frames.rename", needs=Permission.CHANGE_FRAMES)
class RenameFrame(Request[Changed]):
    """Give a user frame another name.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the frame."""
    new_name: str
    """the name that it has afterwards."""
    expected_revision: Revision
    """the one of the frames that the change was made from."""


@operation("frames.remove", needs=Permission.CHANGE_FRAMES)
class RemoveFrame(Request[Changed]):
    """Remove a user frame from which no other hangs.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the frame."""
    expected_revision: Revision
    """the one of the frames that the change was made from."""


@operation("frames.teach", needs=Permission.CHANGE_FRAMES)
class TeachFrame(Request[TaughtFrame]):
    """Return the frame of three or four points; keeps nothing, `add` does.

    Raises:
        Refused: POOR_GEOMETRY.
    """

    points: Annotated[
        Sequence[Sequence[float]], ReadAs(Annotated[tuple[Vector, ...], Length(3, 4)])
    ]
    """in base [m]: origin, on x, on the side of y; or two on x and two on y."""


@operation("frames.transform", needs=Permission.OBSERVE)
class TransformPose(Request[TransformedPose]):
    """Return where a pose of one frame is in another.

    Raises:
        Refused: UNKNOWN_FRAME, NOT_IN_HISTORY.
    """

    source: str
    """the frame that the pose is given in."""
    target: str
    """the frame that it is wanted in."""
    pose: Placed = field(default_factory=ORIGIN.copy, kw_only=True)
    """the pose; the origin of the source where left out."""
    seconds_ago: Annotated[float, Number(0, 10)] = field(default=0.0, kw_only=True)
    """not now but then, up to ten seconds [s]."""


@operation("frames.import", needs=Permission.CHANGE_FRAMES)
class ImportFrames(Request[Changed]):
    """Replace all user frames by those of a file's content.

    Raises:
        Refused: REVISION_CONFLICT, BAD_FILE, FRAME_REFUSED, CHANGE_WHILE_MOVING.
    """

    content: Content
    """as in a file of schema `openpendant-frames/1`."""
    expected_revision: Revision
    """the one of the frames that the change was made from."""
