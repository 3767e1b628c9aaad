"""Events of an input device of Linux, without input or output: bytes in, sticks and buttons out.

Owns the two forms in which the kernel tells them: the joystick interface (`/dev/input/jsN`) and
evdev (`/dev/input/eventN`). Knows no meaning of a stick or a button, only their numbers. `now` is
monotonic time in ns.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Protocol, TypeAlias

_MS = 1_000_000

CENTRE_NS = 100 * _MS
"""An axis of a device that tells no zero counts as centred so long after its last report [ns]."""


@dataclass(frozen=True, slots=True)
class StickMoved:
    """An axis has another value.

    Attributes:
        value: of its full deflection, -1 to 1.
        is_at_opening: it has this value since before the device was opened, or events were lost.
    """

    number: int
    value: float
    is_at_opening: bool = False


@dataclass(frozen=True, slots=True)
class ButtonTurned:
    """A button went down or up; `is_at_opening` as above."""

    number: int
    is_down: bool
    is_at_opening: bool = False


@dataclass(frozen=True, slots=True)
class EventsLost:
    """Events were lost: nobody knows how the device stands."""


@dataclass(frozen=True, slots=True)
class EventCut:
    """A read ended within an event, which no device that is plugged in does."""


DeviceEvent: TypeAlias = StickMoved | ButtonTurned | EventsLost | EventCut


class EventReader(Protocol):
    """Reads the bytes of one opening of a device."""

    def receive(self, data: bytes, now: int) -> list[DeviceEvent]:
        """Take what one read returned; an `EventCut` is the last event."""

    def tick(self, now: int) -> list[DeviceEvent]:
        """Advance the time; return which axes count as centred by now."""


_JOYSTICK = struct.Struct("<IhBB")
_BUTTON, _AXIS, _AT_OPENING = 0x01, 0x02, 0x80
_JOYSTICK_SCALE = 32_767


class JoystickReader:
    """The joystick interface, which tells all axes and buttons as they are at opening."""

    def receive(self, data: bytes, now: int) -> list[DeviceEvent]:
        """Take what one read returned; an `EventCut` is the last event."""
        whole, rest = _whole(data, _JOYSTICK)
        events: list[DeviceEvent] = []
        for _, value, kind, number in _JOYSTICK.iter_unpack(whole):
            was_so = bool(kind & _AT_OPENING)
            if kind & ~_AT_OPENING == _BUTTON:
                events.append(ButtonTurned(number, value != 0, was_so))
            elif kind & ~_AT_OPENING == _AXIS:
                events.append(StickMoved(number, _share(value, _JOYSTICK_SCALE), was_so))
        return [*events, EventCut()] if rest else events

    def tick(self, now: int) -> list[DeviceEvent]:
        """Return nothing: this interface tells a centred axis."""
        return []


_EVDEV = struct.Struct("@llHHi")
"""Seconds, microseconds, type, code, value; 24 bytes on 64 bits."""

_SYN, _KEY, _REL, _ABS = 0, 1, 2, 3
_SYN_REPORT, _SYN_DROPPED = 0, 3
_AXES = 6
"""Codes 0 to 5 of both kinds of axes are x, y, z and the rotations about them."""

_SPACEMOUSE_SCALE = 350


class EvdevReader:
    """Evdev as a SpaceMouse speaks it; a set of events counts once it is reported as whole.

    A deflection is told by absolute axes, or by relative ones that repeat while it lasts and say no
    zero. A button is told at its edges alone, so one that goes down was up before.
    """

    def __init__(self) -> None:
        """Know nothing of the device."""
        self._set: list[StickMoved | ButtonTurned] = []
        self._reported: dict[int, int] = {}
        self._is_dropping = False

    def receive(self, data: bytes, now: int) -> list[DeviceEvent]:
        """Take what one read returned; an `EventCut` is the last event."""
        whole, rest = _whole(data, _EVDEV)
        events: list[DeviceEvent] = []
        for _, _, kind, code, value in _EVDEV.iter_unpack(whole):
            if kind == _SYN:
                events += self._ended(code)
            elif not self._is_dropping:
                self._take(kind, code, value, now)
        return [*events, EventCut()] if rest else events

    def tick(self, now: int) -> list[DeviceEvent]:
        """Return which relative axes were not reported for so long that they are centred."""
        centred = [code for code, at in self._reported.items() if now - at >= CENTRE_NS]
        for code in centred:
            del self._reported[code]
        return [StickMoved(code, 0.0) for code in centred]

    def _take(self, kind: int, code: int, value: int, now: int) -> None:
        if kind in (_ABS, _REL) and code < _AXES:
            self._set.append(StickMoved(code, _share(value, _SPACEMOUSE_SCALE)))
            if kind == _REL:
                self._reported[code] = now
        elif kind == _KEY and value in (0, 1):  # 2 is a repetition
            self._set.append(ButtonTurned(code, value == 1))

    def _ended(self, code: int) -> list[DeviceEvent]:
        """Return the set that is whole; after a loss the next one is the rest of what was lost."""
        if code == _SYN_DROPPED:
            self._is_dropping = True
            self._set.clear()
            self._reported.clear()
            return [EventsLost()]
        if code != _SYN_REPORT:
            return []
        whole: list[DeviceEvent] = [*self._set]
        self._is_dropping = False
        self._set.clear()
        return whole


def _whole(data: bytes, form: struct.Struct) -> tuple[bytes, bytes]:
    """Return the whole events of a read, and what is left."""
    end = len(data) - len(data) % form.size
    return data[:end], data[end:]


def _share(value: int, scale: int) -> float:
    return max(-1.0, min(1.0, value / scale))
