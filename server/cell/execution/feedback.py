"""Feedback of the controller: its newest report with its age, and the joints of the last seconds.

Owns the rule when a report is fresh enough to start from and when it is too old to go on (promise
5). Positions are controller side.

Owns what of the reports ends what is under way, and in which words: one rule for each status that
comes (`interruption`), so that a fault which is gone before the next tick is not missed, and one
for what holds now (`lost`). They are the same for what moves and for what waits to move, such as a
program in a wait.

Owns how far back the history of the joints reaches, and where they put the flange. The flange is
worked out when somebody asks, because nobody asks for nearly all of the samples.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from itertools import islice
from operator import sub
from typing import NamedTuple

from openpendant.motion.frames.frame_history import SPAN, FrameHistory
from openpendant.motion.frames.frame_tree import FLANGE, FrameTree
from openpendant.motion.pose import Pose
from openpendant.simplemsg import (
    ControllerMode,
    JointFeedback,
    JointPosition,
    Message,
    Status,
    TriState,
    ValidField,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ...settings.cell_settings import ControllerLink
from ...uplinks.uplink import error_text

STANDING_SPEED = 1e-3
"""A joint slower than this stands [rad/s or m/s]; the 4-byte report of a resting joint is exact."""

_NOISE_SPEED = 0.05
"""A reported speed below this may be noise [rad/s or m/s]; then the positions decide."""

_STILL_NS = 200_000_000
_STILL_WAY = STANDING_SPEED * _STILL_NS / 1e9
"""A joint that went no farther for so long was on average no faster than one that stands."""

_MODES = {mode.value: mode for mode in (ControllerMode.MANUAL, ControllerMode.AUTO)}

# Plain integers: the operators of a flag take longer than the rest of `take`, and a member of an
# enumeration is looked up anew each time.
_POSITION, _VELOCITY = ValidField.POSITION.value, ValidField.VELOCITY.value
_TRUE, _FALSE = TriState.TRUE.value, TriState.FALSE.value

LARGEST_VALUE = 1e3
"""No joint is reported beyond this [rad, m or their rates]; a greater number is an error."""


class Shown(NamedTuple):
    """The parts of a status that may end a motion under way.

    Attributes:
        fault: its emergency stop or the loss of drive power, in words; empty for neither.
        error: the error that it shows; 0 for none.
    """

    mode: ControllerMode
    fault: str
    error: int


NOTHING_SHOWN = Shown(ControllerMode.UNKNOWN, "", 0)
"""What a controller shows that has not said anything yet."""


class Feedback:
    """The newest joint state and status of the controller.

    Attributes:
        position: (n,) joint positions [rad or m]; None before the first report.
        velocity: (n,) joint velocities [rad/s or m/s], from the report or from two positions.
        velocity_known: whether a velocity was reported or could be worked out.
        status: the controller's last status; None before the first.
        mode: the controller's own operating mode.
        error: the error that the controller shows, 0 for none, -1 for one without a number.
        fault: what ended a running motion, in the controller's words; empty for nothing.
        shown: mode, fault and error together.
        received: time of the last joint report [ns].
        reports: how many joint reports were taken.
        other_robot: number of another robot that the controller reported; None for none.
        broken: a report held a value that no joint has; motion is impossible until one is sound.
        says_emulated: on this connection the controller says that it is emulated. That gives no
            right: known to be emulated is one only whose cell's file says so as well.
    """

    def __init__(self, dof: int, link: ControllerLink) -> None:
        """Make a feedback that knows nothing yet, for a robot of `dof` driven joints."""
        self.position: tuple[float, ...] | None = None
        self.velocity: tuple[float, ...] = (0.0,) * dof
        self.velocity_known = False
        self.status: Status | None = None
        self.mode = ControllerMode.UNKNOWN
        self.error = 0
        self.fault = ""
        self.shown = NOTHING_SHOWN
        self.received = 0
        self.reports = 0
        self.other_robot: int | None = None
        self.broken = False
        self.says_emulated = False
        self._status_received = 0
        self._dof = dof
        self._fresh_age = link.fresh_age_ns
        self._abort_age = link.abort_age_ns
        self._full = False
        self._still_at: tuple[float, ...] = ()
        self._still_since = 0
        self._stands: bool | None = None  # as the last message tells, once somebody asked

    def take(self, message: Message, now: int) -> None:
        """Take a report of the controller; other messages are none of our business."""
        self._stands = None
        match message:
            case JointFeedback(robot_id=0, valid_fields=valid, positions=positions):
                if valid & _POSITION:
                    reported = valid & _VELOCITY
                    self._full = True
                    self._take_joints(positions, message.velocities if reported else None, now)
            case JointPosition(joints=joints):
                # A controller that sends both kinds repeats itself in the poorer one.
                if not self._full:
                    self._take_joints(joints, None, now)
            case Status():
                self.status = message
                self._status_received = now
                self.mode = _MODES.get(message.mode, ControllerMode.UNKNOWN)
                self.error = message.error_code or -1 if message.in_error == _TRUE else 0
                self.fault = _fault_of(message)
                self.shown = Shown(self.mode, self.fault, self.error)
            case JointFeedback():
                # Of another robot at the same controller: where that one is tells nothing of ours.
                self.other_robot = message.robot_id

    def _take_joints(
        self, positions: tuple[float, ...], velocities: tuple[float, ...] | None, now: int
    ) -> None:
        position = positions[: self._dof]
        if not _are_within(position, LARGEST_VALUE):
            self.broken = True
            return
        velocity = None if velocities is None else velocities[: self._dof]
        if velocity is not None and _are_within(velocity, LARGEST_VALUE):
            self.velocity = velocity
            self.velocity_known = True
        elif self.position is not None and now > self.received:
            step = (now - self.received) / 1e9
            self.velocity = tuple(
                (new - old) / step for new, old in zip(position, self.position, strict=True)
            )
            self.velocity_known = True
        self.broken = False
        self.position = position
        self.received = now
        self.reports += 1
        if not self._still_at or _is_beyond(_STILL_WAY, position, self._still_at):
            self._still_at, self._still_since = position, now

    def forget(self) -> None:
        """Forget everything, because the state connection was lost."""
        self._stands = None
        self.position = None
        self.status = None
        self.mode = ControllerMode.UNKNOWN
        self.error = 0
        self.fault = ""
        self.shown = NOTHING_SHOWN
        self.velocity_known = False
        self.velocity = (0.0,) * self._dof
        self.other_robot = None
        self.broken = False
        self.says_emulated = False
        self._full = False
        self._still_at = ()

    def age(self, now: int) -> int | None:
        """Return the age of the last joint report [ns]; None before the first."""
        return None if self.position is None else now - self.received

    def is_fresh(self, now: int) -> bool:
        """Return True if a new motion may start from the last report."""
        return self.position is not None and now - self.received <= self._fresh_age

    def is_lost(self, now: int) -> bool:
        """Return True if the last report is so old that a motion must be aborted."""
        return self.position is None or now - self.received > self._abort_age

    @property
    def standing_at(self) -> tuple[float, ...]:
        """Where the robot stands, (n,) controller side; only meaningful where motion is allowed."""
        assert self.position is not None
        return self.position

    @property
    def is_standing(self) -> bool:
        """Whether the robot stands, as far as the controller and the joints tell."""
        if self._stands is None:
            self._stands = not self._calls_itself_moving and self.joints_rest
        return self._stands

    def stands_after(self, end: int, now: int) -> bool:
        """Return True if the robot stands by what was reported from a time on.

        The status comes in a message of its own, behind the joints. One from before tells nothing
        of a short motion, unless none has come for as long as a report is fresh: some controllers
        send it only when it changes.

        Args:
            end: when the motion was to end [ns].
        """
        if self.received < end or not self.is_standing:
            return False
        status = self.status
        if status is None or status.in_motion != _FALSE or self._status_received >= end:
            return True
        return now - end >= self._fresh_age

    def has_come_to_rest(self, since: int) -> bool:
        """Return True if the robot stands by what was reported after a time [ns], a stop's say."""
        if self.received <= since or self._calls_itself_moving:
            return False
        return self._has_resting_speeds or self._has_kept_still(since)

    @property
    def joints_rest(self) -> bool:
        """Whether the joints rest, also while the controller calls points without way a motion.

        Their speeds tell. Where these are noisy, reported or worked out, the positions do: such
        joints rest when they have kept their places for a while.
        """
        return self._has_resting_speeds or self._has_kept_still(0)

    @property
    def _calls_itself_moving(self) -> bool:
        return self.status is not None and self.status.in_motion == _TRUE

    @property
    def _has_resting_speeds(self) -> bool:
        return self.velocity_known and _are_within(self.velocity, STANDING_SPEED)

    def _has_kept_still(self, since: int) -> bool:
        if self.received - max(self._still_since, since) < _STILL_NS or not self.velocity_known:
            return False
        return _are_within(self.velocity, _NOISE_SPEED)

    @property
    def complaint(self) -> str:
        """What keeps the controller from moving, in its own words; empty for nothing."""
        status = self.status
        if status is None:
            return "it has not reported its status yet"
        if status.e_stopped == _TRUE:
            return "its emergency stop is active"
        if status.drives_powered == _FALSE:
            return "its drives have no power"
        # Some controllers show their last error until the next trajectory; those say at the same
        # time that one would start.
        if self.error and status.motion_possible != _TRUE:
            return f"it is in {error_text(self.error)}"
        if status.motion_possible == _FALSE:
            return "it says that motion is not possible"
        return ""


def _fault_of(status: Status) -> str:
    if status.e_stopped == _TRUE:
        return "the controller's emergency stop became active"
    if status.drives_powered == _FALSE:
        return "the controller's drives lost their power"
    return ""


def _are_within(values: tuple[float, ...], most: float) -> bool:
    """Return True if no value is beyond ± that; what is not a number is."""
    if math.hypot(*values) <= most:
        # Their length is no less than the greatest, so that this tells nearly always, and quickly.
        return True
    # `max` may pass over what is not a number; a sum does not.
    return max(map(abs, values)) <= most and not math.isnan(sum(values))


def _is_beyond(way: float, one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Return True if any joint is farther than a way from where it was."""
    apart = math.dist(one, other)
    # Between them lies the greatest of the joints' ways, so that one of both tells nearly always.
    if apart <= way or apart > way * math.sqrt(len(one)):
        return apart > way
    farthest: float = max(map(abs, map(sub, one, other)))
    return farthest > way


MOST_REPORTS = 2_500
"""Ten seconds at 250 Hz."""

JointVector = tuple[float, ...]


class JointHistory:
    """The joint positions of the last ten seconds, and the frames that held meanwhile."""

    def __init__(self, flange: Callable[[JointVector], Pose], tree: FrameTree) -> None:
        """Begin with no report.

        Args:
            flange: the flange in base at (n,) joints.
            tree: the frames; they also hold for any earlier time.
        """
        self._flange = flange
        self._reports: deque[tuple[int, JointVector]] = deque(maxlen=MOST_REPORTS)
        self._trees: deque[tuple[int, FrameTree]] = deque([(0, tree)])

    def reported(self, time: int, position: JointVector) -> None:
        """Take a report of the controller; one of the same time is taken once."""
        if self._reports and time <= self._reports[-1][0]:
            return
        self._reports.append((time, position))
        while self._reports[0][0] < time - SPAN:
            self._reports.popleft()

    def define(self, time: int, tree: FrameTree) -> None:
        """Let other frames hold from a time on."""
        self._trees.append((time, tree))
        while len(self._trees) > 1 and self._trees[1][0] <= time - SPAN:
            self._trees.popleft()

    def transform(self, source: str, target: str, time: int | None = None) -> Pose:
        """Return where the frame `source` is, or was, in the frame `target`.

        Args:
            time: [ns]; None for the last report, in the frames as they are now.

        Raises:
            FrameUnknown: there is, or was, no such frame.
            NotInHistory: a frame between the two moves, and the time is not in the history.
        """
        at = self._reports[-1][0] if time is None and self._reports else time
        history = FrameHistory(self._tree_at(time))
        for when, position in self._around(at):
            history.record(when, {FLANGE: self._flange(position)})
        return history.transform(source, target, at)

    def _tree_at(self, time: int | None) -> FrameTree:
        if time is None:
            return self._trees[-1][1]
        held = [tree for since, tree in self._trees if since <= time]
        return held[-1] if held else self._trees[0][1]

    def _around(self, time: int | None) -> list[tuple[int, JointVector]]:
        """Return the reports at or before and after a time; the ends where it is outside."""
        if time is None or not self._reports:
            return []
        after = bisect_right(self._reports, time, key=lambda report: report[0])
        first = min(max(after - 1, 0), len(self._reports) - 1)
        return list(islice(self._reports, first, first + 2))


def interruption(before: Shown, after: Shown) -> Refusal | None:
    """Return why a status ends what is under way; None where it shows nothing new."""
    if after.fault and after.fault != before.fault:
        return Refusal(VerdictCode.CONTROLLER_STOPPED, after.fault)
    if after.mode is not before.mode:
        text = f"the controller's mode changed from {before.mode.name} to {after.mode.name}".lower()
        return Refusal(VerdictCode.CONTROLLER_STOPPED, text)
    # Some controllers show their last error until the next trajectory.
    if after.error and after.error != before.error:
        text = f"the controller went into {error_text(after.error)}"
        return Refusal(VerdictCode.CONTROLLER_STOPPED, text)
    return None


def lost(feedback: Feedback, now: int) -> Refusal | None:
    """Return why nothing may go on by what is known of the robot now; None where it may."""
    if feedback.is_lost(now):
        age = feedback.age(now)
        seen = "never" if age is None else f"{age / 1e6:.0f} ms ago"
        other = feedback.other_robot
        instead = "" if other is None else f"; it reports robot {other}, and robot 0 is ours"
        return Refusal(VerdictCode.FEEDBACK_STALE, f"the last position report came {seen}{instead}")
    if feedback.broken:
        return Refusal(VerdictCode.NOT_FINITE, "the controller reports a position that is none")
    fault = feedback.fault
    return Refusal(VerdictCode.CONTROLLER_STOPPED, fault) if fault else None
