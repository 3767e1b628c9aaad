"""TypeScript of the frames on a keypad's line, for the keypad in a page.

The interfaces, the numbers and the layouts come from their declarations; how a piece is packed is
the business of `keypad/line-codec.ts` beside the file, which is written by hand.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
from collections.abc import Iterator
from enum import IntEnum, IntFlag

from openpendant.simplemsg.serial_frames import (
    ACKNOWLEDGED,
    COLUMNS,
    FRAMES,
    LONGEST_PIECE,
    NO_KEY,
    PROTOCOL,
    ROWS,
    AckResult,
    CarriedMessage,
    FrameKind,
    KeyFlag,
    KeypadFeature,
    LineWay,
    SerialFrame,
)

from ..pendants.keypad.keys import KEYS, MODE, STOP, printed_on
from .messages import NOTICE

_HEAD = f"""\
// {NOTICE}
//
// The frames on the line between a keypad and its bridge. Times are ms.

export const PROTOCOL = {PROTOCOL};
export const LONGEST_PIECE = {LONGEST_PIECE};
export const NO_KEY = {NO_KEY};
export const COLUMNS = {COLUMNS};
export const ROWS = {ROWS};
"""

_LAYOUTS = """\
/** A field of a payload: bytes of a number, or of a text; one without a name is zero. */
export type LineField = readonly [name: string, size: number, isText?: true];

export type LineLayout = readonly [isToKeypad: boolean, ...LineField[]];

/** The payload of each kind, and whether it goes to the keypad. */
export const LINE_LAYOUTS: Readonly<Record<number, LineLayout>> = {
"""

_SIZES = {"B": 1, "H": 2, "x": 1, "s": 1}
_CODE = re.compile(r"(\d*)([BHxs])")


def serial_frames_file() -> str:
    """Return the file."""
    kinds = [frame for frame, _ in FRAMES.values() if frame is not CarriedMessage]
    parts = [_HEAD]
    for values in (FrameKind, KeyFlag, KeypadFeature, AckResult):
        parts.append(_constant(values))
    parts += [_interface(each) for each in kinds]
    for name, way in (("FromKeypad", LineWay.TO_HOST), ("ToKeypad", LineWay.TO_DEVICE)):
        found = " | ".join(each.__name__ for each in kinds if way in FRAMES[each.KIND][1])
        parts.append(f"export type {name} = {found};\n")
    answered = ", ".join(str(int(kind)) for kind in sorted(ACKNOWLEDGED))
    parts.append(
        f"/** Kinds that a keypad answers. */\nexport const ACKNOWLEDGED = [{answered}];\n"
    )
    parts.append(_keys())
    rows = "".join(f"  {int(each.KIND)}: [{', '.join(_layout(each))}],\n" for each in kinds)
    parts.append(f"{_LAYOUTS}{rows}}};\n")
    return "\n".join(parts)


def _keys() -> str:
    told = "What is printed on each key: its label, what it does, and what in the menu."
    rows = "".join(f"  {json.dumps(printed_on(key))},\n" for key in range(KEYS))
    caps = "export const KEY_CAPS: readonly (readonly [string, string, string])[]"
    numbers = f"export const MODE = {MODE};\nexport const STOP = {STOP};\n"
    return f"/** {told} */\n{caps} = [\n{rows}];\n\n{numbers}"


def _constant(values: type[IntEnum] | type[IntFlag]) -> str:
    named = ", ".join(f"{each.name}: {int(each)}" for each in values)
    return f"{_comment(values)}\nexport const {values.__name__} = {{ {named} }} as const;\n"


def _interface(frame: type[SerialFrame]) -> str:
    lines = [f"  kind: typeof FrameKind.{frame.KIND.name};"]
    for field in dataclasses.fields(frame):
        lines.append(f"  {field.name}: {'string' if field.type == 'bytes' else 'number'};")
    body = "\n".join(lines)
    return f"{_comment(frame)}\nexport interface {frame.__name__} {{\n{body}\n}}\n"


def _comment(documented: object) -> str:
    return f"/** {(inspect.getdoc(documented) or '').partition(chr(10))[0]} */"


def _layout(frame: type[SerialFrame]) -> Iterator[str]:
    yield str(LineWay.TO_DEVICE in FRAMES[frame.KIND][1]).lower()
    names = iter(field.name for field in dataclasses.fields(frame))
    for count, code in _CODE.findall(frame.LAYOUT):
        many = int(count or 1)
        if code == "s":
            yield f'["{next(names)}", {many}, true]'
            continue
        for _ in range(many):
            name = "" if code == "x" else next(names)
            yield f'["{name}", {_SIZES[code]}]'
