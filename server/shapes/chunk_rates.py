"""Chunk rates: how often a connection may ask for shapes, and for chunks of a mesh.

At most one chunk is under way for a connection, and none begins while the connection has not read
so much that the chunk would make more than 64 KiB of it (promise 43).

Pure: `now` is an argument.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant.management.shapes import MOST_OF_CHUNK
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.token_bucket import SessionRates
from ..refusal import Refusal

CHUNKS_PER_SECOND = 20
"""Chunks of a mesh in one second and connection."""

CHUNKS_AT_ONCE = 2
"""Chunks after a quiet time; more than one so that a clock that runs unevenly refuses none."""

MOST_UNREAD = 65_536
"""Most bytes that wait for a connection once a chunk was added to them."""

_MOST_OF_ANSWER = 4 * -(-MOST_OF_CHUNK // 3) + 256
"""Most bytes of the frame with a chunk: base64, and the rest of it."""

ANSWERS_PER_SECOND = 20
"""Other answers in one second and connection."""

ANSWERS_AT_ONCE = 40
"""Other answers after a quiet time: a page shows all robots of the catalogue, and some twice."""


class ChunkRates:
    """The rates of all connections of a cell."""

    def __init__(self) -> None:
        """Know no connection yet."""
        self._chunks = SessionRates(CHUNKS_PER_SECOND, CHUNKS_AT_ONCE)
        self._answers = SessionRates(ANSWERS_PER_SECOND, ANSWERS_AT_ONCE)
        self._under_way: set[int] = set()

    def begin_chunk(self, session: int, now: int) -> Refusal | None:
        """Count a chunk, which is under way until `ended`; or say why it is refused."""
        if session in self._under_way:
            text = "the chunk before is under way; ask for the next once it came"
            return _not_yet(text)
        refusal = self._chunks.take(session, "chunks", now)
        if refusal is None:
            self._under_way.add(session)
        return refusal

    def unread_fault(self, session: int, unread: int) -> Refusal | None:
        """Return why a chunk that was begun is not read, which has ended then; None to go on.

        Args:
            unread: bytes that wait for the connection to read them.
        """
        if unread + _MOST_OF_ANSWER <= MOST_UNREAD:
            return None
        self.ended(session)
        text = f"{unread} bytes of earlier answers are unread; read them, then ask again"
        return _not_yet(text)

    def ended(self, session: int) -> None:
        """Take note that the chunk of a connection was answered."""
        self._under_way.discard(session)

    def take_answer(self, session: int, now: int) -> Refusal | None:
        """Count another answer, or say why it is refused."""
        return self._answers.take(session, "answers on shapes", now)

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self._chunks.forget(session)
        self._answers.forget(session)
        self._under_way.discard(session)


def _not_yet(text: str) -> Refusal:
    """Refuse a chunk until the next would be due."""
    seconds, limit = 1.0 / CHUNKS_PER_SECOND, float(CHUNKS_PER_SECOND)
    return Refusal(VerdictCode.TOO_OFTEN, text, value=seconds, limit=limit)
