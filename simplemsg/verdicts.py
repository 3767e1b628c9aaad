"""The catalogue of verdicts: every reason for which the server refuses or aborts, once.

A verdict's number travels in `Verdict` and `Outcome`; its cause and remedy are printed by the
pendants and in the documentation. Numbers are never reused: 1-19 access, 20-39 state of the cell,
40-59 the request itself, 60-79 the way to the controller, 80-99 frames, scene and paths,
100-109 the store, 110-129 programs, 130-144 accounts and roles, 180-199 plans and pages, 200-209
kept free for class mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

STATUS_ERROR_OFFSET = 1_000_000
"""Added to a verdict's number in the `error_code` of STATUS, where controllers' own numbers stand.

No controller that is known here has numbers of seven digits: ABB's have five or six, the others
fewer.
"""


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
    NO_PLACE = 9
    NO_TAKE_OVER = 10
    STOP_LATCHED = 20
    PLANNING = 21
    MOVING = 22
    CONTROLLER_DOWN = 23
    FEEDBACK_STALE = 24
    CONTROLLER_NOT_READY = 25
    NOT_STANDING = 26
    STOPPED = 27
    SHUTTING_DOWN = 28
    MODE_FORBIDS = 29
    NOT_ENABLED = 30
    ENABLING_LOST = 31
    MODE_CHANGED = 32
    MODE_NOT_OURS = 33
    PRESS_DEAD = 34
    PRESS_STALE = 35
    PROTECTIVE_STOP = 36
    PAUSED = 37
    NOTHING_TO_CONTROL = 38
    PROGRAM_STOPPED = 39
    OVERTAKEN_BY_STOP = 40
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
    TRAJECTORY_INCOMPLETE = 57
    TRAJECTORY_LATE = 58
    CONTROLLER_REFUSED = 60
    CONTROLLER_SILENT = 61
    CONTROLLER_LOST = 62
    CONTROLLER_MISMATCH = 63
    CONTROLLER_STOPPED = 64
    NOT_ARRIVED = 65
    NOT_FOLLOWING = 66
    JOG_INCREMENTS_ONLY = 67
    CANNOT_PAUSE = 68
    CONFIRM_FIRST = 69
    NOT_PREPARED = 70
    LEFT_THE_PATH = 72
    OVER_SPEED = 73
    OVER_RANGE = 74
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
    REVISION_CONFLICT = 100
    NOT_FOUND = 101
    DISK_FULL = 102
    STORE_READ_ONLY = 103
    STORE_FAILED = 104
    STORE_BUSY = 105
    BAD_NAME = 106
    TOO_LARGE = 107
    BAD_DOCUMENT = 108
    OUT_OF_SEQUENCE = 109
    PROGRAM_SYNTAX = 110
    PROGRAM_TOO_LARGE = 111
    PROGRAM_INVALID = 112
    PROGRAM_WRONG_ROBOT = 113
    PROGRAM_UNKNOWN = 114
    POINT_UNKNOWN = 115
    POINT_IN_USE = 116
    POINT_EXISTS = 117
    POINT_INCONSISTENT = 118
    CALL_TOO_DEEP = 119
    INPUT_TIMEOUT = 120
    PROGRAM_NOT_RUNNING = 121
    PROGRAM_RUNNING = 122
    PROGRAM_STUCK = 123
    NOTHING_TO_UNDO = 124
    STEP_BACK_REFUSED = 125
    FLAG_NOT_READ = 126
    STEP_FORWARD_REFUSED = 127
    LOGIN_NEEDED = 130
    LOGIN_FAILED = 131
    LOCKED_OUT = 132
    LOGIN_BUSY = 133
    ROLE_TOO_LOW = 134
    PAIRING_WRONG = 135
    NAME_TAKEN = 136
    BAD_PASSWORD = 137
    BAD_ACCOUNT_NAME = 138
    ACCOUNT_EXISTS = 139
    UNKNOWN_ACCOUNT = 140
    LAST_ADMIN = 141
    REQUEST_REPEATED = 142
    ACCOUNT_FULL = 143
    ADDRESS_BARRED = 144
    BAR_REFUSED = 145
    NO_JOG_TO_UNDO = 146
    UNKNOWN_CONNECTION = 147
    OUTSIDE_LIMITS = 148
    SERVER_LATE = 149
    CELL_FAULTED = 150
    OVERRIDE_ZERO = 151
    NO_SIGNAL = 160
    NO_STORE = 161
    RECORDING_RUNNING = 170
    NOT_RECORDING = 171
    RECORDING_WRONG_ROBOT = 172
    RECORDING_GAP = 173
    RECORDING_FELL_BEHIND = 174
    CHANGE_WHILE_MOVING = 175
    SIGNALS_UNAVAILABLE = 177
    ROBOT_FIXED = 178
    PLAN_UNKNOWN = 180
    PLAN_STALE = 181
    TOO_MANY_PLANS = 182
    PLAN_TOO_LONG = 183
    TOO_OFTEN = 184
    SUPERSEDED = 185
    FORWARD_FIRST = 186
    FORWARD_REFUSED = 187
    NOTHING_GRIPPED = 190
    NOT_HELD = 191
    UNKNOWN_POSITION = 195
    UNKNOWN_MESH = 196


_SINCE_VERSION_3: dict[int, VerdictCode] = {
    VerdictCode.JOG_INCREMENTS_ONLY: VerdictCode.MODE_FORBIDS,
    VerdictCode.CANNOT_PAUSE: VerdictCode.NOTHING_TO_CONTROL,
    VerdictCode.CONFIRM_FIRST: VerdictCode.BAD_ARGUMENT,
    VerdictCode.NOT_PREPARED: VerdictCode.CONTROLLER_NOT_READY,
    VerdictCode.PLAN_UNKNOWN: VerdictCode.BAD_ARGUMENT,
    VerdictCode.PLAN_STALE: VerdictCode.BAD_ARGUMENT,
    VerdictCode.TOO_MANY_PLANS: VerdictCode.BAD_ARGUMENT,
    VerdictCode.PLAN_TOO_LONG: VerdictCode.BAD_ARGUMENT,
    VerdictCode.TOO_OFTEN: VerdictCode.BAD_ARGUMENT,
    VerdictCode.SUPERSEDED: VerdictCode.BAD_ARGUMENT,
    VerdictCode.FORWARD_FIRST: VerdictCode.BAD_ARGUMENT,
    VerdictCode.FORWARD_REFUSED: VerdictCode.BAD_ARGUMENT,
    VerdictCode.NOTHING_GRIPPED: VerdictCode.UNKNOWN_OBJECT,
    VerdictCode.NOT_HELD: VerdictCode.UNKNOWN_OBJECT,
    VerdictCode.UNKNOWN_POSITION: VerdictCode.BAD_ARGUMENT,
    VerdictCode.UNKNOWN_MESH: VerdictCode.BAD_ARGUMENT,
}
"""What a connection of version 2 is told in place of a code that it does not know."""


def since(code: int) -> int:
    """Return the first version of the pendant protocol that has a code."""
    return 3 if code in _SINCE_VERSION_3 else 2


def in_version_2(code: int) -> int:
    """Return the code that a connection of version 2 is told; its text stays the true one."""
    return _SINCE_VERSION_3.get(code, code)


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """Meaning of a verdict for the person who reads it."""

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
        "No cell of this name is served here, or several are and none was named.",
        "Name one of the served cells; an empty name will do only where there is one.",
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
    VerdictCode.NO_PLACE: _entry(
        "The server has as many connections as it may have, or too many that did not log in.",
        "Wait as many seconds as the value says, then connect again.",
    ),
    VerdictCode.NO_TAKE_OVER: _entry(
        "In a manual mode nobody is taken over from, because the holder may be at the robot.",
        "Ask the holder to release it; anybody may stop the robot meanwhile.",
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
    VerdictCode.MODE_FORBIDS: _entry(
        "The mode of operation does not allow this kind of motion.",
        "Set another mode: jog in manual, run in automatic, recovery only leads back inside.",
    ),
    VerdictCode.NOT_ENABLED: _entry(
        "The enabling device (training) is not held in its middle position.",
        "Let it go, then hold it half pressed and try again.",
    ),
    VerdictCode.ENABLING_LOST: _entry(
        "The enabling device (training) was let go or pressed through; the robot was stopped.",
        "Let it go, hold it half pressed and ask for the motion again.",
    ),
    VerdictCode.MODE_CHANGED: _entry(
        "The mode of operation was changed; a change stops the robot.",
        "Hold the enabling device anew and ask again.",
    ),
    VerdictCode.MODE_NOT_OURS: _entry(
        "The mode belongs to the controller's own selector and is only shown here.",
        "Turn the selector at the controller.",
    ),
    VerdictCode.PRESS_DEAD: _entry(
        "The press has ended, or its number was used before; a press that ended never moves again.",
        "Let go and press anew, with a higher number than any before on this connection.",
    ),
    VerdictCode.PRESS_STALE: _entry(
        "The press does not quote a state message of the last half second.",
        "Subscribe to the state and quote the sequence of the newest message.",
    ),
    VerdictCode.PROTECTIVE_STOP: _entry(
        "The server stopped the robot by itself, for the reason that is shown.",
        "Remove the reason, then reset the stop.",
    ),
    VerdictCode.PAUSED: _entry(
        "A motion is paused on its path.", "Resume it or end it with a program stop."
    ),
    VerdictCode.NOTHING_TO_CONTROL: _entry(
        "No motion or program that could be paused, resumed or ended is there.",
        "Look at the state.",
    ),
    VerdictCode.PROGRAM_STOPPED: _entry(
        "A program stop ended the motion.", "Start the motion or the program again."
    ),
    VerdictCode.OVERTAKEN_BY_STOP: _entry(
        "A stop that the same connection sent behind this request was faster, and acts first.",
        "Ask again, if it is still wanted, once the stop was answered and is reset.",
    ),
    VerdictCode.MALFORMED: _entry(
        "The body does not have the layout of its message type.", "See the protocol reference."
    ),
    VerdictCode.BAD_ARGUMENT: _entry(
        "A value is outside what it may be.",
        "Send a value within what the text says is accepted.",
    ),
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
    VerdictCode.TRAJECTORY_INCOMPLETE: _entry(
        "A trajectory did not come to its end: it announced one that never came, or its link was"
        " lost.",
        "Send it again, whole; look for what broke the client off.",
    ),
    VerdictCode.TRAJECTORY_LATE: _entry(
        "The robot could not begin a trajectory soon enough after its last point; it was dropped.",
        "Send it again once the robot stands; where it stood, take load off the machine.",
    ),
    VerdictCode.CONTROLLER_REFUSED: _entry(
        "The controller answered a point with failure; the motion was stopped.",
        "Read the controller's status and error code; where points came late, take load off the"
        " network and the machine.",
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
    VerdictCode.LEFT_THE_PATH: _entry(
        "The robot was reported farther from its path than accepted; it was stopped.",
        "Look whether something pushed, held or released it, then reset the stop. If it moves well"
        " and is only slow to follow, declare that: [controller] path_tolerance, lag and noise.",
    ),
    VerdictCode.OVER_SPEED: _entry(
        "The robot was reported faster than a joint, or tool and elbow in this mode, may be.",
        "Look whether the controller keeps to the times of the points and the robot file has its"
        " limits, and whether [controller] state_period and noise are its own; reset the stop.",
    ),
    VerdictCode.OVER_RANGE: _entry(
        "The robot was reported beyond the range of a joint while it moved; it was stopped.",
        "Look whether robot file and controller have the same ranges and zeros, then reset the stop"
        " and lead the joint back in the recovery mode, or by the controller's own pendant.",
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
    VerdictCode.REVISION_CONFLICT: _entry(
        "Somebody else changed the document since it was read; nothing was saved, lost or moved.",
        "Load the revision that the text names; make the change there, or check and run that one.",
    ),
    VerdictCode.NOT_FOUND: _entry(
        "The store has no such document, or no longer that revision of it.",
        "List the documents and their history; choose one of them.",
    ),
    VerdictCode.DISK_FULL: _entry(
        "The disk has no room for the document; what was saved before is untouched.",
        "Make room on the disk, then save again.",
    ),
    VerdictCode.STORE_READ_ONLY: _entry(
        "The store's file or folder may not be written.",
        "Correct the permissions or the mount, then start the server again.",
    ),
    VerdictCode.STORE_FAILED: _entry(
        "The store's file cannot be read or written.",
        "Read the system's words in the text; run the check of the store.",
    ),
    VerdictCode.STORE_BUSY: _entry(
        "The disk does not keep up, another program holds the store, or the change before is not"
        " in force and saved yet.",
        "Save again later.",
    ),
    VerdictCode.BAD_NAME: _entry(
        "A document cannot have this name.",
        "Use printable characters without / and \\, at most 64 bytes of UTF-8 for a new one.",
    ),
    VerdictCode.TOO_LARGE: _entry(
        "The document, chunk or file is larger than what is taken.", "Split it, or thin it."
    ),
    VerdictCode.BAD_DOCUMENT: _entry(
        "The text is no document, or the file is no export of a store.",
        "Read the text: it names the line, the place and what would be accepted.",
    ),
    VerdictCode.OUT_OF_SEQUENCE: _entry(
        "A chunk of a recording is not the next one.",
        "Go on with the chunk that the text names.",
    ),
    VerdictCode.PROGRAM_SYNTAX: _entry(
        "The text of a program does not follow the grammar.",
        "Read the text: it names line and column, and what would be accepted there.",
    ),
    VerdictCode.PROGRAM_TOO_LARGE: _entry(
        "A program, or a part of it, is larger than the server takes.",
        "Split it into programs that call each other.",
    ),
    VerdictCode.PROGRAM_INVALID: _entry(
        "A statement, a point or the order of a program's blocks cannot be as given.",
        "Read the text: it names the place and what would be accepted.",
    ),
    VerdictCode.PROGRAM_WRONG_ROBOT: _entry(
        "The program was taught on another robot.",
        "Load it in the cell of that robot, or teach its points anew.",
    ),
    VerdictCode.PROGRAM_UNKNOWN: _entry(
        "There is no program of this name.", "Use a name that the text lists."
    ),
    VerdictCode.POINT_UNKNOWN: _entry(
        "The program has no point of this name.", "Record the point first, or correct the name."
    ),
    VerdictCode.POINT_IN_USE: _entry(
        "The point is used by statements, so it cannot be deleted.",
        "Delete or change the statements that the text names first.",
    ),
    VerdictCode.POINT_EXISTS: _entry(
        "The program has a point of this name already.",
        "Choose another name, or touch the point up.",
    ),
    VerdictCode.POINT_INCONSISTENT: _entry(
        "The joints of a point do not put the tool at its pose.",
        "Touch the point up, or correct its frame or tool.",
    ),
    VerdictCode.CALL_TOO_DEEP: _entry(
        "Programs call each other too deep, or in a circle.",
        "Use a loop instead of a program that calls itself.",
    ),
    VerdictCode.INPUT_TIMEOUT: _entry(
        "The input did not take the value in time.",
        "Check what drives the input, or allow more time.",
    ),
    VerdictCode.PROGRAM_NOT_RUNNING: _entry(
        "No program is in a state for this.",
        "Start the program, or pause it first, as the text says.",
    ),
    VerdictCode.PROGRAM_RUNNING: _entry(
        "A program is under way; one that is paused still is.",
        "End it with a program stop; to step it or to run it on, a pause is enough.",
    ),
    VerdictCode.PROGRAM_STUCK: _entry(
        "The program goes round without moving or waiting.",
        "Put a motion, a wait or an input into the loop.",
    ),
    VerdictCode.NOTHING_TO_UNDO: _entry("There is no edit to undo or to redo.", "Nothing to do."),
    VerdictCode.STEP_BACK_REFUSED: _entry(
        "The program cannot step back from here.",
        "Do what the text says is accepted, or start from the wanted statement instead.",
    ),
    VerdictCode.FLAG_NOT_READ: _entry(
        "A condition asks for a flag that no input was read into.",
        "Read an input into the flag before the condition.",
    ),
    VerdictCode.STEP_FORWARD_REFUSED: _entry(
        "Several moves that zones join are left, and no single step ends between them.",
        "Resume; or end the run with a program stop, and step from the line that is wanted.",
    ),
    VerdictCode.NO_JOG_TO_UNDO: _entry(
        "There is no jog whose way could be taken back.",
        "An undo works once after each jog, before anything else moves the robot; ended half-way,"
        " it goes on. From elsewhere, jog or move.",
    ),
    VerdictCode.OUTSIDE_LIMITS: _entry(
        "A joint stands outside its limits, so only motion back inside is allowed.",
        "Jog the joint back inside; where the mode is set here, in the recovery mode.",
    ),
    VerdictCode.SERVER_LATE: _entry(
        "The server was late: its watchdog stopped the robot, or the robot ran out of points.",
        "Read in the server's log what held it, take load off the machine, reset the stop where one"
        " is latched, and move again.",
    ),
    VerdictCode.CELL_FAULTED: _entry(
        "A fault of the server itself stopped this cell; the others go on.",
        "Start the server again and report what its log says.",
    ),
    VerdictCode.OVERRIDE_ZERO: _entry(
        "The speed override is 0, at which nothing moves.",
        "Raise the speed override, then ask for the motion again, or resume what is paused.",
    ),
    VerdictCode.LOGIN_NEEDED: _entry(
        "This needs a role, and the connection has not logged in.",
        "Log in, or pair with the code that the teacher shows.",
    ),
    VerdictCode.LOGIN_FAILED: _entry(
        "Name or password is wrong, or the account is disabled.",
        "Type both again; an admin can set another password.",
    ),
    VerdictCode.LOCKED_OUT: _entry(
        "Too many attempts at this account, or at pairing, from this address failed.",
        "Wait as long as the text says; other accounts and stopping work meanwhile.",
    ),
    VerdictCode.LOGIN_BUSY: _entry(
        "Too many logins wait to be checked, or this connection's last one does.",
        "Try again in a few seconds.",
    ),
    VerdictCode.ROLE_TOO_LOW: _entry(
        "The role that was granted does not include this.",
        "Log in with an account of the role that the text names.",
    ),
    VerdictCode.PAIRING_WRONG: _entry(
        "This is no pairing code of this cell, or no longer.",
        "Type the code that the teacher shows now.",
    ),
    VerdictCode.NAME_TAKEN: _entry(
        "Somebody or something else is called so already.", "Choose another name."
    ),
    VerdictCode.BAD_PASSWORD: _entry(
        "The new password is too easy to guess, too short or too long.",
        "Use 8 to 128 characters; several words are easy to remember.",
    ),
    VerdictCode.BAD_ACCOUNT_NAME: _entry(
        "Nobody can be called so.",
        "Use up to 32 bytes of letters and digits, with . _ - or single spaces between.",
    ),
    VerdictCode.ACCOUNT_EXISTS: _entry(
        "There is an account of this name; capitals do not tell names apart.",
        "Choose another name, or change the account that exists.",
    ),
    VerdictCode.UNKNOWN_ACCOUNT: _entry(
        "There is no account of this name.", "Use a name that the list of users shows."
    ),
    VerdictCode.LAST_ADMIN: _entry(
        "Nobody could manage the accounts that remain.",
        "Make somebody else admin first, or remove the other accounts.",
    ),
    VerdictCode.REQUEST_REPEATED: _entry(
        "The request came twice, or behind one that was sent after it.",
        "Count request ids up on each connection; send anew what is still wanted.",
    ),
    VerdictCode.ACCOUNT_FULL: _entry(
        "The account, or the guests of one address, have a quarter of all connections already.",
        "Close some of them; an admin sees all by access.connections, and closes one.",
    ),
    VerdictCode.ADDRESS_BARRED: _entry(
        "An admin has barred the address, so that nobody of it may do more than stop.",
        "Wait as many seconds as the value says, connect from elsewhere, or ask an admin.",
    ),
    VerdictCode.BAR_REFUSED: _entry(
        "The address is this machine's, your own, or one from which an admin is logged in, or too"
        " many are barred.",
        "Close single connections by access.close, disable the account that misbehaves, or unbar"
        " another address.",
    ),
    VerdictCode.UNKNOWN_CONNECTION: _entry(
        "There is no connection of this number, or no longer.",
        "Ask for access.connections, and use a number that it shows.",
    ),
    VerdictCode.RECORDING_RUNNING: _entry(
        "A recording is under way already.", "Stop it first; the text names it."
    ),
    VerdictCode.NOT_RECORDING: _entry("No recording is under way.", "Start one first."),
    VerdictCode.RECORDING_WRONG_ROBOT: _entry(
        "The recording was made with another robot, or does not say with which.",
        "Play it on the robot that the text names, or import it with --robot.",
    ),
    VerdictCode.RECORDING_GAP: _entry(
        "The recording has a gap in which nobody knows where the robot was.",
        "Play the part before or after it, or record again; the text says where the gap is.",
    ),
    VerdictCode.RECORDING_FELL_BEHIND: _entry(
        "The disk did not take the samples fast enough, so the recording was ended.",
        "What was kept can be played; find out what slows the disk.",
    ),
    VerdictCode.CHANGE_WHILE_MOVING: _entry(
        "Frames, tools and what may touch what are not changed while a motion is under way, and no"
        " motion begins while frames or tools are being saved or read, or a changed scene is being"
        " put in force; while objects are being added, no jog begins.",
        "Wait until the robot stands, or stop it; what is being saved or put in force is so soon:"
        " ask again.",
    ),
    VerdictCode.SIGNALS_UNAVAILABLE: _entry(
        "The controller does not offer its inputs and outputs to us, or did not answer.",
        "Ask again once it is connected; a controller of another maker may offer none.",
    ),
    VerdictCode.ROBOT_FIXED: _entry(
        "A cell has one robot, the one of its controller.",
        "Start a cell for the other robot: openpendant serve with an emulator, and connect there.",
    ),
    VerdictCode.NO_SIGNAL: _entry(
        "The program names an input or an output that the cell does not have.",
        "Use a signal of the cell, or take the statement out.",
    ),
    VerdictCode.NO_STORE: _entry(
        "This server keeps no documents.", "Name a file with --store, or in the cell file."
    ),
    VerdictCode.JOG_INCREMENTS_ONLY: _entry(
        "This controller takes no jog that lasts as long as a key is held.",
        "Jog by increments; controller.describe says what the controller takes.",
    ),
    VerdictCode.CANNOT_PAUSE: _entry(
        "This controller cannot pause a motion on its path.",
        "Stop it, or let it end; the text says what would happen instead.",
    ),
    VerdictCode.CONFIRM_FIRST: _entry(
        "To prepare this controller does what the text says, to a real robot.",
        "Ask again within ten seconds with the token in the value, if that is wanted.",
    ),
    VerdictCode.NOT_PREPARED: _entry(
        "The controller has to be prepared before it moves the robot.",
        "Send prepare, or do at the controller what the text says.",
    ),
    VerdictCode.PLAN_UNKNOWN: _entry(
        "There is no plan of this number.", "Make one with plans.make; plans.show lists them."
    ),
    VerdictCode.PLAN_STALE: _entry(
        "The plan is no longer what would be driven; the text names what changed.", "Plan anew."
    ),
    VerdictCode.TOO_MANY_PLANS: _entry(
        "As many plans are being made or kept as there may be.",
        "Wait for the one that is being made, or forget one with plans.drop.",
    ),
    VerdictCode.PLAN_TOO_LONG: _entry(
        "The plan takes longer than a plan may.", "Split it, or ask for a higher speed."
    ),
    VerdictCode.TOO_OFTEN: _entry(
        "More questions came than are answered in this time.",
        "Wait as many seconds as the value says.",
    ),
    VerdictCode.SUPERSEDED: _entry(
        "A newer question of the same connection took the place of this one.", "Nothing to do."
    ),
    VerdictCode.FORWARD_FIRST: _entry(
        "A gateway's connection did not say first for whom it speaks.",
        "Update the gateway, or connect from another address than the gateway's.",
    ),
    VerdictCode.FORWARD_REFUSED: _entry(
        "Name, address or secret of the gateway is not the configured one.",
        "Compare [[gateways]] of the server's configuration with the gateway's own.",
    ),
    VerdictCode.NOTHING_GRIPPED: _entry(
        "The tool is not at the object: the value is the distance, the limit the tool's reach.",
        "Move closer, or correct the object's place or the tool's grasp point.",
    ),
    VerdictCode.NOT_HELD: _entry(
        "Nothing holds the object that was to be let go, or something holds it already.",
        "Look at the scene: it says what holds each object.",
    ),
    VerdictCode.UNKNOWN_POSITION: _entry(
        "There is no position of this name; the text says the nearest one.",
        "Ask for positions.list, or save the position first.",
    ),
    VerdictCode.UNKNOWN_MESH: _entry(
        "There is no mesh with this hash.", "Ask for shapes.meshes, and use a hash that it tells."
    ),
}
"""Cause and remedy of every code; a test demands that none is missing."""
