"""Change notices of one cell: who is told which change of its documents and signals.

Each change that the store acknowledged is told in the same turn, behind the answer to whoever made
it, to every connection that declared the wish; its maker is told as well. A connection that reads
too slowly misses single notices, and is sent one that says "look at everything" as soon as it reads
again, so that nothing is lost.

Owns what a change is called. Signals are told with the tick behind the report that changed them, at
most ten times a second. What a program takes or puts down is a change of the scene that is not
saved: it is told with the next tick, with the revision that the document has.
"""

from __future__ import annotations

from collections.abc import Mapping

from openpendant.simplemsg.pendant import Change, DocumentChanged, NoticeKind

from ...events.effects import Effect, Notify
from ...events.replies import NAME_BYTES, cut
from ...scene.planning_scene import PlanningScene
from ...scene.signals import CellSignals
from ...store.documents import MOST_NAME_BYTES, DocumentKind, Heading
from ...store.requests import Delete, RenameRecording, Request, Save, TrimRecording
from .notifications import Listeners

SIGNALS_PERIOD_NS = 100_000_000
"""Between two notices of changed signals [ns]."""

_KINDS: Mapping[DocumentKind, NoticeKind] = {
    kind: NoticeKind[kind.name] for kind in DocumentKind if kind.name in NoticeKind.__members__
}
"""Kinds of documents that are told of; accounts and settings are nobody's business."""


class DocumentNotices:
    """Notices of the changes in one cell."""

    def __init__(
        self,
        listeners: Listeners,
        signals: CellSignals | None,
        scene: PlanningScene | None,
        cell: str,
    ) -> None:
        """Have told nothing yet.

        Args:
            signals: None where the cell has none.
            scene: likewise.
        """
        self._listeners = listeners
        self._signals = signals
        self._scene = scene
        self._cell = cut(cell, MOST_NAME_BYTES)
        self._told_signals = self._told_handed_over = 0
        self._signals_due = 0
        self._missed: set[int] = set()

    def acknowledged(self, asked: Request, answer: object) -> list[Effect]:
        """Tell a change that the store has acknowledged; nothing where it changed nothing."""
        match asked, answer:
            case Save(renames=str()), Heading():
                # Told once the old name is gone, or stays.
                return []
            case Save(), Heading():
                what = Change.CHANGED if asked.expected_revision else Change.NEW
                return self._told(answer, asked.session, what)
            case Delete(renamed_to=Heading() as copy), Heading():
                return self._told(copy, asked.session, Change.RENAMED, from_name=asked.name)
            case Delete(renamed_to=Heading() as copy), _:
                return self._told(copy, asked.session, Change.NEW)
            case Delete(), Heading():
                return self._told(answer, asked.session, Change.DELETED)
            case TrimRecording(), Heading():
                return self._told(answer, asked.session, Change.NEW)
            case RenameRecording(), Heading():
                return self._told(answer, asked.session, Change.RENAMED, from_name=asked.name)
        return []

    def _told(
        self, heading: Heading, session: int, what: Change, from_name: str = ""
    ) -> list[Effect]:
        kind = _KINDS.get(heading.kind)
        if kind is None:
            return []
        notice = DocumentChanged(
            kind=kind,
            revision=0 if what is Change.DELETED else heading.revision,
            session=session,
            what=what,
            name=cut(heading.name, MOST_NAME_BYTES),
            from_name=cut(from_name, MOST_NAME_BYTES),
            client=cut(heading.saved_by, NAME_BYTES),
        )
        return self._to_whoever_wants(notice)

    def _to_whoever_wants(self, notice: DocumentChanged) -> list[Effect]:
        sessions = tuple(
            listener.session
            for listener in self._listeners.values()
            if listener.wants_notices and listener.looks_on and listener.session not in self._missed
        )
        return [Notify(sessions, notice)] if sessions else []

    def missed(self, sessions: tuple[int, ...]) -> None:
        """Take note of connections that read too slowly for a notice."""
        self._missed.update(sessions)

    def tick(self, now: int) -> list[Effect]:
        """Tell of changed signals, and have those look at everything who missed a notice."""
        out = self._signals_changed(now)
        scene = self._scene
        if scene is not None and scene.handed_over != self._told_handed_over:
            out += self._handed_over(scene)
        if self._missed:
            # Each is tried with every tick until it has room; who is gone or looks away is not.
            again = tuple(
                session
                for session in sorted(self._missed)
                if session in self._listeners and self._listeners[session].looks_on
            )
            self._missed.clear()
            if again:
                out.append(Notify(again, self._everything(NoticeKind.EVERYTHING, 0)))
        return out

    def _signals_changed(self, now: int) -> list[Effect]:
        if self._signals is None or now < self._signals_due:
            return []
        changes = self._signals.changes
        if changes == self._told_signals:
            return []
        self._told_signals = changes
        self._signals_due = now + SIGNALS_PERIOD_NS
        return self._to_whoever_wants(self._everything(NoticeKind.SIGNALS, changes))

    def _handed_over(self, scene: PlanningScene) -> list[Effect]:
        self._told_handed_over = scene.handed_over
        revision = scene.revisions[DocumentKind.SCENE]
        return self._to_whoever_wants(self._everything(NoticeKind.SCENE, revision))

    def _everything(self, kind: NoticeKind, revision: int) -> DocumentChanged:
        return DocumentChanged(
            kind=kind,
            revision=revision,
            session=0,
            what=Change.CHANGED,
            name=self._cell,
            from_name="",
            client="",
        )
