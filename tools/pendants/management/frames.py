"""User frames: shown with the tools, changed, taught from points, and transformed into each other.

Lengths are m, quaternions x, y, z, w. Frames and tools have a revision each, which every change
names; `show` tells both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NotRequired, TypeAlias, TypedDict

from .calls import Request, asks, call


class PlacedPose(TypedDict):
    """A pose in some frame.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; left out for no rotation.
    """

    position: Sequence[float]
    orientation: NotRequired[Sequence[float]]


class FoundPose(TypedDict):
    """A pose that was worked out.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
    """

    position: list[float]
    orientation: list[float]


AnyPose: TypeAlias = PlacedPose | FoundPose
"""What a call takes: a pose that somebody wrote, or one that the server found."""

ORIGIN: PlacedPose = {"position": (0.0, 0.0, 0.0), "orientation": (0.0, 0.0, 0.0, 1.0)}


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


class Changed(TypedDict):
    """The revision to make the next change from.

    Attributes:
        revision: the one that is kept now: make the next change from it.
    """

    revision: int


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


class FrameCalls:
    """The operations on user frames."""

    @call
    def show(self) -> Request[Frames]:
        """Return all frames and tools, which tool is selected, and the revisions."""
        return asks("frames.show")

    @call
    def add(
        self, name: str, pose: AnyPose, expected_revision: int, *, parent: str = "base"
    ) -> Request[Changed]:
        """Add a user frame.

        Args:
            name: name of the frame.
            pose: of the frame in its parent.
            expected_revision: the one of the frames that the change was made from.
            parent: the frame that it hangs from.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks(
            "frames.add", name=name, pose=pose, expected_revision=expected_revision, parent=parent
        )

    @call
    def move(
        self, name: str, pose: AnyPose, expected_revision: int, *, parent: str | None = None
    ) -> Request[Changed]:
        """Put a user frame elsewhere.

        Args:
            name: name of the frame.
            pose: of the frame in its parent.
            expected_revision: the one of the frames that the change was made from.
            parent: the frame that it hangs from afterwards; None for the same.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks(
            "frames.move", name=name, pose=pose, expected_revision=expected_revision, parent=parent
        )

    @call
    def rename(self, name: str, new_name: str, expected_revision: int) -> Request[Changed]:
        """Give a user frame another name.

        Args:
            name: name of the frame.
            new_name: the name that it has afterwards.
            expected_revision: the one of the frames that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks(
            "frames.rename", name=name, new_name=new_name, expected_revision=expected_revision
        )

    @call
    def remove(self, name: str, expected_revision: int) -> Request[Changed]:
        """Remove a user frame from which no other hangs.

        Args:
            name: name of the frame.
            expected_revision: the one of the frames that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks("frames.remove", name=name, expected_revision=expected_revision)

    @call
    def teach(self, points: Sequence[Sequence[float]]) -> Request[TaughtFrame]:
        """Return the frame of three or four points; keeps nothing, `add` does.

        Args:
            points: in base [m]: origin, on x, on the side of y; or two on x and two on y.

        Raises:
            Refused: POOR_GEOMETRY.
        """
        return asks("frames.teach", points=points)

    @call
    def transform(
        self,
        source: str,
        target: str,
        *,
        pose: AnyPose = ORIGIN,
        seconds_ago: float = 0.0,
    ) -> Request[TransformedPose]:
        """Return where a pose of one frame is in another.

        Args:
            source: the frame that the pose is given in.
            target: the frame that it is wanted in.
            pose: the pose; the origin of the source where left out.
            seconds_ago: not now but then, up to ten seconds [s].

        Raises:
            Refused: UNKNOWN_FRAME, NOT_IN_HISTORY.
        """
        return asks(
            "frames.transform", source=source, target=target, pose=pose, seconds_ago=seconds_ago
        )

    @call
    def import_(self, content: Mapping[str, Any], expected_revision: int) -> Request[Changed]:
        """Replace all user frames by those of a file's content.

        Args:
            content: as in a file of schema `openpendant-frames/1`.
            expected_revision: the one of the frames that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, BAD_FILE, FRAME_REFUSED, CHANGE_WHILE_MOVING.
        """
        return asks("frames.import", content=content, expected_revision=expected_revision)
