"""Replies on stored programs: lists, new revisions, conflicts.

Owns the fields of these answers. A change is acknowledged from the store's own answer only.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypedDict

from openpendant.simplemsg.pendant.management.programs import (
    ProgramHeading,
    ProgramHeadings,
    SavedProgram,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...events.reply_to import ReplyTo
from ...refusal import Refusal
from ...store.documents import DocumentKind, Heading
from ...store.requests import Answer
from ...store.store_errors import Conflict, StoreError

MOST_LISTED = 150
"""Greatest number of programs in one answer."""


def conflict(name: str, expected: int, found: Heading) -> Refusal | None:
    """Return the refusal with both revisions where a change was made from another than is kept."""
    if found.revision == expected:
        return None
    kind, kept = DocumentKind.PROGRAM, found.revision
    return Conflict(kind, name, expected, kept, found.saved_by, found.saved_at).refusal()


def not_the_kept_one(asked: int, kept: Heading) -> Refusal:
    """Return the refusal to run a revision in the place of which another is kept."""
    text = (
        f"revision {asked} was asked for, revision {kept.revision} is kept:"
        f" program {kept.name!r} was saved by {kept.saved_by!r} at {kept.saved_at}"
    )
    return _other_revision(text, kept.revision, asked)


def not_the_one_under_way(program: str, asked: int, running: int) -> Refusal:
    """Return the refusal to continue with another revision than the run started with."""
    text = (
        f"revision {asked} was asked for, revision {running} of program {program!r} is under way;"
        f" accepted: {running}, or {asked} after a program stop"
    )
    return _other_revision(text, running, asked)


def _other_revision(text: str, found: int, asked: int) -> Refusal:
    code = VerdictCode.REVISION_CONFLICT
    return Refusal(code, text, value=float(found), limit=float(asked))


def listed(found: Answer, reply: ReplyTo[ProgramHeadings], first: int) -> list[Effect]:
    """Answer with some of the headings, from one on."""
    if isinstance(found, StoreError):
        return reply.refuse(found.refusal())
    assert isinstance(found, tuple)
    headings = [each for each in found if isinstance(each, Heading)]
    end = first + MOST_LISTED
    shown: list[ProgramHeading] = [
        {
            "name": each.name,
            "revision": each.revision,
            "size": each.size,
            "saved_by": each.saved_by,
            "saved_at": each.saved_at,
            "deleted": each.deleted,
        }
        for each in headings[first:end]
    ]
    return reply.answer({"programs": shown, "next": end if end < len(headings) else None})


class KeptFields(TypedDict, total=False):
    """What an answer about a revision says of its breakpoints; nothing where it has had none.

    Attributes:
        breakpoints: the statements to pause before, from 0.
        dropped_breakpoints: how many are gone with their statements since they were set.
    """

    breakpoints: list[int]
    dropped_breakpoints: int


def saved(
    found: Answer, reply: ReplyTo[SavedProgram], about: KeptFields | None = None
) -> list[Effect]:
    """Answer after the store has a change: the point that is acknowledged is on the disk."""
    if isinstance(found, StoreError):
        return reply.refuse(found.refusal())
    assert isinstance(found, Heading)
    return reply.answer({"name": found.name, "revision": found.revision, **(about or {})})


def renamed(
    copy: Heading, deleted: Answer, reply: ReplyTo[SavedProgram], about: KeptFields
) -> list[Effect]:
    """Answer after the old name is gone, or say that it is still there."""
    if isinstance(deleted, StoreError):
        refusal = deleted.refusal()
        text = f"{copy.name!r} was saved, but the old name is still there: {refusal.sentence}"
        return reply.refuse(replace(refusal, text=text))
    return saved(copy, reply, about)
