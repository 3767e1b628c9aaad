"""Operations on the scene: objects around the robot, what may touch, and what the robot carries.

Lengths are m. The scene has a revision, which every change names and is answered by the next.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any, NotRequired, TypedDict

from ..roles import Permission
from .declaration import (
    Changed,
    Content,
    FoundPose,
    NeedsAuthority,
    Placed,
    Request,
    Revision,
    operation,
)


class Scene(TypedDict):
    """The scene as in a file of schema `openpendant-scene/1`, and its revision.

    Attributes:
        content: as in a file of schema `openpendant-scene/1`.
        revision: what the next change is made from.
    """

    content: dict[str, Any]
    revision: int


class Nearest(TypedDict):
    """The two bodies that are nearest to each other now.

    Attributes:
        distance: how near [m]; None where there is nothing to check.
        first: one of them.
        second: the other.
        first_point: the nearest point of the first, in base [m].
        second_point: likewise.
    """

    distance: float | None
    first: NotRequired[str]
    second: NotRequired[str]
    first_point: NotRequired[list[float]]
    second_point: NotRequired[list[float]]


class Attached(Changed):
    """The revision to make the next change from, and how the object is held.

    Attributes:
        revision: the one that is kept now: make the next change from it.
        distance: from the grasp point to the nearest point of the body [m]; 0 inside.
        grasp: pose of the object in the tool, or in the link where it is not the tool's.
    """

    distance: NotRequired[float]
    grasp: NotRequired[FoundPose]


@operation("scene.show", needs=Permission.OBSERVE)
class ShowScene(Request[Scene]):
    """Return the scene as a file's content, and its revision."""


@operation("scene.add", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.MOVING_OR_CARRIED)
class AddObject(Request[Changed]):
    """Add an object, also while the robot moves.

    Raises:
        Refused: REVISION_CONFLICT, BAD_FILE, DUPLICATE_OBJECT.
    """

    object: Content
    """as in a scene file: name, shape, position, quaternion, frame."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation(
    "scene.remove", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.MOVING_OR_CARRIED
)
class RemoveObject(Request[Changed]):
    """Remove an object.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
    """

    name: str
    """name of the object."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("scene.move", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.MOVING_OR_CARRIED)
class MoveObject(Request[Changed]):
    """Put an object elsewhere.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
    """

    name: str
    """name of the object."""
    pose: Placed
    """in base."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("scene.allow", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.WHILE_MOVING)
class AllowContact(Request[Changed]):
    """Let two bodies touch.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
    """

    first: str
    """one of them: an object, or a link of the robot."""
    second: str
    """the other."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("scene.forbid", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.WHILE_MOVING)
class ForbidContact(Request[Changed]):
    """Let two bodies touch no more.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
    """

    first: str
    """one of them: an object, or a link of the robot."""
    second: str
    """the other."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation(
    "scene.attach", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.ALWAYS, overtaken=True
)
class AttachObject(Request[Attached]):
    """Let a link take an object where both are now, if the object is within the tool's reach.

    Raises:
        Refused: NOTHING_GRIPPED with distance and reach, NOT_HELD where something holds it,
            REVISION_CONFLICT, UNKNOWN_OBJECT, UNKNOWN_FRAME, CHANGE_WHILE_MOVING, FEEDBACK_STALE.
    """

    name: str
    """name of the object."""
    link: str | None = field(default=None, kw_only=True)
    """the link, measured from its origin; None for the tool's, measured from its grasp point."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation(
    "scene.detach", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.ALWAYS, overtaken=True
)
class DetachObject(Request[Changed]):
    """Leave an object that the robot carries where it is now; it does not fall.

    Raises:
        Refused: NOT_HELD, REVISION_CONFLICT, UNKNOWN_OBJECT, CHANGE_WHILE_MOVING, FEEDBACK_STALE.
    """

    name: str
    """name of the object."""
    link: str | None = field(default=None, kw_only=True)
    """ignored; the server knows which link has it."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation(
    "scene.import", needs=Permission.CHANGE_SCENE, authority=NeedsAuthority.MOVING_OR_CARRIED
)
class ImportScene(Request[Changed]):
    """Replace the scene by that of a file's content.

    Raises:
        Refused: REVISION_CONFLICT, BAD_FILE, DUPLICATE_OBJECT.
    """

    content: Content
    """as in a file of schema `openpendant-scene/1`, without meshes."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("scene.nearest", needs=Permission.OBSERVE)
class NearestBodies(Request[Nearest]):
    """Return which two bodies are nearest to each other now, and how near.

    Raises:
        Refused: FEEDBACK_STALE.
    """
