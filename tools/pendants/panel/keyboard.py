"""Key table of a full keyboard: key to meaning.

Owns this table and the legend that is made from it. A pendant with other keys brings its own table
with the same meanings. Knows no terminal library.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

STOP_KEY = " "
"""The software stop; nothing else may ever take this key, no prompt either."""

STOP_KEYS: Mapping[str, str] = {STOP_KEY: "space bar", "f8": "F8"}
"""All keys of the software stop, as on the page, with the name that a stop has as its reason."""


class Page(Enum):
    """The pages of the display."""

    MODE = "mode"
    JOINTS = "joints"
    POSE = "pose"
    SPEED = "speed"
    PROGRAM = "program"
    MESSAGES = "messages"
    WHY = "why"


class Intent(Enum):
    """Meaning of a key other than an axis or a page; the value is shown in the legend."""

    RESET = "reset stop"
    CONTROL = "take/give control"
    TAKE_OVER = "take over"
    ENABLE = "enabling (training) on/off"
    MODE = "mode"
    NEXT_FRAME = "next frame"
    LAST_FRAME = "frame before"
    JOG_KIND = "step/hold"
    STEP_DOWN = "smaller step"
    STEP_UP = "larger step"
    STEP_TYPED = "type step"
    SLOWER = "slower"
    FASTER = "faster"
    CAP_DOWN = "tool cap down"
    CAP_UP = "tool cap up"
    TARGET = "go to typed value"
    UNDO_JOG = "undo jog"
    HOME = "home, zero"
    WHY = "why not moving?"
    PROGRAM = "open program"
    RECORD = "record"
    INSERT = "insert"
    TOUCH_UP = "touch up"
    DELETE = "delete"
    UNDO_EDIT = "undo edit"
    REDO_EDIT = "redo edit"
    DRY_RUN = "dry run"
    RUN = "run"
    STEP_FORWARD = "step"
    STEP_BACKWARD = "step back"
    PAUSE = "pause/resume"
    PROGRAM_STOP = "program stop"
    UP = "line up"
    DOWN = "line down"
    NEXT_PAGE = "next page"
    LAST_PAGE = "page before"
    LET_GO = "let go"
    LISTS = "recordings, frames, tools, scene, signals, positions, plans, pairing"
    ALL_KEYS = "all keys"


@dataclass(frozen=True, slots=True)
class AxisKey:
    """A jog key.

    Attributes:
        axis: from 0: a joint, or x, y, z and the rotations about them.
    """

    axis: int
    sign: int


Meaning: TypeAlias = Intent | Page | AxisKey

_PLUS, _MINUS = "qwertyuiop", "asdfghjkl;"

KEYBOARD: Mapping[str, Meaning] = {
    **{key: AxisKey(axis, 1) for axis, key in enumerate(_PLUS)},
    **{key: AxisKey(axis, -1) for axis, key in enumerate(_MINUS)},
    # Where y and z have changed places the row stays a row.
    "z": AxisKey(_PLUS.index("y"), 1),
    **{f"f{number}": page for number, page in enumerate(Page, start=1)},
    "right": Intent.NEXT_PAGE,
    "left": Intent.LAST_PAGE,
    "up": Intent.UP,
    "down": Intent.DOWN,
    "x": Intent.RESET,
    "c": Intent.CONTROL,
    "C": Intent.TAKE_OVER,
    "v": Intent.ENABLE,
    "m": Intent.MODE,
    "tab": Intent.NEXT_FRAME,
    "shift+tab": Intent.LAST_FRAME,
    "/": Intent.JOG_KIND,
    "[": Intent.STEP_DOWN,
    "]": Intent.STEP_UP,
    "*": Intent.STEP_TYPED,
    "-": Intent.SLOWER,
    "+": Intent.FASTER,
    "<": Intent.CAP_DOWN,
    ">": Intent.CAP_UP,
    "=": Intent.TARGET,
    "b": Intent.UNDO_JOG,
    "0": Intent.HOME,
    "?": Intent.WHY,
    "n": Intent.PROGRAM,
    "1": Intent.RECORD,
    "2": Intent.INSERT,
    "3": Intent.TOUCH_UP,
    "4": Intent.DELETE,
    "ctrl+z": Intent.UNDO_EDIT,
    "ctrl+y": Intent.REDO_EDIT,
    ".": Intent.DRY_RUN,
    "5": Intent.RUN,
    "6": Intent.STEP_FORWARD,
    "7": Intent.STEP_BACKWARD,
    "8": Intent.PAUSE,
    "9": Intent.PROGRAM_STOP,
    "escape": Intent.LET_GO,
    "M": Intent.LISTS,
    "K": Intent.ALL_KEYS,
}


def axis_keys(values: Sequence[float]) -> tuple[str, ...]:
    """Return the jog keys that move along some axes.

    Args:
        values: one for each axis; its sign is the direction, 0 leaves the axis out.
    """
    return tuple(
        (_PLUS if value > 0.0 else _MINUS)[axis] for axis, value in enumerate(values) if value
    )


_SHOWN_KEYS = {"right": "→", "left": "←", "up": "↑", "down": "↓", "escape": "Esc", "tab": "Tab"}


def legend(axes: Sequence[str], what: str = "joints", *, short: bool = False) -> str:
    """Return one line for each group of keys.

    Args:
        axes: name of each axis that the jog keys move now.
        what: of which they are: joints, or the name of a frame.
        short: only the two lines that every display must show.
    """
    keys = {meaning: key for key, meaning in KEYBOARD.items() if key != "z"}

    def group(*intents: Intent) -> str:
        return "  ".join(f"{_SHOWN_KEYS.get(keys[i], keys[i])} {i.value}" for i in intents)

    pairs = zip(axes, _PLUS, _MINUS, strict=False)
    jog = " ".join(f"{axis}:{plus}/{minus}" for axis, plus, minus in pairs)
    first = "SPACE, F8 software stop   ctrl+q quit   F1-F7 → ← pages"
    second = f"jog {what} {jog} (+/-)"
    if short:
        return f"{first}   {keys[Intent.ALL_KEYS]} {Intent.ALL_KEYS.value}\n{second}"
    return "\n".join(
        (
            first,
            second,
            group(Intent.NEXT_FRAME, Intent.JOG_KIND, Intent.STEP_DOWN, Intent.STEP_UP)
            + "  "
            + group(Intent.STEP_TYPED),
            group(Intent.CONTROL, Intent.TAKE_OVER, Intent.ENABLE, Intent.LET_GO, Intent.MODE),
            group(Intent.SLOWER, Intent.FASTER, Intent.CAP_DOWN, Intent.CAP_UP, Intent.RESET),
            group(Intent.TARGET, Intent.UNDO_JOG, Intent.HOME, Intent.WHY, Intent.ALL_KEYS),
            group(Intent.LISTS),
            group(Intent.PROGRAM, Intent.RECORD, Intent.INSERT, Intent.TOUCH_UP, Intent.DELETE),
            group(Intent.DRY_RUN, Intent.RUN, Intent.STEP_FORWARD, Intent.STEP_BACKWARD)
            + "  "
            + group(Intent.PAUSE, Intent.PROGRAM_STOP),
            group(Intent.UP, Intent.DOWN, Intent.UNDO_EDIT, Intent.REDO_EDIT),
        )
    )
