"""What a cell is full of at its bounds: frames, tools, objects, and programs of several sizes."""

from __future__ import annotations

import json
from typing import Any

from openpendant.server.programs.editing.program_tasks import MOST_JSON_AT_ONCE, PrintBody
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json

FRAMES, TOOLS = 500, 400
"""User frames and tools of the cell."""

MAIN, ROOM, SMALL = "main", "room", "small"
"""Programs: full, with room for some more, and of next to nothing."""

AT_ONCE, PRINTED = "at once", "printed at once"
"""Programs that are as large as is edited, or printed, on the loop."""


def text_of(name: str, points: int, moves: int) -> str:
    lines = ["openpendant-program/1", f'program "{name}" robot ur5']
    lines += [f"point p{n} joints 0 -1.5 1.5 -1.5 -1.5 {n / 10_000} rad" for n in range(points)]
    return "\n".join([*lines, *(f"move PTP p{n % points}" for n in range(moves))]) + "\n"


def waits_of(name: str, count: int) -> str:
    """Return the text of a program that has the most statements for its length."""
    return f'openpendant-program/1\nprogram "{name}" robot ur5\n' + "wait 1 s\n" * count


def ball(number: int) -> dict[str, Any]:
    """An object of the scene, out of the robot's reach."""
    place = [3.0 + number % 20, 3.0 + number // 20, 0.0]
    return {"name": f"o{number}", "shape": {"type": "sphere", "radius": 0.1}, "position": place}


def frames_of(count: int) -> dict[str, Any]:
    """Frames of which each hangs from the one before."""
    placed = {"xyz": [0.001, 0.002, 0.001], "quat": [0.0, 0.0, 0.0, 1.0]}
    above = ["base", *(f"f{number}" for number in range(count))]
    frames = [{"name": f"f{at}", "parent": above[at], **placed} for at in range(count)]
    return {"schema": "openpendant-frames/1", "frames": frames}


def tools_of(count: int) -> dict[str, Any]:
    placed = {"xyz": [0.0, 0.0, 0.1], "quat": [0.0, 0.0, 0.0, 1.0]}
    tools = [{"name": f"t{number}", **placed} for number in range(count)]
    return {"schema": "openpendant-frames/1", "tools": tools}


def kept_of(name: str, size: int) -> str:
    """Return the JSON of a program that has about so many characters, not more."""
    count = size // 20
    while len(body := program_to_json(parse(waits_of(name, count)))) > size:
        count = min(count - 1, count * size // len(body))
    return body


def kept_programs(full: str) -> dict[str, str]:
    """Return the JSON of the programs but the full one, whose JSON is given."""
    room = json.loads(full)
    room["name"], room["points"] = ROOM, room["points"][:1_900]
    room["statements"] = room["statements"][:1_900] + room["statements"][:700]
    small = program_to_json(parse(text_of(SMALL, 2, 1)))
    found = {ROOM: json.dumps(room, separators=(",", ":")), SMALL: small}
    for name, size in ((AT_ONCE, MOST_JSON_AT_ONCE), (PRINTED, PrintBody.MOST_AT_ONCE)):
        found[name] = kept_of(name, size - 100)
    return found
