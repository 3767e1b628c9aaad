"""Grasp of a tool: the point between its fingers, how near an object must be, and its part sensor.

Owns the bounds and what holds for a tool that says nothing. Knows no robot and no scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from ..errors import BadArgument, NotFinite

MOST_REACH = 0.05
"""Greatest reach [m]."""

MOST_OFFSET = 1e3
"""Greatest coordinate of a grasp point [m], as in a scene."""

MOST_PARTS = 512
"""Numbers of inputs are below this."""

_Point: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Grasp:
    """Where a tool grasps.

    Attributes:
        point: the grasp point in the tool's frame [m].
        reach: greatest distance from the point to the body that is grasped [m].
        part: number of the input of a sensor for a part in the tool; None for none.

    Raises:
        BadArgument: a number is out of its bounds.
        NotFinite: a number is infinite or not a number.
    """

    point: _Point = (0.0, 0.0, 0.0)
    reach: float = 0.010
    part: int | None = None

    def __post_init__(self) -> None:
        for index, value in enumerate((*self.point, self.reach)):
            if not math.isfinite(value):
                raise NotFinite("grasp", index)
        if len(self.point) != 3 or max(map(abs, self.point)) > MOST_OFFSET:
            raise BadArgument("grasp point", self.point, f"3 numbers within {MOST_OFFSET:g} m")
        if not 0.0 <= self.reach <= MOST_REACH:
            raise BadArgument("reach of a grasp", self.reach, f"0 to {MOST_REACH:g} m")
        if self.part is not None and not 0 <= self.part < MOST_PARTS:
            raise BadArgument("part of a grasp", self.part, f"an input, 0 to {MOST_PARTS - 1}")


DEFAULT_GRASP = Grasp()
"""Grasp of the bare flange, of a tool that says nothing, and of a link that is no tool's."""
