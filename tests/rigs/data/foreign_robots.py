"""URDFs of robots that no catalogue holds, as their makers might hand them out."""

import math
from dataclasses import dataclass

from rigs.data.urdf_files import ROBOTS_FILES


@dataclass(frozen=True)
class Foreign:
    """A robot, the link it should end at, and a joint position well inside its reach.

    Attributes:
        name: of its file.
        keys: the axes of the base that its tool can be jogged along (x, y, z) and about (A, B, C)
            from there.
    """

    name: str
    tool: str
    joints: list[float]
    keys: str = "xyzABC"

    @property
    def urdf(self) -> str:
        return (ROBOTS_FILES / f"{self.name}.urdf").read_text("utf-8")


_BENT = math.pi / 2.0 - 0.8

FOREIGN = {
    each.name: each
    for each in (
        Foreign("six_axes", "plate", [0.1, 0.3, 0.4, 0.2, 0.6, 0.1]),
        Foreign("seven_axes", "palm", [0.1, 0.5, -0.4, 0.9, 0.3, 0.6, 0.1]),
        Foreign("flat_arm", "t", [0.3, 0.8, 0.05, 0.2], "xyzC"),
    )
}

FEW_AXES = {
    each.name: each
    for each in (
        Foreign("gantry", "quill", [0.3, 0.3, 0.2], "xyz"),
        Foreign("five_axes", "flange", [0.3, 0.4, 0.4, _BENT, 0.2], "xyzC"),
        Foreign("arm_on_a_rail", "tip", [0.1, 0.0, -0.8, 1.0, 0.3], "xyzBC"),
    )
}
