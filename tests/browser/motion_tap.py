"""A relay in front of the emulator, which notes when each set-point and each STOP goes by."""

from __future__ import annotations

import statistics
import struct
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from browser.loopback_relay import LoopbackRelay

POINT, FULL_POINT, STOP = 11, 14, -4
AT_REST = 0.1
"""A robot that no set-point went to for so long stands [s]; a jog sends one each tick."""
RAMP_IS_OVER = 0.03
"""Three ticks without a set-point: how the jog ended is seen, that it rests is to be watched."""
WATCHED_FOR = 0.2
"""So long nothing may go by after that, the button held on [s]: with the rest, six beats."""

_HEADER = 16
_STEADY = 0.97
"""A set-point whose step is smaller than that of the steady jog belongs to the ramp."""
_STEADY_STEPS = 6
"""A jog is steady once so many steps in turn are alike."""


@dataclass(frozen=True)
class Seen:
    """A set-point, or a STOP where it has no joints; by the monotonic clock [s]."""

    at: float
    joints: tuple[float, ...]


@dataclass(frozen=True)
class Ended:
    """How a held jog ended.

    Attributes:
        began: when it was let go, by the monotonic clock [s].
        at: when the first set-point of the ramp, or the STOP, went by.
        kind: `ramp` or `stop`.
    """

    began: float
    at: float
    kind: str


class MovedOn(AssertionError):
    """A robot went on, or began again by itself; no busy machine explains that."""

    def __init__(self, how: str) -> None:
        """Say it so that no test is tried again."""
        super().__init__(f"violation: {how}")


class MotionTap(LoopbackRelay):
    """Notes what goes to the emulator, as it goes."""

    def __init__(self, target: int) -> None:
        """Begin with nothing seen."""
        self._seen: list[Seen] = []
        super().__init__(target)

    def forget(self) -> None:
        """Begin a trial."""
        self._seen = []

    def seen(self) -> list[Seen]:
        """Return what went by since the last `forget`."""
        return list(self._seen)

    def wait_for_motion(self, within: float = 10.0) -> None:
        """Wait until a set-point went by since the last `forget`."""
        until = time.monotonic() + within
        while not self._seen:
            assert time.monotonic() < until, f"nothing moved within {within:g} s"
            time.sleep(0.01)

    def wait_for_steady(self, joint: int, within: float = 10.0) -> None:
        """Wait until a joint is jogged steadily since the last `forget`."""
        until = time.monotonic() + within
        while not _is_steady(self.seen()[-_STEADY_STEPS - 1 :], joint):
            assert time.monotonic() < until, f"no steady jog within {within:g} s"
            time.sleep(0.005)

    def wait_for_rest(self, within: float = 5.0, at_rest: float = AT_REST) -> None:
        """Wait until no set-point goes by any more.

        Args:
            at_rest: and none has gone by for so long [s].
        """
        until = time.monotonic() + within
        while (seen := self._seen) and time.monotonic() - seen[-1].at < at_rest:
            if time.monotonic() >= until:
                raise MovedOn("the robot never came to rest")
            time.sleep(0.01)

    def stays_at_rest(self, watched_for: float = WATCHED_FOR) -> None:
        """Watch a robot that has come to rest: nothing moves it; a STOP more does not."""
        self.forget()
        time.sleep(watched_for)
        if any(each.joints for each in self.seen()):
            raise MovedOn("it moved again by itself")

    def end_of_steady(self, joint: int, after: float) -> Ended:
        """Return when the ramp or the STOP began after a moment, and which it was.

        The ramp begins with the first of the smaller steps that no steady one follows: a single
        late tick is none. It may be called once the joint stands.

        Raises:
            AssertionError: no steady jog went before, or none of them came.
        """
        seen = self.seen()
        steps = [
            (each.at, abs(each.joints[joint] - earlier.joints[joint]))
            for earlier, each in pairwise(each for each in seen if each.joints)
        ]
        before = [step for at, step in steps if at < after][-_STEADY_STEPS:]
        stopped = max((each.at for each in seen if not each.joints and each.at < after), default=0)
        assert not stopped, f"stopped {1000 * (after - stopped):.0f} ms before it was to end"
        assert len(before) >= 5, f"{len(before)} set-points before the end of the jog"
        steady = statistics.median(before)
        last = f"the last set-point came {1000 * (seen[-1].at - after):.0f} ms after"
        assert steady > 0, f"it stood before the jog ended; {last}"
        steadily = max(at for at, step in steps if step >= _STEADY * steady)
        stops = [(each.at, "stop") for each in seen if not each.joints and each.at >= after]
        ramps = [(at, "ramp") for at, _ in steps if at > steadily]
        first = min(stops[:1] + ramps[:1], default=None)
        assert first is not None, f"nothing ended the jog; {last}"
        assert first[0] >= after, f"it ended before; {last}"
        return Ended(after, *first)

    def _noted(self, data: bytes) -> bytes:
        now = time.monotonic()
        while len(data) >= _HEADER:
            size = 4 + int.from_bytes(data[:4], "little")
            if size > len(data):
                break
            kind = int.from_bytes(data[4:8], "little")
            if kind == POINT and int.from_bytes(data[16:20], "little", signed=True) == STOP:
                self._seen.append(Seen(now, ()))
            elif kind == FULL_POINT:
                # robot, sequence, valid fields and time go before the positions
                self._seen.append(Seen(now, struct.unpack_from("<10f", data, _HEADER + 16)))
            data = data[size:]
        return data


def _is_steady(seen: Sequence[Seen], joint: int) -> bool:
    """Return whether the last set-points lie equally far apart."""
    if len(seen) <= _STEADY_STEPS or not all(each.joints for each in seen):
        return False
    steps = [abs(each.joints[joint] - earlier.joints[joint]) for earlier, each in pairwise(seen)]
    return min(steps) >= _STEADY * max(steps) > 0.0
