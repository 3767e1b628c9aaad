"""The breakpoints of a cell's programs, which stay with their statements when programs change.

Owns which statements they are before, in which revision. What moves where is the business of
`programs.renumbering`, what a breakpoint does to a run the runner's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from ..outgoing import Outgoing
from ..programs.linking import Linked
from ..programs.renumbering import Renumbering
from ..programs.work import CompareBodies, Done, ProgramRefused
from ..refusal import Refusal
from ..store.documents import Document
from ..store.errors import NotFound
from .program_work import ProgramWork
from .shelf import ProgramShelf

Places: TypeAlias = frozenset[int]
"""Numbers of statements, from 0."""

ThenPlaces: TypeAlias = Callable[[Places | Refusal, int], list[Outgoing]]
RunPlaces: TypeAlias = Mapping[str, Places]
"""Of each program of a run, by name."""

ThenRun: TypeAlias = Callable[[Linked | Refusal, RunPlaces, int], list[Outgoing]]


@dataclass(frozen=True, slots=True)
class _Kept:
    """The breakpoints of one program.

    Attributes:
        revision: the one that the numbers are of.
        places: the statements to pause before.
        dropped: how many went with their statements, and nobody was told at a run yet.
    """

    revision: int
    places: Places
    dropped: int = 0

    def moved(self, revision: int, renumbering: Renumbering) -> _Kept:
        """Return those of another revision."""
        places = renumbering.places(self.places)
        return _Kept(revision, places, self.dropped + len(self.places) - len(places))


class KeptBreakpoints:
    """The breakpoints of one cell."""

    def __init__(self, shelf: ProgramShelf, work: ProgramWork) -> None:
        """Begin with none.

        Args:
            shelf: loads the revisions that they were of.
            work: finds statements again.
        """
        self._shelf = shelf
        self._work = work
        self._kept: dict[str, _Kept] = {}

    def put(self, name: str, revision: int, places: Places) -> None:
        """Keep the breakpoints of a program in the place of those it had."""
        self._kept[name] = _Kept(revision, places)

    def forget(self, name: str) -> None:
        """Keep none of a program."""
        self._kept.pop(name, None)

    def rename(self, old: str, new: str, revision: int) -> None:
        """Take the breakpoints along to a program's new name."""
        kept = self._kept.pop(old, None)
        self._kept.pop(new, None)
        if kept is not None:
            self._kept[new] = replace(kept, revision=revision)

    def move(self, name: str, before: int, after: int, renumbering: Renumbering) -> None:
        """Follow a change of a program from one revision to the next."""
        kept = self._kept.get(name)
        if kept is not None and kept.revision == before:
            self._kept[name] = kept.moved(after, renumbering)

    def fields(self, name: str, revision: int) -> dict[str, Any]:
        """Return what an answer about a revision says of them; nothing where it has had none."""
        kept = self._kept.get(name)
        if kept is None or kept.revision != revision:
            return {}
        dropped = {"dropped_breakpoints": kept.dropped} if kept.dropped else {}
        return {"breakpoints": sorted(kept.places), **dropped}

    def take_dropped(self, names: Iterable[str]) -> str:
        """Return the sentence on breakpoints that were dropped, once; empty where none was."""
        told = []
        for name in names:
            kept = self._kept.get(name)
            if kept is not None and kept.dropped:
                told.append(f"{kept.dropped} of {name!r}")
                self._kept[name] = replace(kept, dropped=0)
        return f"breakpoints dropped, their statements are gone: {', '.join(told)}" if told else ""

    def follow(
        self, name: str, revision: int, body: str, then: ThenPlaces, now: int
    ) -> list[Outgoing]:
        """Find the breakpoints of a program in a revision of it.

        Args:
            name: of the program.
            revision: the one in which they are sought; they are kept as of it where it is newer.
            body: its JSON.
            then: gets the places, or why nobody can tell them now.
            now: monotonic time, ns.
        """
        kept = self._kept.get(name)
        if kept is None or kept.revision == revision:
            return then(frozenset() if kept is None else kept.places, now)

        def loaded(found: Document | Refusal, now: int) -> list[Outgoing]:
            if isinstance(found, Document):
                return self._work.ask(CompareBodies(found.body, name, body), compared, now)
            # Of a revision that is kept no more, nothing is left to find.
            return (
                arrived(Renumbering(()), now) if found.code is NotFound.code else then(found, now)
            )

        def compared(done: Done | ProgramRefused, now: int) -> list[Outgoing]:
            if isinstance(done, ProgramRefused):
                return then(done.refusal, now)
            assert isinstance(done, Renumbering)
            return arrived(done, now)

        def arrived(renumbering: Renumbering, now: int) -> list[Outgoing]:
            if self._kept.get(name) is not kept:
                return self.follow(name, revision, body, then, now)
            moved = kept.moved(revision, renumbering)
            if revision > kept.revision:
                self._kept[name] = moved
            return then(moved.places, now)

        return self._shelf.load(name, loaded, kept.revision)

    def of_run(self, linked: Linked | Refusal, now: int, then: ThenRun) -> list[Outgoing]:
        """Find the breakpoints of all programs of a run, in the revisions that are to run.

        Args:
            linked: the programs, or why there is no run.
            now: monotonic time, ns.
            then: gets the programs with the places, or why there is no run.
        """
        if isinstance(linked, Refusal):
            return then(linked, {}, now)
        return self._of_run(linked, {}, then, now)

    def _of_run(
        self,
        linked: Linked,
        found: dict[str, tuple[_Kept | None, Places]],
        then: ThenRun,
        now: int,
    ) -> list[Outgoing]:
        for name in linked.programs:
            kept = self._kept.get(name)
            if name in found and found[name][0] is kept:
                continue

            def followed(places: Places | Refusal, now: int, name: str = name) -> list[Outgoing]:
                if isinstance(places, Refusal):
                    return then(places, {}, now)
                found[name] = self._kept.get(name), places
                return self._of_run(linked, found, then, now)

            if kept is not None:
                revision, body = linked.revisions[name], linked.sources[name]
                return self.follow(name, revision, body, followed, now)
            found[name] = None, frozenset()
        return then(linked, {name: places for name, (_, places) in found.items()}, now)
