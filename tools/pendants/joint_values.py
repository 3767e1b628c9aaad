"""Joint and tool values as people give them, laid into the slots of a message."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import JogSpace

from .failures import WrongArgument


def slots(values: Sequence[float]) -> tuple[float, ...]:
    """Return values in the slots of a message, zeros behind them.

    Raises:
        WrongArgument: there are more values than slots.
    """
    try:
        return joint_array(values)
    except ValueError as error:
        raise WrongArgument(str(error)) from None


@dataclass(frozen=True, slots=True)
class JogValues:
    """What a jog or a step is about: some joints, or the tool.

    Attributes:
        space: joints or tool.
        frame: frame of the axes; empty for joints.
        values: (n,) by joint, or (6,) along x, y, z and about x, y, z.
    """

    space: JogSpace
    frame: str
    values: tuple[float, ...]

    @classmethod
    def of_joints(cls, joints: Mapping[int, float], dof: int) -> JogValues:
        """Return values by joint index, 0 for the joints that are not named.

        Raises:
            WrongArgument: the robot has no such joint.
        """
        for index in joints:
            if index not in range(dof):
                raise WrongArgument(f"no joint {index}; the robot has joints 0 to {dof - 1}")
        return cls(JogSpace.JOINTS, "", tuple(joints.get(index, 0.0) for index in range(dof)))

    @classmethod
    def of_tool(cls, values: Sequence[float], frame: str) -> JogValues:
        """Return values along x, y, z and about x, y, z of a frame."""
        return cls(JogSpace.TOOL, frame, tuple(values))
