"""Jog model: one robot as its jogs see it, with arm, tool, limits, margins and surroundings.

Owns the margins: where a joint begins to slow, and how far before the end of its range it rests.
Holds no state of a motion, so one model serves every jog of a robot, in one thread.
"""

from __future__ import annotations

from ..errors import BadArgument
from ..kinematics.serial import Kinematics
from ..kinematics.stewart.platform import StewartKinematics
from ..paths.mechanism import Mechanism, PlatformMechanism, SerialMechanism
from ..pose import Pose
from ..scene.collision import CollisionModel
from .collision_guard import CollisionGuard
from .jog_robot import JogArm, PlatformTool, SerialTool
from .line_speed_bounds import LinePoints

MARGIN = 0.1
"""Distance before the end of its range at which a joint begins to slow [rad or m]."""

REST_SHARE = 0.01
"""Share of the margin that is left when a joint comes to rest: 1 mrad of 0.1 rad.

With it neither the 4-byte reals of a controller nor feedback noise put a joint beyond its limit.
"""

_MARGIN_SHARE = 0.1  # of the range: a short range keeps eight tenths at full speed


class JogModel:
    """Constant data of a robot that is jogged.

    Attributes:
        arm: the mechanism with its tool.
        margin: (n,) distance before its end at which a joint begins to slow [rad or m].
        lower: (n,) where joints come to rest, a hundredth of the margin inside [rad or m].
        upper: (n,) likewise.
        unit: (n,) unit of a joint's travel: 1 rad, or the arm's length [m].
        guard: the collision guard; None without a collision model.
        line_points: tool and elbow along straight lines of the joints; None for a platform.
        watches_posture: True if there are limits besides those of the joints.
    """

    def __init__(
        self,
        kinematics: Kinematics | StewartKinematics,
        tcp: Pose | None = None,
        collision: CollisionModel | None = None,
    ) -> None:
        """Build the model.

        Args:
            kinematics: the robot, as `SerialMechanism` and `PlatformMechanism` have it.
            tcp: the tool centre point in the frame of the tool link; its origin if None.
            collision: the robot in its scene, with the same kinematics; None to check nothing.
        """
        self.arm: JogArm
        self.line_points: LinePoints | None = None
        if isinstance(kinematics, Kinematics):
            self.arm = SerialTool(kinematics, tcp)
            self.line_points = LinePoints(kinematics, tcp)
        else:
            self.arm = PlatformTool(kinematics, tcp)
        limits = self.limits = kinematics.limits
        self.dof = limits.dof
        ranges = [upper - lower for lower, upper in zip(limits.lower, limits.upper, strict=True)]
        self.margin = [min(MARGIN, _MARGIN_SHARE * each) for each in ranges]
        # In proportion to the margin: a fixed distance could use up a short margin.
        rest = [REST_SHARE * each for each in self.margin]
        self.lower = [bound + each for bound, each in zip(limits.lower, rest, strict=True)]
        self.upper = [bound - each for bound, each in zip(limits.upper, rest, strict=True)]
        self.unit = [self.arm.length if slides else 1.0 for slides in limits.prismatic]
        self.guard = None if collision is None else CollisionGuard(collision)
        self.watches_posture = isinstance(self.arm, PlatformTool)


def jog_model(
    robot: Mechanism, tcp: Pose | None = None, collision: CollisionModel | None = None
) -> JogModel:
    """Return the model of a serial arm or a platform; `BadArgument` for any other mechanism."""
    if isinstance(robot, SerialMechanism | PlatformMechanism):
        return JogModel(robot.kinematics, tcp, collision)
    accepted = "a SerialMechanism or a PlatformMechanism, as `mechanism` makes of a robot"
    raise BadArgument("robot", type(robot).__name__, accepted)
