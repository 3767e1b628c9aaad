"""Named positions as a document of the store: JSON of schema `openpendant-positions/1`.

Owns the layout, the bounds, and the rule of names. Joint values are of the controller's driven
joints in file order [rad or m]; what a robot makes of them is not known here.

    {"schema": "openpendant-positions/1",
     "positions": [{"name": "park", "joints": [0.0, -1.57, 1.57, 0.0, 1.57, 0.0]}]}
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.motion.description.schema import OWN_NAMES
from openpendant.simplemsg.names import OF_A_DOCUMENT, name_fault
from openpendant.simplemsg.pendant.management.positions import MOST_NAME_BYTES, MOST_POSITIONS

from ..planning.jobs import JointVector
from ..refusal import field_fault

SCHEMA = "openpendant-positions/1"

MOST_JOINTS = 10
"""Greatest number of joints of a robot: the size of a message's joint vector."""

LARGEST_VALUE = 1e3
"""No joint stands farther from zero [rad or m]."""

_ACCEPTED = f"accepted: 1 to {MOST_NAME_BYTES} bytes of printable characters"
_Real: TypeAlias = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=-LARGEST_VALUE, le=LARGEST_VALUE)
]


class BadPositions(Exception):
    """A text is no document of named positions; the message says where and why."""


class _Position(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(strict=True)]
    joints: Annotated[tuple[_Real, ...], Field(min_length=1, max_length=MOST_JOINTS)]


class _Document(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    schema_: Literal["openpendant-positions/1"] = Field(alias="schema")
    positions: Annotated[tuple[_Position, ...], Field(max_length=MOST_POSITIONS)]


def position_name_fault(name: str) -> str | None:
    """Return why a position of a cell may not have a name; None where it may."""
    size = len(name.encode(errors="surrogatepass"))
    if not 1 <= size <= MOST_NAME_BYTES:
        return f"has {size} bytes of UTF-8; {_ACCEPTED}"
    if name in OWN_NAMES:
        return f"{name!r} is the robot's own; accepted: another name than {', '.join(OWN_NAMES)}"
    fault = name_fault(name)
    # What a document may be called is longer.
    return None if fault is None else fault.problem.replace(OF_A_DOCUMENT, _ACCEPTED)


def positions_to_json(positions: Mapping[str, JointVector]) -> str:
    """Return the text of a document, by name."""
    listed = [{"name": name, "joints": list(at)} for name, at in sorted(positions.items())]
    return json.dumps({"schema": SCHEMA, "positions": listed}, ensure_ascii=False, allow_nan=False)


def positions_from_json(text: str) -> dict[str, JointVector]:
    """Return the positions of a document by name.

    Raises:
        BadPositions: the text is no such document, or a name is none or stands there twice.
    """
    try:
        document = _Document.model_validate_json(text)
    except ValidationError as error:
        raise BadPositions(field_fault(error)) from None
    found: dict[str, JointVector] = {}
    for index, each in enumerate(document.positions):
        fault = position_name_fault(each.name)
        if fault is None and each.name in found:
            fault = f"{each.name!r} is there already; accepted: each name once"
        if fault is not None:
            raise BadPositions(f"positions.{index}.name: {fault}")
        found[each.name] = each.joints
    return found
