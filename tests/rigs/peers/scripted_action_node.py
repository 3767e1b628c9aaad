"""What the stock ROS-I action node watches, and how it ends a goal.

`joint_trajectory_action` of industrial_robot_client looks at nothing but positions and `in_motion`:
a goal succeeds where every joint is near its last point and the robot stands, and is aborted where
no position came for 1 s. It looks at neither e_stopped, in_error nor error_code.
"""

from collections.abc import Callable, Sequence
from enum import Enum

from openpendant.simplemsg import JointPosition, Message, Status, TriState

WATCHDOG_NS = 1_000_000_000
GOAL_THRESHOLD = 0.01
"""Between both ends of what is near enough [rad]."""


class Goal(Enum):
    """What became of a goal."""

    ACTIVE = "active"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    REJECTED = "rejected"


class ScriptedActionNode:
    """The action node of one robot, fed with what its state reader hears.

    Attributes:
        goal: what became of the last goal; None before any.
    """

    def __init__(self, stop: Callable[[], object]) -> None:
        """Make a node that has heard nothing; `stop` sends an empty trajectory, which is a STOP."""
        self.goal: Goal | None = None
        self._stop = stop
        self._target: tuple[float, ...] = ()
        self._check_from = 0
        self._has_moved = False
        self._in_motion = TriState.UNKNOWN
        self._heard: int | None = None

    def send_goal(self, target: Sequence[float], duration: float, now: int) -> bool:
        """Take a goal that lasts so long [s]; False where the controller counts as dead."""
        if self._heard is None or now - self._heard > WATCHDOG_NS:
            self.goal = Goal.REJECTED
            return False
        if self.goal is Goal.ACTIVE:
            self._stop()
        self.goal, self._target, self._has_moved = Goal.ACTIVE, tuple(target), False
        self._check_from = now + round(duration * 0.5e9)
        return True

    def hear(self, message: Message, now: int) -> None:
        if isinstance(message, Status):
            self._in_motion = TriState(message.in_motion)
            self._has_moved = self._has_moved or message.in_motion == TriState.TRUE
        elif isinstance(message, JointPosition):
            self._heard = now
            self._look(message.joints, now)

    def _look(self, joints: Sequence[float], now: int) -> None:
        if self.goal is not Goal.ACTIVE or not (self._has_moved or now >= self._check_from):
            return
        gaps = [abs(at - to) for at, to in zip(joints, self._target, strict=False)]
        if max(gaps) < GOAL_THRESHOLD / 2 and self._in_motion != TriState.TRUE:
            self.goal = Goal.SUCCEEDED

    def tick(self, now: int) -> None:
        silent = self._heard is not None and now - self._heard > WATCHDOG_NS
        if self.goal is Goal.ACTIVE and silent:
            self.goal = Goal.ABORTED
            self._stop()
