"""Keys of the keypad: their numbers, their labels, what each means, and what in the menu.

Owns the second table to the meanings of `panel.keyboard`. A key has the number 4 × row + column,
from 0, with the layout of the common membrane: `1 2 3 A / 4 5 6 B / 7 8 9 C / * 0 # D`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum

from ..panel.keyboard import AxisKey

LABELS = "123A456B789C*0#D"
"""What is printed on each key, by its number."""

KEYS = len(LABELS)

SPEED_UP, SPEED_DOWN, MODE, STOP = 3, 7, 11, 15

STOP_BIT = 1 << STOP

_TOOL_AXES = "XYZABC"

_PAIRS = ((0, 4), (1, 5), (2, 6), (8, 12), (9, 13), (10, 14))
"""Of each axis the key of its plus and of its minus."""

JOG_KEYS: Mapping[int, AxisKey] = {
    key: AxisKey(axis, sign)
    for axis, pair in enumerate(_PAIRS)
    for key, sign in zip(pair, (1, -1), strict=True)
}
"""The keys that move an axis while they are held."""

JOG_AXES = len(_PAIRS)


class MenuKey(Enum):
    """Second meaning of a jog key, in the menu; the value stands on the display."""

    RECORD = "REC"
    PLAY = "PLAY"
    UP = "UP"
    TEACH = "TEACH"
    UNDO = "UNDO"
    DOWN = "DOWN"
    HOME = "HOME"
    RUN = "RUN"
    PAGE = "PAGE"
    CONTROL = "CTRL"
    PAUSE = "PAUSE"
    T1_T2 = "T1/T2"


MENU_KEYS: Mapping[int, MenuKey] = {
    0: MenuKey.RECORD,
    1: MenuKey.PLAY,
    2: MenuKey.UP,
    4: MenuKey.TEACH,
    5: MenuKey.UNDO,
    6: MenuKey.DOWN,
    8: MenuKey.HOME,
    9: MenuKey.RUN,
    10: MenuKey.PAGE,
    12: MenuKey.CONTROL,
    13: MenuKey.PAUSE,
    14: MenuKey.T1_T2,
}


_NAMES = {SPEED_UP: "SPEED +", SPEED_DOWN: "SPEED -", MODE: "MODE", STOP: "STOP"}


def printed_on(key: int) -> tuple[str, str, str]:
    """Return what is printed on a key: its label, what it does, and what in the menu."""
    if key in _NAMES:
        return LABELS[key], _NAMES[key], "long: menu" if key == MODE else ""
    axis = JOG_KEYS[key]
    sign = "+" if axis.sign > 0 else "-"
    jog = f"{axis.axis + 1}{sign}  {_TOOL_AXES[axis.axis]}{sign}"
    return LABELS[key], jog, MENU_KEYS[key].value


def more_than_two(mask: int) -> bool:
    """Return True if more than two keys of a mask are down."""
    return mask.bit_count() > 2


def keys_of(mask: int) -> tuple[int, ...]:
    """Return the keys that are down."""
    return tuple(key for key in range(KEYS) if mask >> key & 1)


def jog_keys_of(values: Sequence[float], frame: str) -> tuple[str, ...]:
    """Return what is written on the jog keys that move along some axes, as `3-` or `X+`.

    Args:
        values: one for each axis; its sign is the direction, 0 leaves the axis out.
        frame: of the axes; empty for joints.
    """
    names = _TOOL_AXES if frame else [str(axis + 1) for axis in range(len(values))]
    return tuple(
        f"{names[axis]}{'+' if value > 0.0 else '-'}" for axis, value in enumerate(values) if value
    )
