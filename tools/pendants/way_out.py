"""At what the robot stands, and which key leads out, as the server tells it: plain typed data."""

from __future__ import annotations

from typing import TypedDict


class WayOut(TypedDict):
    """One key that leads out, or two or three to be held together.

    Attributes:
        press: the name, as `joint 3 towards -`, `tool Z+ in base`, or
            `joint 3 towards + and joint 5 towards -`.
        space: 1 joints, 2 tool.
        frame: of a tool key; empty for joints.
        values: parts of the jog speed, one per joint, or along and about the frame's axes.
    """

    press: str
    space: int
    frame: str
    values: list[float]


class Hold(TypedDict):
    """One thing that the robot stands at.

    Attributes:
        reason: `joint-limit`, `singularity` or `collision`.
        text: what it is, with its numbers.
        ways: what leads out, the best first; empty where nothing is known.
    """

    reason: str
    text: str
    ways: list[WayOut]
