"""Operations on plans: a motion is planned, looked at sample by sample, and executed as shown.

A plan is made from the cell as it is: its scene, its selected tool and what the tool carries.
`Execute` plays it; whatever it was made from may not have changed until then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated, Literal, NotRequired, TypeAlias, TypedDict

from ..roles import Permission
from .declaration import (
    AnyPose,
    Count,
    Done,
    FoundPose,
    Length,
    Number,
    ReadAs,
    ReadAsFrom,
    Real,
    Request,
    operation,
)

MOST_ROWS = 100
"""Samples that one answer holds at most."""


class PtpGoal(TypedDict):
    """To a joint position or a pose, in a straight joint line.

    Attributes:
        joints: (n,) the goal [rad, m for a linear axis]; this or `pose`.
        pose: of the tool.
        frame: of the pose; `base` where left out.
        branch: which of the joint positions that reach the pose, from 1, the nearest first.
    """

    kind: Literal["ptp"]
    joints: NotRequired[Sequence[float]]
    pose: NotRequired[AnyPose]
    frame: NotRequired[str]
    branch: NotRequired[int]


class LinGoal(TypedDict):
    """To a pose, with the tool on a straight line.

    Attributes:
        pose: of the tool.
        frame: of the pose; `base` where left out.
    """

    kind: Literal["lin"]
    pose: AnyPose
    frame: NotRequired[str]


class PathGoal(TypedDict):
    """Through up to 1,600 waypoints.

    Attributes:
        waypoints: joint positions, or poses of the tool.
        frame: of the poses; `base` where left out.
        way: `ptp` passes the waypoints without stopping, `lin` stops at each pose.
    """

    kind: Literal["path"]
    waypoints: Sequence[Sequence[float] | AnyPose]
    frame: NotRequired[str]
    way: NotRequired[Literal["ptp", "lin"]]


class FreeGoal(TypedDict):
    """To a joint position or a pose, around what stands in the cell.

    Attributes:
        joints: (n,) the goal [rad, m for a linear axis]; this or `pose`.
        pose: of the tool.
        frame: of the pose; `base` where left out.
        planner: one of those of `robots.describe`; RRTConnect where left out.
        seed: the same number gives the same path; 0 where left out.
        time_limit: longest search, 0.05 to 5 [s].
        margin: distance that the search keeps from bodies, up to 0.05 [m].
    """

    kind: Literal["free"]
    joints: NotRequired[Sequence[float]]
    pose: NotRequired[AnyPose]
    frame: NotRequired[str]
    planner: NotRequired[str]
    seed: NotRequired[int]
    time_limit: NotRequired[float]
    margin: NotRequired[float]


class PositionGoal(TypedDict):
    """To a named position, such as `home`.

    Attributes:
        name: of the position.
    """

    kind: Literal["position"]
    name: str


Goal: TypeAlias = PtpGoal | LinGoal | PathGoal | FreeGoal | PositionGoal


class BasedOn(TypedDict):
    """What a plan was made from: once any of it has changed the plan is stale.

    Attributes:
        scene: revision of the scene.
        tools: revision of the tools.
        frames: revision of the user frames.
        tool: the selected tool; None for the bare flange.
        attached: objects that the robot carries.
    """

    scene: int
    tools: int
    frames: int
    tool: str | None
    attached: list[str]


class Worst(TypedDict):
    """The greatest value of one quantity in a plan.

    Attributes:
        joint: name of the joint, or of the point of the arm.
        quantity: what is limited.
        ratio: to its limit, 1 being on the limit.
        at: when [s].
    """

    joint: str
    quantity: str
    ratio: float
    at: float


class PlanCertificate(TypedDict):
    """What the independent check of every sample found.

    Attributes:
        valid: always true: what fails is refused.
        margin: least distance of a joint from the end of its range [rad or m].
        worst: the greatest value of each quantity.
    """

    valid: bool
    margin: float
    worst: list[Worst]


class PlanClearance(TypedDict):
    """Where an object of the scene, or a carried one, and another body come nearest.

    Attributes:
        distance: how near [m].
        first: one of them.
        second: the other.
        at: when [s].
    """

    distance: float
    first: str
    second: str
    at: float


class Unexecutable(TypedDict):
    """Why a plan would not be executed now.

    Attributes:
        condition: the condition of `why` that is broken; `plan` for one of the plan's own.
        code: entry of the catalogue.
        text: one sentence with the numbers.
    """

    condition: str
    code: int
    text: str


class MadePlan(TypedDict):
    """A plan that is ready to be looked at, and executed where it is executable.

    Attributes:
        plan: its number.
        state: `ready`.
        expires_in: how long it is kept [s].
        duration: of the motion [s].
        samples: how many, one every 10 ms, the last at the end.
        plan_time: how long planning took [s].
        planner: what found the path.
        seed: of a planner that draws numbers; 0 for others.
        start: joints where it begins [rad, m for a linear axis].
        end: joints where it ends.
        end_pose: of the tool there, in base.
        based_on: what it was made from.
        certificate: what the check of every sample found.
        clearance: where an object of the scene and another body come nearest; None where the
            scene has none.
        executable: whether `execute` would be accepted now.
        why: what it would be refused for; None for nothing.
    """

    plan: int
    state: str
    expires_in: float
    duration: float
    samples: int
    plan_time: float
    planner: str
    seed: int
    start: list[float]
    end: list[float]
    end_pose: FoundPose
    based_on: BasedOn
    certificate: PlanCertificate
    clearance: PlanClearance | None
    executable: bool
    why: Unexecutable | None


class PlanSamples(TypedDict):
    """Some samples of a plan.

    Attributes:
        plan: its number.
        first: number of the first sample that is told, from 0.
        every: of each so many samples one is told.
        total: samples of the plan.
        columns: `t`, then `q0` and so on the joints, `v0` their speeds, `a0` their accelerations.
        rows: the samples [s; rad, rad/s, rad/s², m for a linear axis].
        tool: x, y, z [m] and quaternion x, y, z, w of the tool in base at each row, where asked.
        more: whether samples follow behind the last row.
    """

    plan: int
    first: int
    every: int
    total: int
    columns: list[str]
    rows: list[list[float]]
    tool: NotRequired[list[list[float]]]
    more: bool


class PlanHead(TypedDict):
    """A plan in short.

    Attributes:
        plan: its number.
        state: planning, ready, running, done, stale, expired or dropped.
        kind: of its goal; `program` for the preview of one.
        label: what its maker calls it.
        maker: who had it made.
        duration: of the motion [s]; 0 while it is planned.
        samples: how many; 0 while it is planned.
        expires_in: how long it is kept [s]; 0 where it is no longer ready.
        code: why its state is what it is; 0 for nothing.
        text: the same in words.
    """

    plan: int
    state: str
    kind: str
    label: str
    maker: str
    duration: float
    samples: int
    expires_in: float
    code: int
    text: str


class PlanHeads(TypedDict):
    """The plans of the cell.

    Attributes:
        plans: those that are made, kept or executed, and the last that were, by number.
    """

    plans: list[PlanHead]


@operation("plans.make", needs=Permission.PLAN, since=3)
class MakePlan(Request[MadePlan]):
    """Plan a motion and keep it, to be looked at and executed; nothing moves.

    Raises:
        Refused: UNREACHABLE, OUT_OF_RANGE, BRANCH_CHANGE, START_IN_COLLISION, GOAL_IN_COLLISION,
            PATH_IN_COLLISION, NO_PATH_FOUND, NOT_TIMEABLE, NO_MOTION, UNKNOWN_FRAME, NOT_INSTALLED,
            PLAN_TOO_LONG, TOO_MANY_PLANS; PLANNING: this connection has one plan being made;
            MOVING, FEEDBACK_STALE: it would begin where the robot stands; TOO_LARGE: it has more
            than 1,600 waypoints.
    """

    goal: Annotated[Goal, ReadAsFrom("plan_goals", "AnyGoal")]
    """where to, and how."""
    start: Annotated[Sequence[float], ReadAs(Annotated[tuple[Real, ...], Length(1, 64)])] | None = (
        field(default=None, kw_only=True)
    )
    """joints where it begins; None for where the robot stands: no other plan is executed."""
    speed: Annotated[float, Number(finite=True)] = field(default=0.5, kw_only=True)
    """fraction of the joints' greatest speeds, above 0, up to 1."""
    tool_speed: Annotated[float, Number(finite=True)] | None = field(default=None, kw_only=True)
    """cap of tool and elbow, beside that of the mode [m/s]; None for no other."""
    label: str = field(default="", kw_only=True)
    """shown to others; up to 64 characters."""


@operation("plans.samples", needs=Permission.OBSERVE, since=3)
class AskSamples(Request[PlanSamples]):
    """Return samples of a plan, exactly as they would be executed.

    Raises:
        Refused: PLAN_UNKNOWN, PLAN_STALE; PLANNING: it is not ready yet; TOO_OFTEN;
            BAD_ARGUMENT: it has no such sample.
    """

    plan: Annotated[int, Count(1)]
    """number of the plan."""
    first: Annotated[int, Count(0)] = field(default=0, kw_only=True)
    """number of the first sample, from 0."""
    count: Annotated[int, Count(1, MOST_ROWS)] = field(default=MOST_ROWS, kw_only=True)
    """rows at most; fewer come where a frame holds no more."""
    every: Annotated[int, Count(1, 100)] = field(default=1, kw_only=True)
    """of each so many samples one."""
    with_tool: bool = field(default=False, kw_only=True)
    """whether the tool's place is told, too."""


@operation("plans.show", needs=Permission.OBSERVE, since=3)
class ShowPlans(Request[PlanHeads]):
    """Return all plans of the cell in short."""


@operation("plans.drop", needs=Permission.PLAN, since=3)
class DropPlan(Request[Done]):
    """Forget a plan of one's own, or any with the motion authority.

    Raises:
        Refused: PLAN_UNKNOWN, PLAN_STALE; MOVING: it is being executed; NOT_IN_CONTROL,
            HELD_BY_OTHER: another connection had it made.
    """

    plan: Annotated[int, Count(1)]
    """number of the plan."""
