"""The server's answer to "why is it not moving?" as lines of text.

Owns their order: the first broken condition with cause and remedy, then what the robot stands at
with the key that leads out, then the whole chain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from openpendant.simplemsg.pendant import OperatingMode

from ..client import Hold


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
    kind = answer["kind"]
    if broken is None:
        return (f"A {kind} may start: all conditions hold.", *_way_out(holds), *chain)
    told = (broken["text"], broken["cause"], f"-> {broken['remedy']}")
    return (f"No {kind}:", *dict.fromkeys(told), *_way_out(holds), *chain)


def _way_out(holds: Sequence[Hold]) -> list[str]:
    lines: list[str] = []
    for hold in holds:
        lines.append(f"{hold['text']}:")
        keys = [way["press"] for way in hold["ways"]]
        lines.append(f"-> {' or '.join(keys)}" if keys else "-> no single key leads out")
    return lines
