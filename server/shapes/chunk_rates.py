"""Chunk rates: how often a connection may ask for shapes, and for chunks of a mesh.

Of a mesh at most one chunk is under way for a connection, and at most two come at once, so that no
connection has more than 64 KiB of meshes in this server (promise 43).

Pure: `now` is an argument.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..access.lockout import SECOND_NS
from ..access.token_bucket import TokenBucket
from ..refusal import Refusal

CHUNKS_PER_SECOND = 20
"""Chunks of a mesh in one second and connection."""

CHUNKS_AT_ONCE = 2
"""Chunks after a quiet time: together 64 KiB."""

ANSWERS_PER_SECOND = 20
"""Other answers in one second and connection."""

ANSWERS_AT_ONCE = 40
"""Other answers after a quiet time: a page shows all robots of the catalogue, and some twice."""


class ChunkRates:
    """The rates of all connections of a cell."""

    def __init__(self) -> None:
        """Know no connection yet."""
        self._chunks: dict[int, TokenBucket] = {}
        self._answers: dict[int, TokenBucket] = {}
        self._under_way: set[int] = set()

    def begin_chunk(self, session: int, now: int) -> Refusal | None:
        """Count a chunk, which is under way until `ended`; or say why it is refused."""
        if session in self._under_way:
            text = "the chunk before is under way; ask for the next once it came"
            return _too_often(text, SECOND_NS // CHUNKS_PER_SECOND, CHUNKS_PER_SECOND)
        bucket = self._chunks.get(session)
        if bucket is None:
            bucket = self._chunks[session] = TokenBucket(CHUNKS_PER_SECOND, CHUNKS_AT_ONCE)
        wait = bucket.take(now)
        if wait:
            text = f"more than {CHUNKS_PER_SECOND} chunks a second and connection"
            return _too_often(_later(text, wait), wait, CHUNKS_PER_SECOND)
        self._under_way.add(session)
        return None

    def ended(self, session: int) -> None:
        """Take note that the chunk of a connection was answered."""
        self._under_way.discard(session)

    def take_answer(self, session: int, now: int) -> Refusal | None:
        """Count another answer, or say why it is refused."""
        bucket = self._answers.get(session)
        if bucket is None:
            bucket = self._answers[session] = TokenBucket(ANSWERS_PER_SECOND, ANSWERS_AT_ONCE)
        wait = bucket.take(now)
        if not wait:
            return None
        text = f"more than {ANSWERS_PER_SECOND} answers on shapes a second and connection"
        return _too_often(_later(text, wait), wait, ANSWERS_PER_SECOND)

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self._chunks.pop(session, None)
        self._answers.pop(session, None)
        self._under_way.discard(session)


def _later(text: str, wait: int) -> str:
    return f"{text}; ask again in {wait / SECOND_NS:.3f} s"


def _too_often(text: str, wait: int, limit: int) -> Refusal:
    seconds = wait / SECOND_NS
    return Refusal(VerdictCode.TOO_OFTEN, text, value=seconds, limit=float(limit))
