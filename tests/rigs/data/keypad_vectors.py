"""The golden frames of the keypad's line, `tests/vectors/keypad-frames.json`."""

import json
from dataclasses import dataclass
from typing import Any

from openpendant.simplemsg.serial_frames import LineWay

from .golden_vectors import FOLDER


@dataclass(frozen=True)
class GoldenFrame:
    """One golden frame.

    Attributes:
        line: its bytes on the line.
        fields: what a reader finds; None where it must refuse it.
    """

    name: str
    way: LineWay
    line: bytes
    kind: int
    sequence: int
    crc: int
    fields: dict[str, Any] | None


def _frame(entry: dict[str, Any]) -> GoldenFrame:
    fields = entry["fields"]
    if fields and "text" in fields:
        fields = {**fields, "text": fields["text"].encode()}
    return GoldenFrame(
        entry["name"],
        LineWay(entry["way"]),
        bytes.fromhex(entry["hex"]),
        entry["kind"],
        entry["sequence"],
        int(entry["crc"], 16),
        fields,
    )


GOLDEN_FRAMES = [
    _frame(entry) for entry in json.loads((FOLDER / "keypad-frames.json").read_text("utf-8"))
]
G1, G2, G3, G4 = GOLDEN_FRAMES
