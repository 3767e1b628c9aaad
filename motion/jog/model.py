"""One robot as its jogs see it: arm, tool, limits with their margins, and what stands around.

Owns the margins: where a joint begins to slow, and how far short of the end of its range it rests.
Holds no state of a motion, so one model serves every jog of a robot, in one thread.
"""

from __future__ import annotations

from ..collision import CollisionModel
from ..errors import BadArgument
from ..kinematics import Kinematics
from ..mechanism import Mechanism, PlatformMechanism, SerialMechanism
from ..pose import Pose
from ..stewart import StewartKinematics
from .arm import JogArm
from .collision_guard import CollisionGuard
from .line_speeds import LinePoints
from .platform_tool import PlatformTool
from .serial_tool import SerialTool

MARGIN = 0.1
"""How far before the end of its range a joint begins to slow [rad or m]."""

REST_SHARE = 0.01
"""How much of the margin is left when a joint comes to rest: 1 mrad of 0.1 rad.

So the 4-byte reals of a controller and the noise of its feedback do not put it beyond.
"""

_MARGIN_SHARE = 0.1  # of the range: a short one keeps eight tenths of it at full speed


class JogModel:
    """What does not change while a robot is jogged.

    Attributes:
        arm: the mechanism with its tool.
        limits: limits of the joints.
        dof: number n of joints.
        margin: (n,) how far before its end a joint begins to slow [rad or m].
        lower: (n,) where joints come to rest, a hundredth of the margin inside [rad or m].
        upper: (n,) likewise.
        unit: (n,) what a joint's travel is measured in: 1 rad, or the arm's length [m].
        guard: what watches for collisions; None without a collision model.
        line_points: tool and elbow along straight lines of the joints; None of a platform.
        watches_posture: whether there are limits beside those of the joints.
    """

    def __init__(
        self,
        kinematics: Kinematics | StewartKinematics,
        tcp: Pose | None = None,
        collision: CollisionModel | None = None,
    ) -> None:
        """Make a model.

        Args:
            kinematics: the robot, as `SerialMechanism` and `PlatformMechanism` have it.
            tcp: the tool centre point in the frame of the tool link; its origin if None.
            collision: the robot in its scene, of the same kinematics; None to check nothing.
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
        rest = [REST_SHARE * each for each in self.margin]
        self.lower = [bound + each for bound, each in zip(limits.lower, rest, strict=True)]
        self.upper = [bound - each for bound, each in zip(limits.upper, rest, strict=True)]
        self.unit = [self.arm.length if slides else 1.0 for slides in limits.prismatic]
        self.guard = None if collision is None else CollisionGuard(collision)
        self.watches_posture = isinstance(self.arm, PlatformTool)


def jog_model(
    robot: Mechanism, tcp: Pose | None = None, collision: CollisionModel | None = None
) -> JogModel:
    """Return the model of a robot whatever its kind.

    Raises:
        BadArgument: the mechanism is neither a serial arm nor a platform.
    """
    if isinstance(robot, SerialMechanism | PlatformMechanism):
        return JogModel(robot.kinematics, tcp, collision)
    accepted = "a SerialMechanism or a PlatformMechanism, as `mechanism` makes of a robot"
    raise BadArgument("robot", type(robot).__name__, accepted)
