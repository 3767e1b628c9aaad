"""What connections are told of changes that others made, where they asked for it by DECLARE."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Text, Topic
from .places import from_server


class NoticeKind(IntEnum):
    """Kind of what changed."""

    EVERYTHING = 0
    PROGRAM = 1
    RECORDING = 2
    FRAMES = 3
    TOOLS = 4
    SCENE = 5
    POSITIONS = 6
    SIGNALS = 7
    EXERCISE = 8
    ROBOT = 9


class Change(IntEnum):
    """What became of it."""

    NEW = 1
    CHANGED = 2
    RENAMED = 3
    DELETED = 4


@from_server(
    65055,
    "document_changed",
    "A document of the cell, or what its signals are, changed; for whoever declared the wish.",
    since=3,
)
class DocumentChanged(Topic):
    """DOCUMENT_CHANGED: leaves within a tick of the store's acknowledgement, to its maker too.

    A connection that reads too slowly is sent a single one of kind 0 in place of those it missed.
    """

    kind: Annotated[int, Int("what changed; 0: look at everything", values=NoticeKind)]
    revision: Annotated[int, Int("the one that is kept now, 0 where it was deleted")]
    session: Annotated[int, Int("connection that changed it, 0 for the server")]
    what: Annotated[int, Int("1 new, 2 changed, 3 renamed, 4 deleted", values=Change)]
    name: Annotated[str, Text("of the document", size=64)]
    from_name: Annotated[str, Text("its former name where it was renamed", size=64)]
    client: Annotated[str, Text("name of whoever changed it")]
