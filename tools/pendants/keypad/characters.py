"""Plain characters, the form of the paper: one for each pressed key, and increments only.

Owns which characters count. They carry no check, so silence is it: a character counts only where no
byte came for 5 ms before and after it, and rubbish bars all others for a while. A stream of noise
moves nothing. STOP counts always. `now` is monotonic time in ns.
"""

from __future__ import annotations

from dataclasses import dataclass

from .keys import LABELS, STOP

MS = 1_000_000

SILENT_NS = 5 * MS
"""Before and after a character that counts no other byte comes for so long [ns]."""

BARRED_NS = 200 * MS
"""After rubbish nothing counts for so long [ns]."""

LEAST_NS = 200 * MS
"""Five characters a second, at most; two within `PAIR_NS` are one."""

PAIR_NS = 80 * MS

_IGNORED = b"\r\n "


@dataclass(slots=True)
class CharacterReader:
    """Reads the keys of a keypad that sends plain characters.

    Attributes:
        received: bytes so far.
        bad: characters that did not count.
    """

    received: int = 0
    bad: int = 0
    _waiting: int | None = None
    _since: int = 0
    _last_byte: int | None = None
    _barred_until: int = 0
    _counted: int | None = None
    _in_pair: int = 0

    def receive(self, data: bytes, now: int) -> list[int]:
        """Take bytes [ns]; return the keys that count already: STOP only."""
        self.received += len(data)
        keys = self.tick(now)
        for byte in data:
            if byte in _IGNORED:
                continue
            key = LABELS.find(chr(byte))
            if key == STOP:
                keys.append(STOP)
            was_quiet = self._last_byte is None or now - self._last_byte >= SILENT_NS
            self._last_byte = now
            if key < 0 or not was_quiet:
                self._waiting = None
                self._barred_until = now + BARRED_NS
                self.bad += 1
            elif key != STOP and now >= self._barred_until:
                self._waiting, self._since = key, now
        return keys

    def tick(self, now: int) -> list[int]:
        """Advance the time; return the key that has had its silence."""
        if self._waiting is None or now - self._since < SILENT_NS:
            return []
        key, self._waiting = self._waiting, None
        return [key] if self._is_in_time(self._since) else []

    def _is_in_time(self, now: int) -> bool:
        """Return True if a character comes in time: one of a pair, or after a fifth of a second."""
        counted = self._counted
        if counted is None or now - counted >= LEAST_NS:
            self._counted, self._in_pair = now, 1
            return True
        self._in_pair += 1
        return self._in_pair == 2 and now - counted <= PAIR_NS
