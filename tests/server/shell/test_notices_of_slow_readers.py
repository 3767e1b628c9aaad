"""Notices leave for whoever reads; of whoever does not, the core is told."""

from typing import Any, cast

from openpendant.server.events.effects import Notify
from openpendant.server.events.events import NoticesMissed
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.server.shell.cell_shell import CellShell, Outbox
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Role
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import Change, DocumentChanged, NoticeKind

NOTICE = DocumentChanged(NoticeKind.PROGRAM, 1, 0, Change.NEW, "main", "", "ann")


class Reader:
    """A client that reads, or does not."""

    def __init__(self, *, is_slow: bool) -> None:
        self.wire = Connection(Role.SERVER, PENDANT, ByteOrder.LITTLE)
        self.is_slow = is_slow
        self.written: list[bytes] = []

    def is_clogged(self) -> bool:
        return self.is_slow

    def write(self, frame: bytes) -> None:
        self.written.append(frame)


class DeafCore:
    """A core that answers an event with a notice for all, and notes what else it is told."""

    name = "cell"

    def __init__(self, sessions: tuple[int, ...]) -> None:
        self.sessions = sessions
        self.told: list[object] = []

    def handle(self, event: object, now: int) -> list[Notify]:
        self.told.append(event)
        return [] if isinstance(event, NoticesMissed) else [Notify(self.sessions, NOTICE)]


def test_the_core_is_told_who_was_too_slow_for_a_notice() -> None:
    readers = {1: Reader(is_slow=False), 2: Reader(is_slow=True), 3: Reader(is_slow=False)}
    links: dict[ControllerPath, Any] = {ControllerPath.MOTION: None}
    unused: Any = None
    outbox = Outbox(
        *(Journal(), "cell", "", links, cast(Any, readers), unused, unused, {}),
        *(lambda asked, answer: None, None, None),
    )
    core = DeafCore((1, 2, 3, 4))
    shell = CellShell(cast(Any, core), "", links, outbox)
    event: Any = "a change"
    shell.deliver(event, 5)
    assert core.told == [event, NoticesMissed((2,))]
    assert [len(each.written) for each in readers.values()] == [1, 0, 1]
    shell.deliver(event, 6)
    assert core.told[2:] == [event, NoticesMissed((2,))]
