"""Samples of a plan as the JSON of an answer, in steps that no turn of the loop takes long for.

A real number is written as the shortest decimal that is read back as the same number, bit for bit.
The effort of each step is counted, not timed, so that a journal that is run again has the same
turns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from openpendant.motion.trajectory.trajectory import Trajectory

from ..events.management_requests import MOST_ANSWER
from ..events.pending import Steps, Turn

TURN_EFFORT = 700.0
"""Most that is written in one turn [µs], by the counted effort: far below the 2 ms of a turn."""

_PER_NUMBER = 0.7  # µs
_PER_PLACE = 30.0  # µs, of the tool at a row

_FRAME_ROOM = 1_000
"""Bytes of an answer beside its rows, many times over."""

ToolPlace = Callable[[Sequence[float]], tuple[tuple[float, ...], tuple[float, ...]]]
"""Returns x, y, z [m] and quaternion x, y, z, w of the tool in base at (n,) joints."""


def sample_text(
    plan: int,
    trajectory: Trajectory,
    first: int,
    count: int,
    every: int,
    tool_place: ToolPlace | None,
) -> Steps[str]:
    """Return the JSON of some samples, as many of them as a frame holds.

    Args:
        tool_place: where the tool is at a joint position; None where that is not asked for.
    """
    wanted = range(first, len(trajectory), every)[:count]
    per_row = _PER_NUMBER * (1 + 3 * trajectory.dof)
    if tool_place is not None:
        per_row += _PER_PLACE
    in_a_turn = max(int(TURN_EFFORT / per_row), 1)
    rows: list[str] = []
    places: list[str] = []
    room = MOST_ANSWER - _FRAME_ROOM - 8 * (1 + 3 * trajectory.dof)
    for number, index in enumerate(wanted):
        if number % in_a_turn == 0:
            yield Turn.NEXT if number else Turn.FIRST
        row = _row(trajectory, index)
        place = "" if tool_place is None else _place(tool_place, trajectory, index)
        room -= len(row) + len(place) + 2
        if room < 0:
            break
        rows.append(row)
        places.append(place)
    last = first + every * (len(rows) - 1)
    told: dict[str, str] = {
        "plan": str(plan),
        "first": str(first),
        "every": str(every),
        "total": str(len(trajectory)),
        "columns": _listed(f'"{name}"' for name in columns(trajectory.dof)),
        "rows": _listed(rows),
    }
    if tool_place is not None:
        told["tool"] = _listed(places)
    told["more"] = "true" if last + every < len(trajectory) else "false"
    return "{" + ",".join(f'"{key}":{value}' for key, value in told.items()) + "}"


def columns(dof: int) -> tuple[str, ...]:
    """Return the names of the numbers of a row."""
    return ("t", *(f"{what}{joint}" for what in "qva" for joint in range(dof)))


def _row(trajectory: Trajectory, index: int) -> str:
    time, position, velocity, acceleration = trajectory.row(index)
    return _listed(map(repr, (time, *position, *velocity, *acceleration)))


def _place(tool_place: ToolPlace, trajectory: Trajectory, index: int) -> str:
    position, quaternion = tool_place(trajectory.position[index].tolist())
    return _listed(map(repr, (*map(float, position), *map(float, quaternion))))


def _listed(parts: Iterator[str] | Sequence[str] | Any) -> str:
    return "[" + ",".join(parts) + "]"
