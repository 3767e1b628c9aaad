"""The scene: objects around the robot, which of them may touch, and what the robot carries.

Lengths are m. The scene has a revision, which every change names and is answered by the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NotRequired, TypedDict

from .calls import Request, asks, call
from .frames import AnyPose, Changed


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


class SceneCalls:
    """The operations on the scene."""

    @call
    def show(self) -> Request[Scene]:
        """Return the scene as a file's content, and its revision."""
        return asks("scene.show")

    @call
    def add(self, object: Mapping[str, Any], expected_revision: int) -> Request[Changed]:
        """Add an object, also while the robot moves.

        Args:
            object: as in a scene file: name, shape, position, quaternion, frame.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, BAD_FILE, DUPLICATE_OBJECT.
        """
        return asks("scene.add", object=object, expected_revision=expected_revision)

    @call
    def remove(self, name: str, expected_revision: int) -> Request[Changed]:
        """Remove an object.

        Args:
            name: name of the object.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
        """
        return asks("scene.remove", name=name, expected_revision=expected_revision)

    @call
    def move(self, name: str, pose: AnyPose, expected_revision: int) -> Request[Changed]:
        """Put an object elsewhere.

        Args:
            name: name of the object.
            pose: in base.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
        """
        return asks("scene.move", name=name, pose=pose, expected_revision=expected_revision)

    @call
    def allow(self, first: str, second: str, expected_revision: int) -> Request[Changed]:
        """Let two bodies touch.

        Args:
            first: one of them: an object, or a link of the robot.
            second: the other.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
        """
        return asks("scene.allow", first=first, second=second, expected_revision=expected_revision)

    @call
    def forbid(self, first: str, second: str, expected_revision: int) -> Request[Changed]:
        """Let two bodies touch no more.

        Args:
            first: one of them: an object, or a link of the robot.
            second: the other.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
        """
        return asks("scene.forbid", first=first, second=second, expected_revision=expected_revision)

    @call
    def attach(
        self, name: str, expected_revision: int, *, link: str | None = None
    ) -> Request[Changed]:
        """Let a link take an object where both are now.

        Args:
            name: name of the object.
            expected_revision: the one that the change was made from.
            link: the link; None for the one that tools are bolted to.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_OBJECT, UNKNOWN_FRAME.
        """
        return asks("scene.attach", name=name, expected_revision=expected_revision, link=link)

    @call
    def detach(
        self, name: str, expected_revision: int, *, link: str | None = None
    ) -> Request[Changed]:
        """Leave an object that the robot carries where it is now.

        Args:
            name: name of the object.
            expected_revision: the one that the change was made from.
            link: ignored; the server knows which link has it.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_OBJECT.
        """
        return asks("scene.detach", name=name, expected_revision=expected_revision, link=link)

    @call
    def import_(self, content: Mapping[str, Any], expected_revision: int) -> Request[Changed]:
        """Replace the scene by that of a file's content.

        Args:
            content: as in a file of schema `openpendant-scene/1`, without meshes.
            expected_revision: the one that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, BAD_FILE, DUPLICATE_OBJECT.
        """
        return asks("scene.import", content=content, expected_revision=expected_revision)

    @call
    def nearest(self) -> Request[Nearest]:
        """Return which two bodies are nearest to each other now, and how near.

        Raises:
            Refused: FEEDBACK_STALE.
        """
        return asks("scene.nearest")
