"""Operation on the controller: what it can do, and how far it is known."""

from __future__ import annotations

from typing import Literal, TypedDict

from ..roles import Permission
from .declaration import Request, operation


class ReplyDeadlines(TypedDict):
    """How long answers, and what follows from them, are waited for.

    Attributes:
        point: until a point is answered [s].
        stop: until a STOP is answered [s].
        motion: until the robot moves after its first point [s].
    """

    point: float
    stop: float
    motion: float


class ControllerDeclaration(TypedDict):
    """What a controller can do, how it is watched, and how far it is known.

    Attributes:
        declaration: counts the changes of this answer, from 1; as in CONTROLLER_CHANGED.
        dialect: how it is spoken to.
        emulated: whether it is known to be emulated: it says so, and so does the cell's file.
        says_emulated: whether it says so on this connection.
        prepared: whether it is prepared to be moved.
        identity: whether it is that of the cell's robot, as far as that was looked at.
        feeding: how a planned motion goes to it.
        jog: which jogs it takes; with `increments` JOG_START is refused, with `none` all are.
        pause: whether a motion pauses on its path, or cannot be paused.
        override: when the speed override acts.
        points: type of the messages that points travel in.
        in_flight: points that may wait for their answers at once.
        most_points: of one part of a motion; None for no bound.
        lead: how far points of a planned motion are sent ahead of the robot [s].
        jog_lead: likewise of a jog [s].
        interpolation: what it does between points, in words.
        path_tolerance: of that at the tool [m]; 0 where it goes through every point.
        angle_tolerance: likewise [rad].
        speed_enforced_by: who holds the speed of a mode.
        second_stop: whether STOP has a connection of its own.
        link_loss_stops: whether the robot stops by itself where its motion connection is lost.
        residual_motion: longest motion after a STOP that arrived [s].
        blind_motion: longest motion after the last that could be delivered [s].
        freeze_protection: what stops the robot where the server's process stands still.
        ramp_time: how long a released jog may ramp before that becomes a STOP [s].
        following: what a report is held against: `due`, what was due, or `place` on the path.
        following_tolerance: how far a turning joint may be from that while it stands [rad].
        lag: how far each joint may be behind its set-points besides [s].
        noise: of a reported position, accepted besides [rad or m].
        state_period: of its reports [s].
        fresh_age: a new motion begins from a report that is no older [s].
        abort_age: a motion ends where the newest report is older [s].
        start_tolerance: how far a motion may begin from where the robot stands [rad or m]; None
            for no bound.
        prepare: what PREPARE may ask of it; empty where that is refused.
        identify: what tells that it is the robot's own controller.
        signals: `openpendant` where it has some for the server.
        reply_deadlines: how long its answers are waited for.
    """

    declaration: int
    dialect: str
    emulated: bool
    says_emulated: bool
    prepared: Literal["no", "yes", "not needed"]
    identity: Literal["unverified", "match", "mismatch"]
    feeding: Literal["stream", "knots", "download"]
    jog: Literal["continuous", "increments", "none"]
    pause: Literal["path", "none"]
    override: Literal["live", "before start", "none"]
    points: int
    in_flight: int
    most_points: int | None
    lead: float
    jog_lead: float
    interpolation: str
    path_tolerance: float
    angle_tolerance: float
    speed_enforced_by: Literal["server", "controller"]
    second_stop: bool
    link_loss_stops: bool
    residual_motion: float
    blind_motion: float
    freeze_protection: Literal[
        "second connection", "link shutdown", "controller's own timeout", "none"
    ]
    ramp_time: float
    following: Literal["due", "place"]
    following_tolerance: float
    lag: float
    noise: float
    state_period: float
    fresh_age: float
    abort_age: float
    start_tolerance: float | None
    prepare: list[str]
    identify: list[str]
    signals: Literal["none", "openpendant"]
    reply_deadlines: ReplyDeadlines


@operation("controller.describe", needs=Permission.OBSERVE, since=3)
class DescribeController(Request[ControllerDeclaration]):
    """Return what the controller can do; ask again after each CONTROLLER_CHANGED."""
