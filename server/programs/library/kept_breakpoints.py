"""Kept breakpoints of a cell's programs, which stay with their statements when programs change.

Owns the statements that they are before, and the revision of these numbers. The renumbering by a
change is `edit_history`'s; the runner pauses at them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias, TypedDict

from ...events.pending import Steps
from ...refusal import Refusal
from ...store.store_errors import NotFound
from ..editing.edit_history import Renumbering
from ..editing.program_tasks import CompareBodies, ProgramRefused
from ..language.linking import Linked
from .program_loader import ProgramLoader, ProgramWork

Places: TypeAlias = frozenset[int]
"""Numbers of statements, from 0."""

RunPlaces: TypeAlias = Mapping[str, Places]
"""Of each program of a run, by name."""


class KeptFields(TypedDict, total=False):
    """The breakpoints in an answer about a revision; empty where it has had none.

    Attributes:
        breakpoints: the statements to pause before, from 0.
        dropped_breakpoints: how many are gone with their statements since they were set.
    """

    breakpoints: list[int]
    dropped_breakpoints: int


@dataclass(frozen=True, slots=True)
class _Kept:
    """Breakpoints of one program.

    Attributes:
        revision: the revision of the numbers.
        dropped: number of those that were removed with their statements, and not reported at a run
            yet.
    """

    revision: int
    places: Places
    dropped: int = 0

    def moved(self, revision: int, renumbering: Renumbering) -> _Kept:
        """Return the breakpoints in another revision."""
        places = renumbering.places(self.places)
        return _Kept(revision, places, self.dropped + len(self.places) - len(places))


class KeptBreakpoints:
    """Breakpoints of one cell."""

    def __init__(self, loader: ProgramLoader, work: ProgramWork) -> None:
        self._loader = loader
        self._work = work
        self._kept: dict[str, _Kept] = {}

    def put(self, name: str, revision: int, places: Places) -> None:
        """Replace the breakpoints of a program."""
        self._kept[name] = _Kept(revision, places)

    def forget(self, name: str) -> None:
        """Remove the breakpoints of a program."""
        self._kept.pop(name, None)

    def rename(self, old: str, new: str, revision: int) -> None:
        """Move the breakpoints to a program's new name."""
        kept = self._kept.pop(old, None)
        self._kept.pop(new, None)
        if kept is not None:
            self._kept[new] = replace(kept, revision=revision)

    def move(self, name: str, before: int, after: int, renumbering: Renumbering) -> None:
        """Renumber the breakpoints for a change of a program from one revision to the next."""
        kept = self._kept.get(name)
        if kept is not None and kept.revision == before:
            self._kept[name] = kept.moved(after, renumbering)

    def fields(self, name: str, revision: int) -> KeptFields:
        """Return the breakpoint fields of an answer about a revision; empty if it never had any."""
        kept = self._kept.get(name)
        if kept is None or kept.revision != revision:
            return {}
        fields: KeptFields = {"breakpoints": sorted(kept.places)}
        if kept.dropped:
            fields["dropped_breakpoints"] = kept.dropped
        return fields

    def take_dropped(self, names: Iterable[str]) -> str:
        """Return the sentence on breakpoints that were dropped, once; empty if none was."""
        dropped = []
        for name in names:
            kept = self._kept.get(name)
            if kept is not None and kept.dropped:
                dropped.append(f"{kept.dropped} of {name!r}")
                self._kept[name] = replace(kept, dropped=0)
        named = ", ".join(dropped)
        return f"breakpoints dropped, their statements are gone: {named}" if named else ""

    def places(self, name: str, revision: int, body: str) -> Steps[Places | Refusal]:
        """Find the breakpoints of a program in a revision of it.

        Args:
            revision: the one in which they are sought; they are kept as of it where it is newer.
        """
        while True:
            kept = self._kept.get(name)
            if kept is None or kept.revision == revision:
                return frozenset() if kept is None else kept.places
            renumbering = yield from self._renumbering(name, kept.revision, body)
            if isinstance(renumbering, Refusal):
                return renumbering
            if self._kept.get(name) is kept:
                moved = kept.moved(revision, renumbering)
                if revision > kept.revision:
                    self._kept[name] = moved
                return moved.places

    def _renumbering(self, name: str, before: int, body: str) -> Steps[Renumbering | Refusal]:
        """Find the statements of a revision of a program again in the JSON of another."""
        found = yield from self._loader.document(name, before)
        if isinstance(found, Refusal):
            # The store keeps that revision no longer, so none of its statements can be found.
            return Renumbering(()) if found.code is NotFound.code else found
        done = yield from self._work.done(CompareBodies(found.body, name, body))
        if isinstance(done, ProgramRefused):
            return done.refusal
        assert isinstance(done, Renumbering)
        return done

    def of_run(self, linked: Linked) -> Steps[RunPlaces | Refusal]:
        """Find the breakpoints of all programs of a run, in the revisions that are to run."""
        found: dict[str, tuple[_Kept | None, Places]] = {}
        while True:
            name = next((each for each in linked.programs if not self._is_found(each, found)), None)
            if name is None:
                return {name: places for name, (_, places) in found.items()}
            places: Places | Refusal = frozenset()
            if name in self._kept:
                places = yield from self.places(name, linked.revisions[name], linked.sources[name])
            if isinstance(places, Refusal):
                return places
            found[name] = self._kept.get(name), places

    def _is_found(self, name: str, found: Mapping[str, tuple[_Kept | None, Places]]) -> bool:
        """Return True if nobody has changed a program's breakpoints since they were found."""
        return name in found and found[name][0] is self._kept.get(name)
