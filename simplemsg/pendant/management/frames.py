"""Operations on user frames and tools: shown, changed, taught, calibrated, selected, transformed.

Lengths are m, quaternions x, y, z, w. Frames and tools have a revision each, which every change
names; `frames.show` tells both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated, Any, NotRequired, TypedDict

from ..roles import Permission
from .declaration import (
    ORIGIN,
    Changed,
    Content,
    Count,
    Default,
    FoundPose,
    Length,
    NeedsAuthority,
    Number,
    Placed,
    ReadAs,
    ReadAsKeys,
    Real,
    Request,
    Revision,
    Strictly,
    Vector,
    operation,
)


class Frames(TypedDict):
    """All frames and tools, or those of a part.

    Attributes:
        content: user frames and tools, as in a file of schema `openpendant-frames/1`.
        names: of all frames, the robot's own among them; in a part, of what it holds.
        frames_revision: what a change of frames is made from.
        tools_revision: what a change of tools is made from.
        problems: what is wrong with a document of the store, by its kind.
        total: in a part, how many tools and user frames there are.
        next: in a part, the `first` of the next one; null in the last.
    """

    content: dict[str, Any]
    names: list[str]
    frames_revision: int
    tools_revision: int
    problems: dict[str, str]
    total: NotRequired[int]
    next: NotRequired[int | None]


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
    """Return all frames and tools, which tool is selected, and the revisions.

    Parts belong together where both revisions are the same in them.

    Raises:
        Refused: TOO_LARGE where all do not fit an answer, so that they are to be asked for in
            parts, from 0 on; BAD_ARGUMENT where nothing is left from `first` on.
    """

    first: Annotated[int | None, ReadAs(Annotated[int, Count(0)] | None)] = field(
        default=None, kw_only=True
    )
    """the part of 50 entries from this number on, the tools being the first; null for all."""


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


class CalibratedTool(TypedDict):
    """A tool centre point, and how well the positions determine it.

    Attributes:
        position: x, y, z in the flange [m].
        residuals: how far each position's centre stays from the point that was touched [m].
        max_residual: the largest of them [m].
        uncertainty: of the centre point [m]; None where it cannot be told.
    """

    position: list[float]
    residuals: list[float]
    max_residual: float
    uncertainty: float | None


@operation(
    "tools.import", needs=Permission.CHANGE_TOOLS, authority=NeedsAuthority.ALWAYS, overtaken=True
)
class ImportTools(Request[Changed]):
    """Replace all tools by those of a file's content.

    Raises:
        Refused: REVISION_CONFLICT, BAD_FILE, FRAME_REFUSED, CHANGE_WHILE_MOVING.
    """

    content: Content
    """as in a file of schema `openpendant-frames/1`."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


class ToolGrasp(TypedDict):
    """Where a tool grasps; what is left out is as of the bare flange.

    Attributes:
        point: the grasp point in the tool's frame [m]; left out for its origin.
        reach: how far from the point the body of an object may be, 0 to 0.05 [m]; left out
            for 0.010.
        part: number of the input of an emulated controller that says that the tool has a part: 1
            after a grasp, 0 after one that missed and after letting go; left out for none.
    """

    point: NotRequired[Annotated[Vector, Default((0.0, 0.0, 0.0))]]
    reach: NotRequired[Annotated[float, Strictly(), Number(0.0, 0.05, finite=True), Default(0.010)]]
    part: NotRequired[
        Annotated[Annotated[int, Strictly(), Count(0, below=512)] | None, Default(None)]
    ]


@operation("tools.add", needs=Permission.CHANGE_TOOLS)
class AddTool(Request[Changed]):
    """Add a tool.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the tool."""
    tcp: Placed
    """its centre point in the flange."""
    grasp: Annotated[ToolGrasp, ReadAsKeys(ToolGrasp)] | None = field(default=None, kw_only=True)
    """where it grasps; None for the default."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.move", needs=Permission.CHANGE_TOOLS, authority=NeedsAuthority.SELECTED_TOOL)
class MoveTool(Request[Changed]):
    """Give a tool another centre point and another grasp.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the tool."""
    tcp: Placed
    """its centre point in the flange."""
    grasp: Annotated[ToolGrasp, ReadAsKeys(ToolGrasp)] | None = field(default=None, kw_only=True)
    """where it grasps; None for the default, not for the one it had."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.remove", needs=Permission.CHANGE_TOOLS)
class RemoveTool(Request[Changed]):
    """Remove a tool that is not selected.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the tool."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation(
    "tools.select", needs=Permission.CHANGE_TOOLS, authority=NeedsAuthority.ALWAYS, overtaken=True
)
class SelectTool(Request[Changed]):
    """Select a tool; in force once it is answered.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str | None
    """name of the tool; None for the bare flange."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.calibrate", needs=Permission.CHANGE_TOOLS)
class CalibrateTool(Request[CalibratedTool]):
    """Return the centre point of the tool that touched one point; keeps nothing, `add` does.

    Raises:
        Refused: POOR_GEOMETRY, WRONG_JOINT_COUNT.
    """

    positions: Annotated[
        Sequence[Sequence[float]], ReadAs(Annotated[tuple[tuple[Real, ...], ...], Length(4, 20)])
    ]
    """4 to 20 joint positions that touch it [rad, m for a linear axis]."""
