"""The server's answer to "why is it not moving?" as lines of text.

Owns their order: the first broken condition with cause and remedy, or where none is broken why the
last motion ended before its goal, then what the robot stands at with the key that leads out, then
the whole chain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from openpendant.simplemsg.pendant import OperatingMode

from ..client import Hold
from ..way_out import WayOut
from .keyboard import axis_keys
from .remedies import remedy
from .screen_units import in_screen_units


def why_request(mode: OperatingMode | None) -> dict[str, str]:
    """Return the request: why we cannot jog, or in automatic, where nobody can, run a program."""
    kind = "program" if mode is OperatingMode.AUTOMATIC else "jog"
    return {"op": "why", "kind": kind, "whose": "mine"}


def why_lines(answer: dict[str, Any], holds: Sequence[Hold] = ()) -> tuple[str, ...]:
    """Return the answer line by line.

    Args:
        answer: its JSON object.
        holds: what the robot stands at.
    """
    conditions: list[dict[str, Any]] = answer["conditions"]
    broken = next((each for each in conditions if not each["holds"]), None)
    chain = [f"{'ok' if each['holds'] else 'NO'} {each['meaning']}" for each in conditions]
    chain += [in_screen_units(remark) for remark in answer.get("remarks", ())]
    kind = answer["kind"]
    if broken is None:
        ready = f"A {kind} may start: all conditions hold."
        return (ready, *_end(answer.get("ended")), *_way_out(holds), *chain)
    told = (in_screen_units(broken["text"]), broken["cause"], f"-> {_remedy(broken)}")
    return (f"No {kind}:", *dict.fromkeys(told), *_way_out(holds), *chain)


def _end(ended: dict[str, Any] | None) -> list[str]:
    if ended is None:
        return []
    told = (in_screen_units(ended["text"]), ended["cause"], f"-> {_remedy(ended)}")
    return ["The last motion ended before its goal:", *dict.fromkeys(told)]


def _remedy(broken: dict[str, Any]) -> str:
    return remedy(int(broken.get("code", 0)), str(broken["remedy"]))


def _keys(way: WayOut) -> str:
    """Return the keys of a way out on this pendant."""
    keys = axis_keys(way["values"])
    key = f"keys {' '.join(keys)} together" if len(keys) > 1 else f"key {' '.join(keys)}"
    return f"{key}, frame {way['frame']}" if way["frame"] else key


def _way_out(holds: Sequence[Hold]) -> list[str]:
    lines: list[str] = []
    for hold in holds:
        lines.append(f"{in_screen_units(hold['text'])}:")
        if not hold["ways"]:
            lines.append("-> no key leads out")
        for index, way in enumerate(hold["ways"]):
            lines.append(f"{'or' if index else '->'} {way['press']}: {_keys(way)}")
    return lines
