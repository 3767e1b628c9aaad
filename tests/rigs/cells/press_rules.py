"""The rules of keys and enabling devices, told anew: what must leave, by arrivals and ticks alone.

An oracle for random sequences. It knows no robot: whether a press was accepted is told to it, since
a robot that is being stopped takes none, and it says whether one may have been.
"""

from dataclasses import dataclass

from rigs.cells.server_rig import TICK

from openpendant.simplemsg.pendant import EnablingPosition, JogEnd

HELD, RELEASED = EnablingPosition.HELD, EnablingPosition.RELEASED
GRACE = 2 * TICK


@dataclass(slots=True)
class _Key:
    number: int
    deadline: int
    heard: int
    beat: int = 0


class PressRules:
    """One connection that jogs in a manual mode.

    Attributes:
        why: why the last press ended; None while one is held, and before the first.
        is_held: whether a key moves the robot.
    """

    def __init__(self, silence: int) -> None:
        """Begin with both hands open.

        Args:
            silence: deadline of the enabling device [ns].
        """
        self.why: JogEnd | None = None
        self._silence = silence
        self._key: _Key | None = None
        self._last = 0
        self._position, self._heard, self._is_fresh = RELEASED, 0, True
        self._stop_due: int | None = None  # after a device that was let go with the key held
        self._is_owed = False  # such a stop, whose ramp has not begun

    @property
    def is_held(self) -> bool:
        return self._key is not None

    def _end(self, why: JogEnd) -> None:
        self._key, self.why = None, why

    def judge(self, now: int) -> None:
        if self._key is not None and now >= self._key.heard + self._key.deadline:
            self._end(JogEnd.SILENT)

    def _is_enabled(self, now: int) -> bool:
        return self._is_fresh and self._position == HELD and now < self._heard + self._patience

    @property
    def _patience(self) -> int:
        if self._key is None:
            return self._silence
        return max(self._silence, self._key.deadline) + TICK

    # What arrives.

    def beat(self, press: int, number: int, now: int) -> None:
        key = self._key
        if key is not None and key.number == press and number > key.beat:
            if now < key.heard + key.deadline:
                key.beat, key.heard = number, now

    def device(self, position: int, now: int) -> bool:
        """Take a sign of the device; return True if a STOP leaves at once."""
        self.judge(now)
        was_silent = now >= self._heard + self._patience
        if position == RELEASED:
            self._is_fresh = True
            if self._key is not None:
                self._end(JogEnd.STOPPED)
                self._is_owed = True
        elif position != HELD:
            self._is_fresh = False
        elif self._position != RELEASED and was_silent:
            self._is_fresh = False
        self._position, self._heard = EnablingPosition(position), now
        if position == EnablingPosition.PANIC:
            self._stop()
            return True
        return False

    def released(self, press: int, now: int) -> None:
        """Take the release of a press; that of any but the last one accepted does nothing."""
        self.judge(now)
        if press != self._last:
            return
        if self._key is not None:
            self._end(JogEnd.RELEASED)
        elif self._is_owed or self._stop_due is not None:
            self.why = JogEnd.RELEASED
            self._is_owed, self._stop_due = False, None

    def may_press(self, now: int) -> bool:
        self.judge(now)
        return self._is_enabled(now) and not self._is_owed and self._stop_due is None

    def pressed(self, number: int, deadline: int, now: int) -> None:
        self._key, self._last, self.why = _Key(number, deadline, now), number, None

    def _stop(self) -> None:
        self._end(JogEnd.STOPPED)
        self._is_owed, self._stop_due = False, None

    def at_rest(self) -> None:
        """Take note that the robot has come to rest: there is nothing left to stop."""
        self._is_owed, self._stop_due = False, None

    def tick(self, now: int) -> bool:
        """Return True if a STOP leaves in this tick."""
        self.judge(now)
        if self._is_owed:
            self._is_owed, self._stop_due = False, now + GRACE
        is_due = self._stop_due is not None and now >= self._stop_due
        if is_due or (self._key is not None and not self._is_enabled(now)):
            self._stop()
            return True
        return False
