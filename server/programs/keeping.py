"""What a program has to be before it is kept: one rule for pendants that save and for imports.

Reading the source is `work.read_source`; this judges its head, which is enough. Whether its points
are in reach is asked where it is run, as limits may change.
"""

from __future__ import annotations

from .document import program_from_json
from .errors import BadValue
from .program import OwnRobot, Program, check_robot
from .work import SourceRead


def check_to_be_kept(read: SourceRead, own: OwnRobot | None, name: str | None = None) -> Program:
    """Return the head of a program that may be kept.

    Args:
        read: the program, as it was read.
        own: the robot that it shall be of; None where that robot is not known here.
        name: what it is to be kept as; None where it is only looked at.

    Raises:
        WrongRobot: it is of another robot, or was taught on other joints.
        BadValue: it says another name.
    """
    head = program_from_json(read.head)
    if own is not None:
        check_robot(head, own.name, own.limits)
    if name is not None and head.name != name:
        raise BadValue("the program's name", f"is {head.name!r}; accepted: {name!r}", part="name")
    return head
