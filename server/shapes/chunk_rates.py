"""Chunk rates: how often a connection may ask for shapes, and for chunks of a mesh.

At most one chunk is under way for a connection, and none begins while the connection has not read
so much that the chunk would make more than 64 KiB of it (promise 43).

Pure: `now` is an argument.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant.management.shapes import MOST_OF_CHUNK
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.lockout import SECOND_NS
from ..access.token_bucket import TokenBucket
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

    def unread_fault(self, session: int, unread: int) -> Refusal | None:
        """Return why a chunk that was begun is not read, which has ended then; None to go on.

        Args:
            unread: bytes that wait for the connection to read them.
        """
        if unread + _MOST_OF_ANSWER <= MOST_UNREAD:
            return None
        self.ended(session)
        text = f"{unread} bytes of earlier answers are unread; read them, then ask again"
        return _too_often(text, SECOND_NS // CHUNKS_PER_SECOND, CHUNKS_PER_SECOND)

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
