"""One named frame, what it may be called, and the four frames that every robot has.

Owns the names that are the robot's. How frames hang together is `frames`'. A frame's pose is a
`pose.Pose` [m] in its parent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from .errors import BadArgument
from .pose import Pose

BASE, ROOT, FLANGE, TOOL = "base", "root", "flange", "tool"

LONGEST_NAME = 64


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame of the tree.

    Attributes:
        name: unique in the tree.
        parent: the frame that it hangs from; None for the base alone.
        pose: where it is in its parent; None if it moves.
        predefined: whether it belongs to the robot, and so cannot be changed.
    """

    name: str
    parent: str | None
    pose: Pose | None
    predefined: bool = False

    @property
    def moving(self) -> bool:
        """Whether only a time tells where it is."""
        return self.pose is None


def predefined_frames() -> Mapping[str, Frame]:
    """Return base, root, flange and tool: no root apart from the base, and no tool selected."""
    return MappingProxyType(
        {
            BASE: Frame(BASE, None, Pose.identity(), True),
            ROOT: Frame(ROOT, BASE, Pose.identity(), True),
            FLANGE: Frame(FLANGE, BASE, None, True),
            TOOL: Frame(TOOL, FLANGE, Pose.identity(), True),
        }
    )


def check_name(name: str) -> None:
    """Check that a frame may have a name.

    Raises:
        BadArgument: it is empty, longer than 64 characters, begins or ends with a space, or holds
            a character that cannot be printed.
    """
    if not (0 < len(name) <= LONGEST_NAME and name.isprintable() and name == name.strip()):
        accepted = f"1 to {LONGEST_NAME} printable characters, no space at the ends"
        raise BadArgument("name", name, accepted)
