"""Bytes of input devices as the kernel writes them, laid out here once more by hand."""

import struct

LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y = 0, 1, 3, 4
"""Axes of a gamepad by the joystick interface."""

CROSS, STOP, SLOWER, FASTER, ENABLING, SHIFT = 0, 1, 2, 3, 4, 5
"""Buttons likewise."""

FULL = 32_767
SYN, KEY, REL, ABS = 0, 1, 2, 3
LEFT_KEY, RIGHT_KEY = 256, 257
"""Buttons of a SpaceMouse."""


def axis(number: int, share: float, *, at_opening: bool = False) -> bytes:
    """Return the event of an axis; the share is of its full deflection."""
    return struct.pack("<IhBB", 0, round(share * FULL), 0x82 if at_opening else 0x02, number)


def button(number: int, *, down: bool, at_opening: bool = False) -> bytes:
    return struct.pack("<IhBB", 0, int(down), 0x81 if at_opening else 0x01, number)


def opening(*, down: frozenset[int] = frozenset(), **axes: float) -> bytes:
    """Return what the joystick interface tells at opening; an axis is named as `a1`."""
    shares = {number: axes.get(f"a{number}", 0.0) for number in range(8)}
    buttons = (button(each, down=each in down, at_opening=True) for each in range(11))
    sticks = (axis(number, share, at_opening=True) for number, share in shares.items())
    return b"".join((*buttons, *sticks))


def event(kind: int, code: int, value: int) -> bytes:
    """Return one event of evdev on 64 bits."""
    return struct.pack("<qqHHi", 0, 0, kind, code, value)


REPORT, DROPPED = event(SYN, 0, 0), event(SYN, 3, 0)


def report(*events: tuple[int, int, int]) -> bytes:
    """Return a set of events of evdev, reported as whole."""
    return b"".join(event(*each) for each in events) + REPORT
