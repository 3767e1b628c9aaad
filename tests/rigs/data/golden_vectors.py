"""The reference packets of `tests/vectors`, as the tests want them.

Everything here comes from those files, never from our own encoder.
"""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from openpendant.simplemsg import MOTOMAN, STANDARD, ByteOrder, Codec, Dialect, codec_for

FOLDER = Path(__file__).parents[2] / "vectors"

FILES = (
    "standard-le-f32",
    "standard-be-f32",
    "standard-le-f64",
    "standard-be-f64",
    "motoman-le-f32",
    "motoman-be-f32",
    "motoman-le-f64",
    "motoman-controller-le-f32",
    "motoman-controller-be-f32",
)


@dataclass(frozen=True)
class Golden:
    """One reference packet."""

    file: str
    entry: dict[str, Any]

    @property
    def id(self) -> str:
        return f"{self.file}:{self.entry['name']}"

    @property
    def frame(self) -> bytes:
        return bytes.fromhex(self.entry["hex"])

    @property
    def dialect(self) -> Dialect:
        return STANDARD if self.file.startswith("standard") else MOTOMAN

    @property
    def byte_order(self) -> ByteOrder:
        return ByteOrder.LITTLE if "-le-" in self.file else ByteOrder.BIG

    @property
    def real_size(self) -> int:
        return 4 if self.file.endswith("f32") else 8

    @property
    def codec(self) -> Codec:
        return codec_for(self.dialect, self.byte_order, self.real_size)

    @property
    def packet(self) -> dict[str, Any]:
        keys = ("msg_type", "comm_type", "reply_code")
        return {**{key: self.entry[key] for key in keys}, "fields": self.fields}

    @property
    def fields(self) -> dict[str, Any]:
        """The fields that a decoder has to find, in our spelling."""
        fields = dict(self.entry["fields"])
        fields.pop("link_order", None)  # a remark on the DH parameters, not in the packet
        if "first_int_is_result" in fields:
            return {
                "robot_id": fields["first_int_is_result"],
                "sequence": fields["second_int_is_subcode"],
                "command": 0,
                "result": 0,
                "subcode": 0,
                "data": [0.0] * 10,
            }
        if "body_ints_then_one_real" in fields:
            real = "f" if self.real_size == 4 else "d"
            values = fields["body_ints_then_one_real"]
            return {"body": struct.pack(f"{self.byte_order.value}3i{real}", *values).hex()}
        return fields


def load(name: str) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = json.loads((FOLDER / f"{name}.json").read_text())
    return entries


def golden_cases(file: str) -> list[tuple[str, Golden]]:
    return [(golden.id, golden) for golden in GOLDEN if golden.file == file]


GOLDEN = [Golden(file, entry) for file in FILES for entry in load(file)]


def exact(value: Any) -> str:
    """Write JSON so that equal texts mean equal values: 0 is not 0.0, and 0.0 is not -0.0."""
    return json.dumps(value, sort_keys=True)
