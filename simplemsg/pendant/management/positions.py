"""Operations on named positions: joint positions that a cell keeps by name, and those of its robot.

Joint positions are of the controller's driven joints in file order [rad or m]. The message HOME
takes the name of any of them. The positions of a cell have one revision, which every change names;
`positions.list` tells it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated, Literal, TypedDict

from ..roles import Permission
from .declaration import Changed, FoundPose, Length, ReadAs, Real, Request, Revision, operation

MOST_POSITIONS = 100
"""Greatest number of positions that a cell keeps beside those of its robot's file."""

MOST_NAME_BYTES = 32
"""Greatest number of bytes of UTF-8 of a position's name: the size of HOME's field."""


class NamedPosition(TypedDict):
    """A joint position with a name.

    Attributes:
        name: what HOME takes in `target`.
        kind: `robot` of the robot's file, which nobody changes here; `user` of this cell.
        joints: one value per driven joint [rad or m].
        pose: there, of the tool in base.
        condition: greatest over least singular value of the Jacobian, lengths in arm's sizes; None
            at a singularity.
        legal: whether the robot may stand there: inside its limits, and nothing touches.
        why: what forbids it, in words; empty where it may.
    """

    name: str
    kind: Literal["robot", "user"]
    joints: list[float]
    pose: FoundPose
    condition: float | None
    legal: bool
    why: str


class NamedPositions(TypedDict):
    """All positions that have a name.

    Attributes:
        positions: those of the robot's file first, then those of the cell by name.
        revision: what a change is made from.
        problem: what is wrong with the document of the store; empty for nothing.
    """

    positions: list[NamedPosition]
    revision: int
    problem: str


class SavedPosition(TypedDict):
    """The position is kept.

    Attributes:
        revision: the one that is kept now: make the next change from it.
        warning: what to know before a motion there: near a singularity or a limit, or something
            touches; None for nothing.
    """

    revision: int
    warning: str | None


@operation("positions.list", needs=Permission.OBSERVE, since=3)
class ListPositions(Request[NamedPositions]):
    """Return every named position, whether the robot may stand there, and the revision.

    Counts as a question on kinematics.

    Raises:
        Refused: TOO_OFTEN; STORE_BUSY while the store is being read.
    """


@operation("positions.save", needs=Permission.EDIT_PROGRAM, since=3)
class SavePosition(Request[SavedPosition]):
    """Give a joint position a name; where it has one already in this cell, that is moved.

    Raises:
        Refused: REVISION_CONFLICT, BAD_ARGUMENT for a name that is none or the robot's own,
            TOO_LARGE for more than 100, WRONG_JOINT_COUNT, OUT_OF_RANGE, and for where the robot
            stands MOVING, FEEDBACK_STALE.
    """

    name: str
    """what it is called: 1 to 32 printable bytes."""
    joints: Annotated[
        Sequence[float] | None, ReadAs(Annotated[tuple[Real, ...], Length(None, 10)] | None)
    ] = field(default=None, kw_only=True)
    """one value per driven joint [rad or m]; None for where the robot stands."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("positions.rename", needs=Permission.EDIT_PROGRAM, since=3)
class RenamePosition(Request[Changed]):
    """Give a position of this cell another name.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_POSITION, NAME_TAKEN, BAD_ARGUMENT for a name that is
            none or the robot's own.
    """

    name: str
    """the name that it has."""
    new_name: str
    """the name that it has afterwards."""
    expected_revision: Revision
    """the one that the change was made from."""


@operation("positions.delete", needs=Permission.EDIT_PROGRAM, since=3)
class DeletePosition(Request[Changed]):
    """Forget a position of this cell.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_POSITION, BAD_ARGUMENT for one of the robot's own.
    """

    name: str
    """the name that it has."""
    expected_revision: Revision
    """the one that the change was made from."""
