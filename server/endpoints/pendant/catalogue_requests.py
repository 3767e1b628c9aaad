"""Questions about the protocol itself: its catalogue, in chunks that fit a frame."""

from __future__ import annotations

from openpendant.simplemsg.pendant import PROTOCOL_VERSION
from openpendant.simplemsg.pendant.catalogue import PARTS, entries
from openpendant.simplemsg.pendant.management.catalogue import CatalogueChunk, ReadCatalogue
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...refusal import Refusal

MOST_CHUNK = 48_000
"""Largest body of an answer [bytes]."""

_AROUND = 256
"""What stands around the entries of an answer, at most [bytes]."""


class CatalogueRequests:
    """The catalogue of codes, messages and operations."""

    def __init__(self) -> None:
        """Make the entries now: the first question would hold the event loop for too long."""
        for part in PARTS:
            entries(part)

    @handles(ReadCatalogue)
    def _read(self, asked: ReadCatalogue, reply: ReplyTo[CatalogueChunk], now: int) -> list[Effect]:
        found = entries(asked.part)
        total, offset = len(found), asked.offset
        if offset >= total:
            text = f"catalogue.offset: {offset}; {asked.part} has {total} entries, from 0"
            return reply.refuse(
                Refusal(VerdictCode.BAD_ARGUMENT, text, value=offset, limit=total - 1)
            )
        left, end = MOST_CHUNK - _AROUND, offset
        while end < total and (left := left - len(found[end].encode()) - 1) >= 0:
            end += 1
        following = str(end) if end < total else "null"
        return reply.answer_text(
            f'{{"version":{PROTOCOL_VERSION},"part":"{asked.part}","offset":{offset},'
            f'"total":{total},"entries":[{",".join(found[offset:end])}],"next":{following}}}'
        )
