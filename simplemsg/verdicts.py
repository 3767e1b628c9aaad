"""The catalogue of verdicts: every reason for which the server refuses or aborts, once.

A verdict's number travels in `Verdict` and `Outcome`; its cause and remedy are printed by the
pendants and in the documentation. Numbers are never reused: 1-19 access, 20-39 state of the cell,
40-59 the request itself, 60-79 the way to the controller, 80-99 frames, scene and paths.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class VerdictCode(IntEnum):
    """Why a request was refused or a motion aborted; ACCEPTED and COMPLETED are 0."""

    ACCEPTED = 0
    HELLO_FIRST = 1
    VERSION = 2
    UNKNOWN_CELL = 3
    NOT_IN_CONTROL = 4
    HELD_BY_OTHER = 5
    ADDRESS_NOT_ALLOWED = 6
    NOT_AUTOMATIC = 7
    AUTHORITY_LOST = 8
    STOP_LATCHED = 20
    PLANNING = 21
    MOVING = 22
    CONTROLLER_DOWN = 23
    FEEDBACK_STALE = 24
    CONTROLLER_NOT_READY = 25
    NOT_STANDING = 26
    STOPPED = 27
    SHUTTING_DOWN = 28
    MALFORMED = 41
    BAD_ARGUMENT = 42
    NOT_FINITE = 43
    WRONG_JOINT_COUNT = 44
    OUT_OF_RANGE = 45
    TOO_FAST = 46
    TOO_SHARP = 47
    UNREACHABLE = 48
    BRANCH_CHANGE = 49
    NOT_TIMEABLE = 50
    NO_MOTION = 51
    UNKNOWN_FRAME = 52
    CERTIFICATE_REFUSED = 53
    PLANNER_FAILED = 54
    SEQUENCE = 55
    TOO_MANY_POINTS = 56
    CONTROLLER_REFUSED = 60
    CONTROLLER_SILENT = 61
    CONTROLLER_LOST = 62
    CONTROLLER_MISMATCH = 63
    CONTROLLER_STOPPED = 64
    NOT_ARRIVED = 65
    NOT_FOLLOWING = 66
    FRAME_REFUSED = 80
    NOT_IN_HISTORY = 81
    POOR_GEOMETRY = 82
    BAD_FILE = 83
    PLATFORM_LIMIT = 84
    NO_ASSEMBLY = 85
    NOT_INSTALLED = 86
    UNKNOWN_OBJECT = 87
    DUPLICATE_OBJECT = 88
    START_IN_COLLISION = 89
    GOAL_IN_COLLISION = 90
    PATH_IN_COLLISION = 91
    NO_PATH_FOUND = 92
    BAD_CIRCLE = 93
    ZONE_TOO_LARGE = 94


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """What a verdict means to the person who reads it.

    Attributes:
        cause: what happened.
        remedy: what to do about it.
    """

    cause: str
    remedy: str


def _entry(cause: str, remedy: str) -> CatalogueEntry:
    return CatalogueEntry(cause, remedy)


CATALOGUE: dict[VerdictCode, CatalogueEntry] = {
    VerdictCode.ACCEPTED: _entry("The request was taken.", "Nothing to do."),
    VerdictCode.HELLO_FIRST: _entry(
        "The connection sent a request before its hello.", "Send hello as the first message."
    ),
    VerdictCode.VERSION: _entry(
        "The pendant speaks another version of the protocol.",
        "Use a pendant and a server of the same protocol version.",
    ),
    VerdictCode.UNKNOWN_CELL: _entry(
        "No cell of this name is served here.", "Leave the name empty or ask for a served cell."
    ),
    VerdictCode.NOT_IN_CONTROL: _entry(
        "Only the holder of the motion authority may do this.", "Request the authority first."
    ),
    VerdictCode.HELD_BY_OTHER: _entry(
        "Another connection holds the motion authority.",
        "Wait until its holder releases it, or it expires.",
    ),
    VerdictCode.ADDRESS_NOT_ALLOWED: _entry(
        "This address may not move the robot.", "Add the address to the cell's configuration."
    ),
    VerdictCode.NOT_AUTOMATIC: _entry(
        "The controller does not stand in automatic.", "Turn the controller's own mode selector."
    ),
    VerdictCode.AUTHORITY_LOST: _entry(
        "The motion authority ended while the robot moved; it was stopped.",
        "Request the authority again; nothing resumes by itself.",
    ),
    VerdictCode.STOP_LATCHED: _entry(
        "The software stop is latched.",
        "The holder of the authority resets it; that moves nothing.",
    ),
    VerdictCode.PLANNING: _entry(
        "An earlier motion request is being planned.", "Wait for its outcome, or stop it."
    ),
    VerdictCode.MOVING: _entry("The robot moves.", "Wait for the outcome, or stop it."),
    VerdictCode.CONTROLLER_DOWN: _entry(
        "There is no connection to the robot controller.",
        "Check that the controller runs and its address is right.",
    ),
    VerdictCode.FEEDBACK_STALE: _entry(
        "The controller's last position report is too old to start from.",
        "Check the state connection and its rate.",
    ),
    VerdictCode.CONTROLLER_NOT_READY: _entry(
        "The controller says that motion is not possible.",
        "Read its status: emergency stop, drives, error; clear it at the controller.",
    ),
    VerdictCode.NOT_STANDING: _entry(
        "The robot does not stand where the motion was planned to start.",
        "Ask for the motion again.",
    ),
    VerdictCode.STOPPED: _entry(
        "A software stop ended the motion.", "Reset the stop; ask for the motion again."
    ),
    VerdictCode.SHUTTING_DOWN: _entry("The server is going down.", "Start it again."),
    VerdictCode.MALFORMED: _entry(
        "The body does not have the layout of its message type.", "See the protocol reference."
    ),
    VerdictCode.BAD_ARGUMENT: _entry("A value is outside what it may be.", "Read the text."),
    VerdictCode.NOT_FINITE: _entry(
        "A value is not a number, or infinite.", "Send finite numbers only."
    ),
    VerdictCode.WRONG_JOINT_COUNT: _entry(
        "A joint slot that the robot does not have is not zero.",
        "Send the robot's joints, base to tip, and zeros behind them.",
    ),
    VerdictCode.OUT_OF_RANGE: _entry(
        "A joint would leave its range.", "Move the target back inside the joint's limits."
    ),
    VerdictCode.TOO_FAST: _entry(
        "A joint would exceed its largest speed.", "Allow the motion more time."
    ),
    VerdictCode.TOO_SHARP: _entry(
        "A joint would exceed its largest acceleration.", "Allow the motion more time."
    ),
    VerdictCode.UNREACHABLE: _entry(
        "No joint position inside the limits puts the tool there.",
        "Move the target closer or turn the tool.",
    ),
    VerdictCode.BRANCH_CHANGE: _entry(
        "The straight line would need a jump to another arm configuration.",
        "Use a joint motion, or start in the other configuration.",
    ),
    VerdictCode.NOT_TIMEABLE: _entry(
        "No timing of this path keeps to the limits.", "Smooth or thin the path."
    ),
    VerdictCode.NO_MOTION: _entry("The robot is there already.", "Nothing to do."),
    VerdictCode.UNKNOWN_FRAME: _entry(
        "No frame of this name exists.", "Use base or root, or define the frame."
    ),
    VerdictCode.CERTIFICATE_REFUSED: _entry(
        "The independent check of the planned motion failed.",
        "Report it: the planner made a motion that the checker refused.",
    ),
    VerdictCode.PLANNER_FAILED: _entry(
        "The planning process ended before it answered.",
        "Ask again; report it if it happens twice.",
    ),
    VerdictCode.SEQUENCE: _entry(
        "A trajectory point came out of order; the trajectory was discarded.",
        "Send the points in order, from sequence 0.",
    ),
    VerdictCode.TOO_MANY_POINTS: _entry(
        "The trajectory has more points than the server takes.", "Split or thin the trajectory."
    ),
    VerdictCode.CONTROLLER_REFUSED: _entry(
        "The controller answered a point with failure; the motion was stopped.",
        "Read the controller's status and error code.",
    ),
    VerdictCode.CONTROLLER_SILENT: _entry(
        "The controller did not answer a point in time; the motion was stopped.",
        "Check the controller and the network.",
    ),
    VerdictCode.CONTROLLER_LOST: _entry(
        "The connection to the controller was lost during the motion.",
        "The robot does not resume; ask for the motion again once the link is back.",
    ),
    VerdictCode.CONTROLLER_MISMATCH: _entry(
        "The controller's answer does not belong to what it was sent.",
        "Check the dialect, and that nobody else talks to the controller.",
    ),
    VerdictCode.CONTROLLER_STOPPED: _entry(
        "The controller stopped the robot itself.",
        "Read the controller's status and error code; clear it there.",
    ),
    VerdictCode.NOT_FOLLOWING: _entry(
        "The robot does not follow the points that it is sent; the motion was stopped.",
        "Check the controller's program, its mode and its own speed override.",
    ),
    VerdictCode.NOT_ARRIVED: _entry(
        "All points were sent, but the robot did not come to rest at the goal.",
        "Check the controller; compare its report with the goal.",
    ),
    VerdictCode.FRAME_REFUSED: _entry(
        "The tree of frames does not allow this change.",
        "Choose another name or parent, or remove what depends on the frame first.",
    ),
    VerdictCode.NOT_IN_HISTORY: _entry(
        "The frame's past does not reach back so far.",
        "Ask for a later time, or configure a longer history.",
    ),
    VerdictCode.POOR_GEOMETRY: _entry(
        "The taught points or poses lie too badly to compute anything from.",
        "Teach them further apart, with larger turns between them.",
    ),
    VerdictCode.BAD_FILE: _entry(
        "A file of frames, of a scene or of a mesh cannot be used.",
        "Read the text: it names the file, the place and what would be accepted.",
    ),
    VerdictCode.PLATFORM_LIMIT: _entry(
        "A leg of the platform would leave its stroke or its cone, or the pose its workspace.",
        "Move the target towards home.",
    ),
    VerdictCode.NO_ASSEMBLY: _entry(
        "No pose of the platform has these leg lengths.", "Check the lengths and their order."
    ),
    VerdictCode.NOT_INSTALLED: _entry(
        "This needs a library, or a planner, that is not installed.",
        "Install the extra that the text names, or choose another planner.",
    ),
    VerdictCode.UNKNOWN_OBJECT: _entry(
        "The scene has no object of this name.", "Use a name that the text lists."
    ),
    VerdictCode.DUPLICATE_OBJECT: _entry(
        "The scene has an object of this name already.", "Choose another name."
    ),
    VerdictCode.START_IN_COLLISION: _entry(
        "The robot touches something where it stands.",
        "Move it apart, correct the scene, or allow the pair if they may touch.",
    ),
    VerdictCode.GOAL_IN_COLLISION: _entry(
        "The robot would touch something at the goal.",
        "Choose another goal, correct the scene, or allow the pair if they may touch.",
    ),
    VerdictCode.PATH_IN_COLLISION: _entry(
        "The robot would touch something on the way.", "Go round it, or have the path planned."
    ),
    VerdictCode.NO_PATH_FOUND: _entry(
        "The planner found no way round the obstacles in its time.",
        "Allow more time, choose another planner, or make room.",
    ),
    VerdictCode.BAD_CIRCLE: _entry(
        "No circle goes through these points.", "Teach points that differ and lie on no line."
    ),
    VerdictCode.ZONE_TOO_LARGE: _entry(
        "The zone at a corner does not fit its legs.", "Use the largest zone that the text names."
    ),
}
"""Cause and remedy of every code; a test demands that none is missing."""
