"""C header of the keypad's frames, for its firmware: kinds, sizes, flags and results."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

from openpendant.simplemsg.serial_frames import (
    FRAMES,
    LONGEST_PIECE,
    NO_KEY,
    PROTOCOL,
    AckResult,
    CarriedMessage,
    KeyFlag,
    KeypadFeature,
)

from .messages import NOTICE

HEADER = Path("tools/pendants/keypad/firmware/frames.h")
"""The file, below the project's folder."""

_FRAME = """/* {notice}
 *
 * Frames on the line of a keypad, protocol {protocol}. */
#ifndef FRAMES_H
#define FRAMES_H

{body}

#endif
"""


def firmware_header() -> str:
    """Return the text of the header."""
    frames = [frame for frame, _ in FRAMES.values() if frame is not CarriedMessage]
    body = [
        _enumeration({"PROTOCOL": PROTOCOL, "LONGEST_PIECE": LONGEST_PIECE, "NO_KEY": NO_KEY}),
        _enumeration({frame.KIND.name: frame.KIND.value for frame in frames}),
        _enumeration(
            {f"{frame.KIND.name}_SIZE": struct.calcsize(f"<{frame.LAYOUT}") for frame in frames}
        ),
        _enumeration({flag.name or "": flag.value for flag in KeyFlag}),
        _enumeration({f"HAS_{feature.name}": feature.value for feature in KeypadFeature}),
        _enumeration({result.name: result.value for result in AckResult}),
    ]
    return _FRAME.format(notice=NOTICE, protocol=PROTOCOL, body="\n\n".join(body))


def _enumeration(values: Mapping[str, int]) -> str:
    rows = [f"    {name} = 0x{value:02X}," for name, value in values.items()]
    return "\n".join(["enum {", *rows, "};"])
