// Generated from the declarations in simplemsg/ by `make reference`; do not edit.
//
// The pendant protocol, version 3: messages with their codec, and codes.
// Lengths are m, angles rad, times s, quaternions x, y, z, w; joints count from 0.
import { decodeBy, encodeBy } from "./codec.ts";
import type { Bare, Header, Layouts, Opaque, RealSize } from "./codec.ts";

export type * from "./operations.ts";

export const PROTOCOL_VERSION = 3;

/** A number with a name in T, or one that a newer server gave a meaning. */
export type Named<T> = T[keyof T] | (number & {});

/** What the server offers to this connection. */
export const Capability = { JOINT_MOVE: 1, POSE_MOVE: 2, JOINT_PATH: 4, POSE_PATH: 8, SOFTWARE_STOP: 16, JOG: 32, MODES: 64, PAUSE: 128, PROGRAMS: 256, RECORDING: 512, LOGIN: 1024, SIGNALS: 2048, SCENE: 4096, PLANS: 8192, KINEMATICS: 16384, SHAPES: 32768, NOTICES: 65536, POSITIONS: 131072, GRASP: 262144, PREPARE: 1048576 } as const;

/** Whether a connection is told what others change. */
export const Notices = { UNWANTED: 0, WANTED: 1 } as const;

/** Whether a browser came to the gateway by TLS. */
export const Encrypted = { NO: 0, YES: 1 } as const;

/** Why a request was refused or a motion aborted; ACCEPTED and COMPLETED are 0. */
export const VerdictCode = { ACCEPTED: 0, HELLO_FIRST: 1, VERSION: 2, UNKNOWN_CELL: 3, NOT_IN_CONTROL: 4, HELD_BY_OTHER: 5, ADDRESS_NOT_ALLOWED: 6, NOT_AUTOMATIC: 7, AUTHORITY_LOST: 8, NO_PLACE: 9, NO_TAKE_OVER: 10, STOP_LATCHED: 20, PLANNING: 21, MOVING: 22, CONTROLLER_DOWN: 23, FEEDBACK_STALE: 24, CONTROLLER_NOT_READY: 25, NOT_STANDING: 26, STOPPED: 27, SHUTTING_DOWN: 28, MODE_FORBIDS: 29, NOT_ENABLED: 30, ENABLING_LOST: 31, MODE_CHANGED: 32, MODE_NOT_OURS: 33, PRESS_DEAD: 34, PRESS_STALE: 35, PROTECTIVE_STOP: 36, PAUSED: 37, NOTHING_TO_CONTROL: 38, PROGRAM_STOPPED: 39, OVERTAKEN_BY_STOP: 40, MALFORMED: 41, BAD_ARGUMENT: 42, NOT_FINITE: 43, WRONG_JOINT_COUNT: 44, OUT_OF_RANGE: 45, TOO_FAST: 46, TOO_SHARP: 47, UNREACHABLE: 48, BRANCH_CHANGE: 49, NOT_TIMEABLE: 50, NO_MOTION: 51, UNKNOWN_FRAME: 52, CERTIFICATE_REFUSED: 53, PLANNER_FAILED: 54, SEQUENCE: 55, TOO_MANY_POINTS: 56, TRAJECTORY_INCOMPLETE: 57, TRAJECTORY_LATE: 58, CONTROLLER_REFUSED: 60, CONTROLLER_SILENT: 61, CONTROLLER_LOST: 62, CONTROLLER_MISMATCH: 63, CONTROLLER_STOPPED: 64, NOT_ARRIVED: 65, NOT_FOLLOWING: 66, JOG_INCREMENTS_ONLY: 67, CANNOT_PAUSE: 68, CONFIRM_FIRST: 69, NOT_PREPARED: 70, LEFT_THE_PATH: 72, OVER_SPEED: 73, OVER_RANGE: 74, FRAME_REFUSED: 80, NOT_IN_HISTORY: 81, POOR_GEOMETRY: 82, BAD_FILE: 83, PLATFORM_LIMIT: 84, NO_ASSEMBLY: 85, NOT_INSTALLED: 86, UNKNOWN_OBJECT: 87, DUPLICATE_OBJECT: 88, START_IN_COLLISION: 89, GOAL_IN_COLLISION: 90, PATH_IN_COLLISION: 91, NO_PATH_FOUND: 92, BAD_CIRCLE: 93, ZONE_TOO_LARGE: 94, REVISION_CONFLICT: 100, NOT_FOUND: 101, DISK_FULL: 102, STORE_READ_ONLY: 103, STORE_FAILED: 104, STORE_BUSY: 105, BAD_NAME: 106, TOO_LARGE: 107, BAD_DOCUMENT: 108, OUT_OF_SEQUENCE: 109, PROGRAM_SYNTAX: 110, PROGRAM_TOO_LARGE: 111, PROGRAM_INVALID: 112, PROGRAM_WRONG_ROBOT: 113, PROGRAM_UNKNOWN: 114, POINT_UNKNOWN: 115, POINT_IN_USE: 116, POINT_EXISTS: 117, POINT_INCONSISTENT: 118, CALL_TOO_DEEP: 119, INPUT_TIMEOUT: 120, PROGRAM_NOT_RUNNING: 121, PROGRAM_RUNNING: 122, PROGRAM_STUCK: 123, NOTHING_TO_UNDO: 124, STEP_BACK_REFUSED: 125, FLAG_NOT_READ: 126, STEP_FORWARD_REFUSED: 127, LOGIN_NEEDED: 130, LOGIN_FAILED: 131, LOCKED_OUT: 132, LOGIN_BUSY: 133, ROLE_TOO_LOW: 134, PAIRING_WRONG: 135, NAME_TAKEN: 136, BAD_PASSWORD: 137, BAD_ACCOUNT_NAME: 138, ACCOUNT_EXISTS: 139, UNKNOWN_ACCOUNT: 140, LAST_ADMIN: 141, REQUEST_REPEATED: 142, ACCOUNT_FULL: 143, ADDRESS_BARRED: 144, BAR_REFUSED: 145, NO_JOG_TO_UNDO: 146, UNKNOWN_CONNECTION: 147, OUTSIDE_LIMITS: 148, SERVER_LATE: 149, CELL_FAULTED: 150, OVERRIDE_ZERO: 151, NO_SIGNAL: 160, NO_STORE: 161, RECORDING_RUNNING: 170, NOT_RECORDING: 171, RECORDING_WRONG_ROBOT: 172, RECORDING_GAP: 173, RECORDING_FELL_BEHIND: 174, CHANGE_WHILE_MOVING: 175, SIGNALS_UNAVAILABLE: 177, ROBOT_FIXED: 178, PLAN_UNKNOWN: 180, PLAN_STALE: 181, TOO_MANY_PLANS: 182, PLAN_TOO_LONG: 183, TOO_OFTEN: 184, SUPERSEDED: 185, FORWARD_FIRST: 186, FORWARD_REFUSED: 187, NOTHING_GRIPPED: 190, NOT_HELD: 191, UNKNOWN_POSITION: 195, UNKNOWN_MESH: 196 } as const;

/** How an accepted request ended. */
export const OutcomeKind = { COMPLETED: 1, ABORTED: 2 } as const;

/** What an `Authority` request wants. */
export const AuthorityAction = { REQUEST: 1, RELEASE: 2, FORCE: 3 } as const;

/** How a connection shows who it is. */
export const LoginKind = { PASSWORD: 1, PAIRING: 2 } as const;

/** What an account may do; each role may do all that the ones before it may. */
export const AccountRole = { AS_IT_IS: 0, VIEWER: 1, OPERATOR: 2, PROGRAMMER: 3, ADMIN: 4 } as const;

/** What a `Pairing` request wants. */
export const PairingAction = { ISSUE: 1, WITHDRAW: 2 } as const;

/** How the tool gets to a pose. */
export const Motion = { PTP: 1, LIN: 2 } as const;

/** How far the enabling device (training) is pressed; only the middle position enables. */
export const EnablingPosition = { RELEASED: 0, HELD: 1, PANIC: 2 } as const;

/** The server's own mode of operation; the numbers 1 to 3 are those of OPC UA Robotics. */
export const OperatingMode = { MANUAL_REDUCED: 1, MANUAL_HIGH: 2, AUTOMATIC: 3, RECOVERY: 4 } as const;

/** What a `MotionControl` request wants of the running motion or program. */
export const MotionControlAction = { PAUSE: 1, RESUME: 2, PROGRAM_STOP: 3 } as const;

/** What the values of a jog mean. */
export const JogSpace = { JOINTS: 1, TOOL: 2 } as const;

/** How much of a program is run. */
export const RunKind = { ALL: 1, STEP_FORWARD: 2, STEP_BACKWARD: 3 } as const;

/** What has become of a plan; from DONE on it can be neither read nor executed any more. */
export const PlanState = { PLANNING: 1, READY: 2, RUNNING: 3, DONE: 4, STALE: 5, EXPIRED: 6, DROPPED: 7 } as const;

/** How far a plan around obstacles has come. */
export const PlanStage = { NONE: 0, SEARCHING: 1, SHORTENING: 2, CHECKING: 3 } as const;

/** What is to be done at the controller: all that it needs, or a single step. */
export const PrepareAction = { PREPARE: 1, RELEASE: 2, ALARMS: 3, DRIVES_ON: 4, DRIVES_OFF: 5 } as const;

/** What the cell is doing. */
export const Activity = { IDLE: 0, PLANNING: 1, MOVING: 2, STOPPING: 3, JOGGING: 4, PAUSED: 5, PAUSING: 6 } as const;

/** Which stop is latched. */
export const StopKind = { NONE: 0, SOFTWARE: 1, PROTECTIVE: 2 } as const;

/** Why a jog is slower than asked, or stands. */
export const JogReason = { NONE: 0, JOINT_LIMIT: 1, SINGULARITY: 2, COLLISION: 3, TOOL_SPEED: 4, JOINT_SPEED: 5, WORKSPACE: 6, ELBOW_SPEED: 7, DIRECTION: 8, REACH: 9 } as const;

/** What the program is doing. */
export const ProgramState = { NONE: 0, RUNNING: 1, PAUSED: 2, AT_BREAKPOINT: 3, STEPPED: 4 } as const;

/** The server's connection to the robot controller. */
export const LinkState = { DOWN: 0, UP: 1, STALE: 2 } as const;

/** A truth value that may be unknown (industrial_msgs, TriState). */
export const TriState = { UNKNOWN: -1, FALSE: 0, TRUE: 1 } as const;

/** Operating mode as a controller reports it (industrial_msgs, RobotMode). */
export const ControllerMode = { UNKNOWN: -1, MANUAL: 1, AUTO: 2 } as const;

/** Which values of a `State` are known. */
export const StateField = { POSITION: 2, VELOCITY: 4, TOOL: 16 } as const;

/** Why the motion authority changed hands. */
export const AuthorityReason = { GRANTED: 1, RELEASED: 2, EXPIRED: 3, CONNECTION_LOST: 4, TAKEN_OVER: 5, LOGGED_OUT: 6, ROLE_LOST: 7 } as const;

/** Why a press ended. */
export const JogEnd = { RELEASED: 1, SILENT: 2, CONNECTION_LOST: 3, REPLACED: 4, STOPPED: 5 } as const;

/** Whether the controller is prepared to be moved by the server. */
export const Preparedness = { NO: 0, YES: 1, NOT_NEEDED: 2 } as const;

/** Whether the controller is that of the robot that the cell is configured for. */
export const ControllerIdentity = { UNVERIFIED: 0, MATCH: 1, MISMATCH: 2 } as const;

/** Kind of what changed. */
export const NoticeKind = { EVERYTHING: 0, PROGRAM: 1, RECORDING: 2, FRAMES: 3, TOOLS: 4, SCENE: 5, POSITIONS: 6, SIGNALS: 7, EXERCISE: 8, ROBOT: 9 } as const;

/** What became of it. */
export const Change = { NEW: 1, CHANGED: 2, RENAMED: 3, DELETED: 4 } as const;

/** What a person does at an emulated controller (training only), and a question to it. */
export const OperatorAction = { EMERGENCY_STOP: 1, RESET: 2, IDENTIFY: 3 } as const;

/** One waypoint of a joint path. */
export interface JointWaypoint {
  /** joint positions, unused slots 0 [rad, m for a linear axis] */
  joints: number[];
}

/** One waypoint of a pose path. */
export interface PoseWaypoint {
  /** x, y, z of the tool [m] */
  position: number[];
  /** quaternion x, y, z, w */
  orientation: number[];
}

/** 1, either way. Asks whether the peer is there. */
export interface Ping extends Header {
  type: "ping";
}

/** 65000, pendant to server. Opens a conversation; always the first message. */
export interface Hello extends Header {
  type: "hello";
  /** version of these messages that the pendant speaks */
  protocol_version: number;
  /** state messages wanted, 0 for none, else 1 to 125 [Hz] */
  state_rate: number;
  /** name of the cell, empty for the only one */
  cell: string;
  /** name of the pendant, shown to others */
  client: string;
}

/** 65000, server to pendant. Welcomes a pendant and announces the limits of the conversation. */
export interface HelloReply extends Header {
  type: "hello_reply";
  /** version of these messages that the server speaks */
  protocol_version: number;
  /** number of this connection, not 0 */
  session: number;
  /** bits: what the server offers */
  capabilities: number;
  /** largest frame that the server takes [byte] */
  max_frame: number;
  /** driven joints of the robot */
  dof: number;
  /** the server's control rate [Hz] */
  tick_rate: number;
  /** fastest state rate [Hz] */
  max_state_rate: number;
  /** the authority expires so long after a beat [s] */
  authority_timeout: number;
  /** name of the cell */
  cell: string;
  /** name of the robot */
  robot: string;
  /** name and version of the server */
  server: string;
}

/** 65051, pendant to server. Says what else a pendant of version 3 wants; the verdict's value is the ramp time. */
export interface Declare extends Header {
  type: "declare";
  /** chosen by the pendant */
  request_id: number;
  /** enabling is let go so long after its last sign, 0.05 to 0.25; 0 as the cell [s] */
  enabling_deadline: number;
  /** 1 if changes of documents and plans are to be told */
  notices: Named<typeof Notices>;
  /** of the person, as en or de; for the audit log */
  language: string;
}

/** 65050, pendant to server. Says for whom a gateway opened this connection; always the very first frame. */
export interface Forwarded extends Header {
  type: "forwarded";
  /** name of the gateway in the server's configuration */
  gateway: string;
  /** its secret, 32 bytes in hexadecimal */
  secret: string;
  /** address of the browser, IPv4 or IPv6, without a port */
  address: string;
  /** 1 if the browser came by TLS, else 0 */
  is_encrypted: Named<typeof Encrypted>;
}

/** 65052, pendant to server. Asks which cells there are, before or after hello; once a second. */
export interface Lobby extends Header {
  type: "lobby";
  /** chosen by the pendant */
  request_id: number;
}

/** 65052, server to pendant. Tells which cells there are. */
export interface LobbyReply extends Header {
  type: "lobby_reply";
  /** of the request */
  request_id: number;
  /** one JSON object, UTF-8 */
  body: Uint8Array;
}

/** 65001, pendant to server. Asks for data that has no fixed layout; the body is one JSON object. */
export interface Management extends Header {
  type: "management";
  /** chosen by the pendant */
  request_id: number;
  /** one JSON object, UTF-8 */
  body: Uint8Array;
}

/** 65002, server to pendant. Answers a request; the header says accepted (success) or refused (failure). */
export interface Verdict extends Header {
  type: "verdict";
  /** of the request */
  request_id: number;
  /** 0 accepted, else an entry of the catalogue */
  code: Named<typeof VerdictCode>;
  /** index of the joint at fault, -1 for none */
  joint: number;
  /** the value at fault, SI */
  value: number;
  /** the limit that it breaks, SI */
  limit: number;
  /** one sentence with the numbers */
  text: string;
}

/** 65003, server to pendant. Ends an accepted request: completed or aborted. */
export interface Outcome extends Header {
  type: "outcome";
  /** of the request */
  request_id: number;
  /** 1 completed, 2 aborted */
  outcome: Named<typeof OutcomeKind>;
  /** 0 completed, else an entry of the catalogue */
  code: Named<typeof VerdictCode>;
  /** index of the joint at fault, -1 for none */
  joint: number;
  /** the value at fault, SI */
  value: number;
  /** the limit that it breaks, SI */
  limit: number;
  /** time that planning took [s] */
  plan_time: number;
  /** planned duration of the motion [s] */
  motion_time: number;
  /** one sentence with the numbers */
  text: string;
}

/** 65004, pendant to server. Chooses the rate of state messages. */
export interface Subscribe extends Header {
  type: "subscribe";
  /** chosen by the pendant */
  request_id: number;
  /** state messages wanted, 0 for none, else 1 to 125 [Hz] */
  state_rate: number;
}

/** 65005, pendant to server. Requests, releases or takes over the motion authority. */
export interface Authority extends Header {
  type: "authority";
  /** chosen by the pendant */
  request_id: number;
  /** 1 request, 2 release, 3 take over by role */
  action: Named<typeof AuthorityAction>;
}

/** 65006, pendant to server. Keeps the motion authority; send one each second while holding it. */
export interface AuthorityBeat extends Header {
  type: "authority_beat";
}

/** 65007, pendant to server. Shows who is at the pendant, by password or pairing code. */
export interface Login extends Header {
  type: "login";
  /** chosen by the pendant */
  request_id: number;
  /** 1 password, 2 pairing code */
  kind: Named<typeof LoginKind>;
  /** account, or the name of a guest */
  name: string;
  /** password or pairing code */
  secret: string;
}

/** 65008, pendant to server. Adds an account, or gives one another password. */
export interface SetAccount extends Header {
  type: "set_account";
  /** chosen by the pendant */
  request_id: number;
  /** of a new account: 1 viewer, 2 operator, 3 programmer, 4 admin; 0 for a new password */
  role: Named<typeof AccountRole>;
  /** the account */
  name: string;
  /** its new password */
  secret: string;
}

/** 65009, pendant to server. Asks for a pairing code of the cell, or ends it and the guests that it let in. */
export interface Pairing extends Header {
  type: "pairing";
  /** chosen by the pendant */
  request_id: number;
  /** 1 issue, 2 withdraw */
  action: Named<typeof PairingAction>;
}

/** 65009, server to pendant. Tells the pairing code to whoever asked for it. */
export interface PairingReply extends Header {
  type: "pairing_reply";
  /** of the request */
  request_id: number;
  /** the code ends so long after this reply [s] */
  lifetime: number;
  /** as a teacher shows it */
  code: string;
}

/** 65010, pendant to server. Moves all joints to a position, in a straight joint line. */
export interface JointMove extends Header {
  type: "joint_move";
  /** chosen by the pendant */
  request_id: number;
  /** fraction of the joints' largest speed, above 0, up to 1 */
  speed: number;
  /** slots that are meant; must be the robot's driven joints */
  joint_count: number;
  /** target positions, unused slots 0 [rad, m for a linear axis] */
  joints: number[];
}

/** 65011, pendant to server. Moves the tool to a pose, by PTP or in a straight line. */
export interface PoseMove extends Header {
  type: "pose_move";
  /** chosen by the pendant */
  request_id: number;
  /** 1 PTP, 2 LIN */
  motion: Named<typeof Motion>;
  /** fraction of the joints' largest speed, above 0, up to 1 */
  speed: number;
  /** frame of the pose: base or root */
  frame: string;
  /** x, y, z of the tool [m] */
  position: number[];
  /** quaternion x, y, z, w */
  orientation: number[];
}

/** 65012, pendant to server. Moves through joint positions without stopping. */
export interface JointPath extends Header {
  type: "joint_path";
  /** chosen by the pendant */
  request_id: number;
  /** fraction of the joints' largest speed, above 0, up to 1 */
  speed: number;
  /** slots that are meant; must be the robot's driven joints */
  joint_count: number;
  /** the waypoints in order */
  waypoints: JointWaypoint[];
}

/** 65013, pendant to server. Moves the tool through poses. */
export interface PosePath extends Header {
  type: "pose_path";
  /** chosen by the pendant */
  request_id: number;
  /** 1 PTP, 2 LIN */
  motion: Named<typeof Motion>;
  /** fraction of the joints' largest speed, above 0, up to 1 */
  speed: number;
  /** frame of the poses: base or root */
  frame: string;
  /** the waypoints in order */
  waypoints: PoseWaypoint[];
}

/** 65014, pendant to server. Stops the robot and latches; anyone may send it. */
export interface SoftwareStop extends Header {
  type: "software_stop";
  /** chosen by the pendant */
  request_id: number;
  /** shown to others */
  reason: string;
}

/** 65015, pendant to server. Unlatches the software stop; moves nothing. */
export interface ResetStop extends Header {
  type: "reset_stop";
  /** chosen by the pendant */
  request_id: number;
}

/** 65016, pendant to server. TRAINING: position of the enabling device; repeat it every 50 ms while it is held. */
export interface Enabling extends Header {
  type: "enabling";
  /** 0 released, 1 held, 2 panic */
  position: Named<typeof EnablingPosition>;
}

/** 65017, pendant to server. Sets the mode of operation; stops what moves. */
export interface SetMode extends Header {
  type: "set_mode";
  /** chosen by the pendant */
  request_id: number;
  /** 1 manual reduced speed, 2 manual high speed, 3 automatic, 4 recovery */
  mode: Named<typeof OperatingMode>;
}

/** 65018, pendant to server. Sets the speed override and the cap of the tool speed. */
export interface SetSpeed extends Header {
  type: "set_speed";
  /** chosen by the pendant */
  request_id: number;
  /** fraction of the planned speed, 0.001 to 1; 0 pauses what moves */
  override: number;
  /** cap of tool and elbow, 0 to leave it as it is; in automatic only 0 [m/s] */
  tool_speed: number;
}

/** 65019, pendant to server. Pauses, resumes or ends the motion or the program. */
export interface MotionControl extends Header {
  type: "motion_control";
  /** chosen by the pendant */
  request_id: number;
  /** 1 pause, 2 resume, 3 program stop */
  action: Named<typeof MotionControlAction>;
}

/** 65030, pendant to server. Begins a jog that lasts as long as its press is beaten. */
export interface JogStart extends Header {
  type: "jog_start";
  /** chosen by the pendant */
  request_id: number;
  /** number of the press, higher than any before on this connection */
  press: number;
  /** sequence of a state message that came of late */
  state_sequence: number;
  /** the jog ends so long after a beat, 0.05 to 0.25 [s] */
  deadline: number;
  /** 1 joints, 2 tool */
  space: Named<typeof JogSpace>;
  /** tool jog: frame of the axes; base, tool or a named one */
  frame: string;
  /** slots that are meant: driven joints, or 6 for the tool */
  value_count: number;
  /** -1 to 1: parts of the jog speed; tool: x, y, z, then about x, y, z */
  values: number[];
}

/** 65031, pendant to server. Keeps a press alive; send one every 50 ms. */
export interface JogBeat extends Header {
  type: "jog_beat";
  /** number of the press */
  press: number;
  /** counts the beats of the press, from 1 */
  beat: number;
}

/** 65032, pendant to server. Ends a press: the robot ramps to rest at once. */
export interface JogRelease extends Header {
  type: "jog_release";
  /** chosen by the pendant */
  request_id: number;
  /** number of the press */
  press: number;
}

/** 65033, pendant to server. Moves by one increment, in a straight line. */
export interface JogStep extends Header {
  type: "jog_step";
  /** chosen by the pendant */
  request_id: number;
  /** fraction of the jog speed, above 0, up to 1 */
  speed: number;
  /** 1 joints, 2 tool */
  space: Named<typeof JogSpace>;
  /** tool step: frame of the axes; base, tool or a named one */
  frame: string;
  /** slots that are meant: driven joints, or 6 for the tool */
  value_count: number;
  /** increments; tool: x, y, z, then about x, y, z [rad, m] */
  values: number[];
}

/** 65034, pendant to server. Moves back along the way of the last jog. */
export interface JogUndo extends Header {
  type: "jog_undo";
  /** chosen by the pendant */
  request_id: number;
  /** fraction of the jog speed, above 0, up to 1 */
  speed: number;
}

/** 65040, pendant to server. Runs a stored program, or one step of it. */
export interface ProgramRun extends Header {
  type: "program_run";
  /** chosen by the pendant */
  request_id: number;
  /** 1 all, 2 step forward, 3 step backward */
  run: Named<typeof RunKind>;
  /** line to begin at, 0 for the first; 0 on a paused program resumes it */
  line: number;
  /** how often, 0 for until it is stopped; to resume: as begun */
  loops: number;
  /** revision to run, 0 for the newest or that under way */
  revision: number;
  /** fraction of the programmed speeds, above 0, up to 1 */
  speed: number;
  /** name of the program */
  program: string;
}

/** 65041, pendant to server. Moves all joints to a named position of the robot or the cell. */
export interface Home extends Header {
  type: "home";
  /** chosen by the pendant */
  request_id: number;
  /** fraction of the joints' largest speed, above 0, up to 1 */
  speed: number;
  /** a named position, such as home or zero; see positions.list */
  target: string;
}

/** 65053, pendant to server. Executes a plan, sample by sample, as it was shown. */
export interface Execute extends Header {
  type: "execute";
  /** chosen by the pendant */
  request_id: number;
  /** number of the plan */
  plan: number;
  /** 1 to be refused unless the speed override is 1, else 0 */
  override_is_one: number;
}

/** 65054, server to pendant. A plan is being made, or has changed its state. */
export interface PlanChanged extends Header {
  type: "plan_changed";
  /** number of the plan */
  plan: number;
  /** what has become of it */
  state: Named<typeof PlanState>;
  /** why, an entry of the catalogue; 0 for nothing */
  code: Named<typeof VerdictCode>;
  /** how far the planning has come */
  stage: Named<typeof PlanStage>;
  /** of the time that planning may take, 0 to 1 */
  fraction: number;
  /** one sentence, empty for none */
  text: string;
}

/** 65042, pendant to server. Prepares the controller, or takes a single step of that, where its dialect has one. */
export interface Prepare extends Header {
  type: "prepare";
  /** chosen by the pendant */
  request_id: number;
  /** 1 prepare, 2 release; single steps: 3 alarms, 4 drives on, 5 drives off */
  action: Named<typeof PrepareAction>;
  /** of the verdict CONFIRM_FIRST, 0 at the first asking */
  token: number;
}

/** 65020, server to pendant. State of the cell, at the rate that the pendant chose. */
export interface State extends Header {
  type: "state";
  /** counts the cell's state messages; a listener may see gaps */
  sequence: number;
  /** the server's monotonic time, whole seconds [s] */
  time_s: number;
  /** the server's monotonic time, rest [ns] */
  time_ns: number;
  /** age of the controller's last report, -1 before the first [s] */
  age: number;
  /** state messages that this connection was too slow for */
  dropped: number;
  /** what the cell does; 6: about to be paused */
  activity: Named<typeof Activity>;
  /** request that is planned or moving, 0 for none */
  request_id: number;
  /** session that holds the motion authority, 0 for none */
  holder: number;
  /** latched stop: 0 none, 1 software, 2 protective */
  stop: Named<typeof StopKind>;
  /** the server's own mode */
  operating_mode: Named<typeof OperatingMode>;
  /** the authority's enabling device (training) */
  enabling: Named<typeof EnablingPosition>;
  /** speed override, 0 to 1 */
  override: number;
  /** cap of tool and elbow, 0 for none [m/s] */
  tool_speed_cap: number;
  /** part of the asked jog speed that is driven, 0 to 1 */
  jog_scale: number;
  /** why it is less than 1 */
  jog_reason: Named<typeof JogReason>;
  /** joint at fault, -1 for none */
  jog_joint: number;
  /** what the program is doing */
  program_state: Named<typeof ProgramState>;
  /** its current line, 0 for none */
  program_line: number;
  /** controller connection: 0 down, 1 up, 2 stale */
  link: Named<typeof LinkState>;
  /** the controller's own, -1 unknown */
  drives_powered: Named<typeof TriState>;
  /** the controller's own, -1 unknown */
  e_stopped: Named<typeof TriState>;
  /** the controller's own, 0 for none */
  error_code: number;
  /** the controller's own, -1 unknown */
  in_error: Named<typeof TriState>;
  /** the controller's own, -1 unknown */
  in_motion: Named<typeof TriState>;
  /** the controller's own: -1 unknown, 1 manual, 2 automatic */
  mode: Named<typeof ControllerMode>;
  /** the controller's own, -1 unknown */
  motion_possible: Named<typeof TriState>;
  /** bits: 2 positions, 4 velocities, 16 tool */
  valid_fields: number;
  /** speed of the tool [m/s] */
  tool_speed: number;
  /** joint positions [rad, m for a linear axis] */
  positions: number[];
  /** joint velocities [rad/s, m/s] */
  velocities: number[];
  /** x, y, z of the tool in base [m] */
  tool_position: number[];
  /** quaternion x, y, z, w of the tool in base */
  tool_orientation: number[];
}

/** 65021, server to pendant. The motion authority changed hands. */
export interface AuthorityChanged extends Header {
  type: "authority_changed";
  /** session that holds it now, 0 for nobody */
  holder: number;
  /** 1 granted, 2 released, 3 expired, 4 connection lost, 5 taken over, 6 logged out, 7 role lost */
  reason: Named<typeof AuthorityReason>;
  /** name of the new holder's pendant */
  client: string;
}

/** 65022, server to pendant. A stop was latched or reset. */
export interface StopChanged extends Header {
  type: "stop_changed";
  /** latched stop: 0 none, 1 software, 2 protective */
  stop: Named<typeof StopKind>;
  /** who did it, 0 for the server itself */
  session: number;
  /** name of that pendant */
  client: string;
  /** as given */
  reason: string;
}

/** 65023, server to pendant. Somebody asked for the authority that you hold. */
export interface AuthorityWanted extends Header {
  type: "authority_wanted";
  /** who asked */
  session: number;
  /** name of that pendant */
  client: string;
}

/** 65024, server to pendant. The mode of operation changed. */
export interface ModeChanged extends Header {
  type: "mode_changed";
  /** the mode now */
  mode: Named<typeof OperatingMode>;
  /** who did it, 0 for the controller */
  session: number;
  /** name of that pendant */
  client: string;
}

/** 65025, server to pendant. A press ended and the robot came to rest. */
export interface JogEnded extends Header {
  type: "jog_ended";
  /** number of the press */
  press: number;
  /** why it ended */
  reason: Named<typeof JogEnd>;
  /** from the end of the press to rest or a new press, as sent [s] */
  stop_time: number;
  /** farthest that a joint went in that time [rad, m] */
  joint_distance: number;
  /** way of the tool in that time [m] */
  tool_distance: number;
  /** where the joints stand [rad, m for a linear axis] */
  positions: number[];
}

/** 65026, server to pendant. A program came to another line, paused or ended. */
export interface ProgramReport extends Header {
  type: "program_report";
  /** what it is doing */
  state: Named<typeof ProgramState>;
  /** its current line, 0 for none */
  line: number;
  /** which run of it this is, from 1 */
  loop: number;
  /** revision of that program in this run */
  revision: number;
  /** name of the program */
  program: string;
  /** one sentence, empty for none */
  text: string;
}

/** 65043, server to pendant. What is known of the controller changed. */
export interface ControllerChanged extends Header {
  type: "controller_changed";
  /** 0 no, 1 yes, 2 not needed */
  prepared: Named<typeof Preparedness>;
  /** 0 unverified, 1 match, 2 mismatch */
  identity: Named<typeof ControllerIdentity>;
  /** 1 where it is known to be emulated */
  is_emulated: number;
  /** counts the changes of what controller.describe tells, from 1 */
  declaration: number;
}

/** 65055, server to pendant. A document of the cell, or what its signals are, changed; for whoever declared the wish. */
export interface DocumentChanged extends Header {
  type: "document_changed";
  /** what changed; 0: look at everything */
  kind: Named<typeof NoticeKind>;
  /** the one that is kept now, 0 where it was deleted */
  revision: number;
  /** connection that changed it, 0 for the server */
  session: number;
  /** 1 new, 2 changed, 3 renamed, 4 deleted */
  what: Named<typeof Change>;
  /** of the document */
  name: string;
  /** its former name where it was renamed */
  from_name: string;
  /** name of whoever changed it */
  client: string;
}

/** 65100, client to controller. TRAINING: what a person does at an emulated controller; a real one refuses it. Action 3 does nothing: a success says that the controller is emulated. The server asks that once at each connect, on the state connection only. */
export interface OperatorEvent extends Header {
  type: "operator_event";
  /** 1 emergency stop, 2 reset, 3 identify */
  action: Named<typeof OperatorAction>;
}

/** 65110, client to controller. Asks for sixteen digital inputs and outputs; on the motion or the state connection. */
export interface ReadSignals extends Header {
  type: "read_signals";
  /** number of the first signal: 0, 16, 32, … */
  first: number;
}

/** 65110, controller to client. Sixteen digital inputs and outputs, and how many of each there are. */
export interface ReadSignalsReply extends Header {
  type: "read_signals_reply";
  /** number of the first signal, as asked */
  first: number;
  /** bits: the inputs */
  inputs: number;
  /** bits: the outputs */
  outputs: number;
  /** inputs in all */
  input_count: number;
  /** outputs in all */
  output_count: number;
}

/** 65111, client to controller. Sets some of sixteen digital outputs; refused where there is no such output. */
export interface WriteOutputs extends Header {
  type: "write_outputs";
  /** number of the first signal: 0, 16, 32, … */
  first: number;
  /** bits: the outputs that are set */
  mask: number;
  /** bits: their values */
  values: number;
}

/** 65112, client to controller. TRAINING: sets inputs of an emulated controller, as its cabling would. */
export interface SetInputs extends Header {
  type: "set_inputs";
  /** number of the first signal: 0, 16, 32, … */
  first: number;
  /** bits: the inputs that are set */
  mask: number;
  /** bits: their values */
  values: number;
}

export type Message =
  | Ping
  | Hello
  | HelloReply
  | Declare
  | Forwarded
  | Lobby
  | LobbyReply
  | Management
  | Verdict
  | Outcome
  | Subscribe
  | Authority
  | AuthorityBeat
  | Login
  | SetAccount
  | Pairing
  | PairingReply
  | JointMove
  | PoseMove
  | JointPath
  | PosePath
  | SoftwareStop
  | ResetStop
  | Enabling
  | SetMode
  | SetSpeed
  | MotionControl
  | JogStart
  | JogBeat
  | JogRelease
  | JogStep
  | JogUndo
  | ProgramRun
  | Home
  | Execute
  | PlanChanged
  | Prepare
  | State
  | AuthorityChanged
  | StopChanged
  | AuthorityWanted
  | ModeChanged
  | JogEnded
  | ProgramReport
  | ControllerChanged
  | DocumentChanged
  | OperatorEvent
  | ReadSignals
  | ReadSignalsReply
  | WriteOutputs
  | SetInputs
  | Bare
  | Opaque;

export const LAYOUTS: Layouts = {
  ping: [1, "ignored", ""],
  hello: [65000, "request", "protocol_version:i state_rate:r cell:t32 client:t32"],
  hello_reply: [65000, "answer", "protocol_version:i session:i capabilities:i max_frame:i dof:i tick_rate:r max_state_rate:r authority_timeout:r cell:t32 robot:t32 server:t32"],
  declare: [65051, "request", "request_id:i enabling_deadline:r notices:i language:t8"],
  forwarded: [65050, "request", "gateway:t32 secret:t64 address:t64 is_encrypted:i"],
  lobby: [65052, "request", "request_id:i"],
  lobby_reply: [65052, "answer", "request_id:i body:b"],
  management: [65001, "request", "request_id:i body:b"],
  verdict: [65002, "reply", "request_id:i code:i joint:i value:r limit:r text:t160"],
  outcome: [65003, "topic", "request_id:i outcome:i code:i joint:i value:r limit:r plan_time:r motion_time:r text:t160"],
  subscribe: [65004, "request", "request_id:i state_rate:r"],
  authority: [65005, "request", "request_id:i action:i"],
  authority_beat: [65006, "topic", ""],
  login: [65007, "request", "request_id:i kind:i name:t32 secret:t128"],
  set_account: [65008, "request", "request_id:i role:i name:t32 secret:t128"],
  pairing: [65009, "request", "request_id:i action:i"],
  pairing_reply: [65009, "answer", "request_id:i lifetime:i code:t8"],
  joint_move: [65010, "request", "request_id:i speed:r joint_count:i joints:R10"],
  pose_move: [65011, "request", "request_id:i motion:i speed:r frame:t32 position:R3 orientation:R4"],
  joint_path: [65012, "request", "request_id:i speed:r joint_count:i", { name: "waypoints", of: "joints:R10", count: "before", least: 1, most: 1600 }],
  pose_path: [65013, "request", "request_id:i motion:i speed:r frame:t32", { name: "waypoints", of: "position:R3 orientation:R4", count: "before", least: 1, most: 1600 }],
  software_stop: [65014, "request", "request_id:i reason:t64"],
  reset_stop: [65015, "request", "request_id:i"],
  enabling: [65016, "topic", "position:i"],
  set_mode: [65017, "request", "request_id:i mode:i"],
  set_speed: [65018, "request", "request_id:i override:r tool_speed:r"],
  motion_control: [65019, "request", "request_id:i action:i"],
  jog_start: [65030, "request", "request_id:i press:i state_sequence:i deadline:r space:i frame:t32 value_count:i values:R10"],
  jog_beat: [65031, "topic", "press:i beat:i"],
  jog_release: [65032, "request", "request_id:i press:i"],
  jog_step: [65033, "request", "request_id:i speed:r space:i frame:t32 value_count:i values:R10"],
  jog_undo: [65034, "request", "request_id:i speed:r"],
  program_run: [65040, "request", "request_id:i run:i line:i loops:i revision:i speed:r program:t64"],
  home: [65041, "request", "request_id:i speed:r target:t32"],
  execute: [65053, "request", "request_id:i plan:i override_is_one:i"],
  plan_changed: [65054, "topic", "plan:i state:i code:i stage:i fraction:r text:t96"],
  prepare: [65042, "request", "request_id:i action:i token:i"],
  state: [65020, "topic", "sequence:i time_s:i time_ns:i age:r dropped:i activity:i request_id:i holder:i stop:i operating_mode:i enabling:i override:r tool_speed_cap:r jog_scale:r jog_reason:i jog_joint:i program_state:i program_line:i link:i drives_powered:i e_stopped:i error_code:i in_error:i in_motion:i mode:i motion_possible:i valid_fields:i tool_speed:r positions:R10 velocities:R10 tool_position:R3 tool_orientation:R4"],
  authority_changed: [65021, "topic", "holder:i reason:i client:t32"],
  stop_changed: [65022, "topic", "stop:i session:i client:t32 reason:t64"],
  authority_wanted: [65023, "topic", "session:i client:t32"],
  mode_changed: [65024, "topic", "mode:i session:i client:t32"],
  jog_ended: [65025, "topic", "press:i reason:i stop_time:r joint_distance:r tool_distance:r positions:R10"],
  program_report: [65026, "topic", "state:i line:i loop:i revision:i program:t64 text:t160"],
  controller_changed: [65043, "topic", "prepared:i identity:i is_emulated:i declaration:i"],
  document_changed: [65055, "topic", "kind:i revision:i session:i what:i name:t64 from_name:t64 client:t32"],
  operator_event: [65100, "request", "action:i"],
  read_signals: [65110, "request", "first:i"],
  read_signals_reply: [65110, "answer", "first:i inputs:i&65535 outputs:i&65535 input_count:i output_count:i"],
  write_outputs: [65111, "request", "first:i mask:i&65535 values:i&65535"],
  set_inputs: [65112, "request", "first:i mask:i&65535 values:i&65535"],
};

/** Packs a message; throws a RangeError that names the field whose value does not fit. */
export function encode(message: Message, littleEndian = true, realSize: RealSize = 4): ArrayBuffer {
  return encodeBy(LAYOUTS, message, littleEndian, realSize);
}

/** Unpacks a whole frame of either byte order; throws a RangeError for what is none. */
export function decode(view: DataView, realSize: RealSize = 4): Message {
  return decodeBy(LAYOUTS, view, realSize) as Message;
}

export type CodeText = readonly [cause: string, remedy: string];

/** Cause and remedy of every code by its number; codes.de.ts has them in German. */
export const codeTexts = {
  0: ["The request was taken.", "Nothing to do."],
  1: ["The connection sent a request before its hello.", "Send hello as the first message."],
  2: ["The pendant speaks another version of the protocol.", "Use a pendant and a server of the same protocol version."],
  3: ["No cell of this name is served here, or several are and none was named.", "Name one of the served cells; an empty name will do only where there is one."],
  4: ["Only the holder of the motion authority may do this.", "Request the authority first."],
  5: ["Another connection holds the motion authority.", "Wait until its holder releases it, or it expires."],
  6: ["This address may not move the robot.", "Add the address to the cell's configuration."],
  7: ["The controller does not stand in automatic.", "Turn the controller's own mode selector."],
  8: ["The motion authority ended while the robot moved; it was stopped.", "Request the authority again; nothing resumes by itself."],
  9: ["The server has as many connections as it may have, or too many that did not log in.", "Wait as many seconds as the value says, then connect again."],
  10: ["In a manual mode nobody is taken over from, because the holder may be at the robot.", "Ask the holder to release it; anybody may stop the robot meanwhile."],
  20: ["The software stop is latched.", "The holder of the authority resets it; that moves nothing."],
  21: ["An earlier motion request is being planned.", "Wait for its outcome, or stop it."],
  22: ["The robot moves.", "Wait for the outcome, or stop it."],
  23: ["There is no connection to the robot controller.", "Check that the controller runs and its address is right."],
  24: ["The controller's last position report is too old to start from.", "Check the state connection and its rate."],
  25: ["The controller says that motion is not possible.", "Read its status: emergency stop, drives, error; clear it at the controller."],
  26: ["The robot does not stand where the motion was planned to start.", "Ask for the motion again."],
  27: ["A software stop ended the motion.", "Reset the stop; ask for the motion again."],
  28: ["The server is going down.", "Start it again."],
  29: ["The mode of operation does not allow this kind of motion.", "Set another mode: jog in manual, run in automatic, recovery only leads back inside."],
  30: ["The enabling device (training) is not held in its middle position.", "Let it go, then hold it half pressed and try again."],
  31: ["The enabling device (training) was let go or pressed through; the robot was stopped.", "Let it go, hold it half pressed and ask for the motion again."],
  32: ["The mode of operation was changed; a change stops the robot.", "Hold the enabling device anew and ask again."],
  33: ["The mode belongs to the controller's own selector and is only shown here.", "Turn the selector at the controller."],
  34: ["The press has ended, or its number was used before; a press that ended never moves again.", "Let go and press anew, with a higher number than any before on this connection."],
  35: ["The press does not quote a state message of the last half second.", "Subscribe to the state and quote the sequence of the newest message."],
  36: ["The server stopped the robot by itself, for the reason that is shown.", "Remove the reason, then reset the stop."],
  37: ["A motion is paused on its path.", "Resume it or end it with a program stop."],
  38: ["No motion or program that could be paused, resumed or ended is there.", "Look at the state."],
  39: ["A program stop ended the motion.", "Start the motion or the program again."],
  40: ["A stop that the same connection sent behind this request was faster, and acts first.", "Ask again, if it is still wanted, once the stop was answered and is reset."],
  41: ["The body does not have the layout of its message type.", "See the protocol reference."],
  42: ["A value is outside what it may be.", "Send a value within what the text says is accepted."],
  43: ["A value is not a number, or infinite.", "Send finite numbers only."],
  44: ["A joint slot that the robot does not have is not zero.", "Send the robot's joints, base to tip, and zeros behind them."],
  45: ["A joint would leave its range.", "Move the target back inside the joint's limits."],
  46: ["A joint would exceed its largest speed.", "Allow the motion more time."],
  47: ["A joint would exceed its largest acceleration.", "Allow the motion more time."],
  48: ["No joint position inside the limits puts the tool there.", "Move the target closer or turn the tool."],
  49: ["The straight line would need a jump to another arm configuration.", "Use a joint motion, or start in the other configuration."],
  50: ["No timing of this path keeps to the limits.", "Smooth or thin the path."],
  51: ["The robot is there already.", "Nothing to do."],
  52: ["No frame of this name exists.", "Use base or root, or define the frame."],
  53: ["The independent check of the planned motion failed.", "Report it: the planner made a motion that the checker refused."],
  54: ["The planning process ended before it answered.", "Ask again; report it if it happens twice."],
  55: ["A trajectory point came out of order; the trajectory was discarded.", "Send the points in order, from sequence 0."],
  56: ["The trajectory has more points than the server takes.", "Split or thin the trajectory."],
  57: ["A trajectory did not come to its end: it announced one that never came, or its link was lost.", "Send it again, whole; look for what broke the client off."],
  58: ["The robot could not begin a trajectory soon enough after its last point; it was dropped.", "Send it again once the robot stands; where it stood, take load off the machine."],
  60: ["The controller answered a point with failure; the motion was stopped.", "Read the controller's status and error code; where points came late, take load off the network and the machine."],
  61: ["The controller did not answer a point in time; the motion was stopped.", "Check the controller and the network."],
  62: ["The connection to the controller was lost during the motion.", "The robot does not resume; ask for the motion again once the link is back."],
  63: ["The controller's answer does not belong to what it was sent.", "Check the dialect, and that nobody else talks to the controller."],
  64: ["The controller stopped the robot itself.", "Read the controller's status and error code; clear it there."],
  65: ["All points were sent, but the robot did not come to rest at the goal.", "Check the controller; compare its report with the goal."],
  66: ["The robot does not follow the points that it is sent; the motion was stopped.", "Check the controller's program, its mode and its own speed override."],
  67: ["This controller takes no jog that lasts as long as a key is held.", "Jog by increments; controller.describe says what the controller takes."],
  68: ["This controller cannot pause a motion on its path.", "Stop it, or let it end; the text says what would happen instead."],
  69: ["To prepare this controller does what the text says, to a real robot.", "Ask again within ten seconds with the token in the value, if that is wanted."],
  70: ["The controller has to be prepared before it moves the robot.", "Send prepare, or do at the controller what the text says."],
  72: ["The robot was reported farther from its path than accepted; it was stopped.", "Look whether something pushed, held or released it, then reset the stop. If it moves well and is only slow to follow, declare that: [controller] path_tolerance, lag and noise."],
  73: ["The robot was reported faster than a joint, or tool and elbow in this mode, may be.", "Look whether the controller keeps to the times of the points and the robot file has its limits, and whether [controller] state_period and noise are its own; reset the stop."],
  74: ["The robot was reported beyond the range of a joint while it moved; it was stopped.", "Look whether robot file and controller have the same ranges and zeros, then reset the stop and lead the joint back in the recovery mode, or by the controller's own pendant."],
  80: ["The tree of frames does not allow this change.", "Choose another name or parent, or remove what depends on the frame first."],
  81: ["The frame's past does not reach back so far.", "Ask for a later time, or configure a longer history."],
  82: ["The taught points or poses lie too badly to compute anything from.", "Teach them further apart, with larger turns between them."],
  83: ["A file of frames, of a scene or of a mesh cannot be used.", "Read the text: it names the file, the place and what would be accepted."],
  84: ["A leg of the platform would leave its stroke or its cone, or the pose its workspace.", "Move the target towards home."],
  85: ["No pose of the platform has these leg lengths.", "Check the lengths and their order."],
  86: ["This needs a library, or a planner, that is not installed.", "Install the extra that the text names, or choose another planner."],
  87: ["The scene has no object of this name.", "Use a name that the text lists."],
  88: ["The scene has an object of this name already.", "Choose another name."],
  89: ["The robot touches something where it stands.", "Move it apart, correct the scene, or allow the pair if they may touch."],
  90: ["The robot would touch something at the goal.", "Choose another goal, correct the scene, or allow the pair if they may touch."],
  91: ["The robot would touch something on the way.", "Go round it, or have the path planned."],
  92: ["The planner found no way round the obstacles in its time.", "Allow more time, choose another planner, or make room."],
  93: ["No circle goes through these points.", "Teach points that differ and lie on no line."],
  94: ["The zone at a corner does not fit its legs.", "Use the largest zone that the text names."],
  100: ["Somebody else changed the document since it was read; nothing was saved, lost or moved.", "Load the revision that the text names; make the change there, or check and run that one."],
  101: ["The store has no such document, or no longer that revision of it.", "List the documents and their history; choose one of them."],
  102: ["The disk has no room for the document; what was saved before is untouched.", "Make room on the disk, then save again."],
  103: ["The store's file or folder may not be written.", "Correct the permissions or the mount, then start the server again."],
  104: ["The store's file cannot be read or written.", "Read the system's words in the text; run the check of the store."],
  105: ["The disk does not keep up, another program holds the store, or the change before is not in force and saved yet.", "Save again later."],
  106: ["A document cannot have this name.", "Use printable characters without / and \\, at most 64 bytes of UTF-8 for a new one."],
  107: ["The document, chunk or file is larger than what is taken.", "Split it, or thin it."],
  108: ["The text is no document, or the file is no export of a store.", "Read the text: it names the line, the place and what would be accepted."],
  109: ["A chunk of a recording is not the next one.", "Go on with the chunk that the text names."],
  110: ["The text of a program does not follow the grammar.", "Read the text: it names line and column, and what would be accepted there."],
  111: ["A program, or a part of it, is larger than the server takes.", "Split it into programs that call each other."],
  112: ["A statement, a point or the order of a program's blocks cannot be as given.", "Read the text: it names the place and what would be accepted."],
  113: ["The program was taught on another robot.", "Load it in the cell of that robot, or teach its points anew."],
  114: ["There is no program of this name.", "Use a name that the text lists."],
  115: ["The program has no point of this name.", "Record the point first, or correct the name."],
  116: ["The point is used by statements, so it cannot be deleted.", "Delete or change the statements that the text names first."],
  117: ["The program has a point of this name already.", "Choose another name, or touch the point up."],
  118: ["The joints of a point do not put the tool at its pose.", "Touch the point up, or correct its frame or tool."],
  119: ["Programs call each other too deep, or in a circle.", "Use a loop instead of a program that calls itself."],
  120: ["The input did not take the value in time.", "Check what drives the input, or allow more time."],
  121: ["No program is in a state for this.", "Start the program, or pause it first, as the text says."],
  122: ["A program is under way; one that is paused still is.", "End it with a program stop; to step it or to run it on, a pause is enough."],
  123: ["The program goes round without moving or waiting.", "Put a motion, a wait or an input into the loop."],
  124: ["There is no edit to undo or to redo.", "Nothing to do."],
  125: ["The program cannot step back from here.", "Do what the text says is accepted, or start from the wanted statement instead."],
  126: ["A condition asks for a flag that no input was read into.", "Read an input into the flag before the condition."],
  127: ["Several moves that zones join are left, and no single step ends between them.", "Resume; or end the run with a program stop, and step from the line that is wanted."],
  130: ["This needs a role, and the connection has not logged in.", "Log in, or pair with the code that the teacher shows."],
  131: ["Name or password is wrong, or the account is disabled.", "Type both again; an admin can set another password."],
  132: ["Too many attempts at this account, or at pairing, from this address failed.", "Wait as long as the text says; other accounts and stopping work meanwhile."],
  133: ["Too many logins wait to be checked, or this connection's last one does.", "Try again in a few seconds."],
  134: ["The role that was granted does not include this.", "Log in with an account of the role that the text names."],
  135: ["This is no pairing code of this cell, or no longer.", "Type the code that the teacher shows now."],
  136: ["Somebody or something else is called so already.", "Choose another name."],
  137: ["The new password is too easy to guess, too short or too long.", "Use 8 to 128 characters; several words are easy to remember."],
  138: ["Nobody can be called so.", "Use up to 32 bytes of letters and digits, with . _ - or single spaces between."],
  139: ["There is an account of this name; capitals do not tell names apart.", "Choose another name, or change the account that exists."],
  140: ["There is no account of this name.", "Use a name that the list of users shows."],
  141: ["Nobody could manage the accounts that remain.", "Make somebody else admin first, or remove the other accounts."],
  142: ["The request came twice, or behind one that was sent after it.", "Count request ids up on each connection; send anew what is still wanted."],
  143: ["The account, or the guests of one address, have a quarter of all connections already.", "Close some of them; an admin sees all by access.connections, and closes one."],
  144: ["An admin has barred the address, so that nobody of it may do more than stop.", "Wait as many seconds as the value says, connect from elsewhere, or ask an admin."],
  145: ["The address is this machine's, your own, or one from which an admin is logged in, or too many are barred.", "Close single connections by access.close, disable the account that misbehaves, or unbar another address."],
  146: ["There is no jog whose way could be taken back.", "An undo works once after each jog, before anything else moves the robot; ended half-way, it goes on. From elsewhere, jog or move."],
  147: ["There is no connection of this number, or no longer.", "Ask for access.connections, and use a number that it shows."],
  148: ["A joint stands outside its limits, so only motion back inside is allowed.", "Jog the joint back inside; where the mode is set here, in the recovery mode."],
  149: ["The server was late: its watchdog stopped the robot, or the robot ran out of points.", "Read in the server's log what held it, take load off the machine, reset the stop where one is latched, and move again."],
  150: ["A fault of the server itself stopped this cell; the others go on.", "Start the server again and report what its log says."],
  151: ["The speed override is 0, at which nothing moves.", "Raise the speed override, then ask for the motion again, or resume what is paused."],
  160: ["The program names an input or an output that the cell does not have.", "Use a signal of the cell, or take the statement out."],
  161: ["This server keeps no documents.", "Name a file with --store, or in the cell file."],
  170: ["A recording is under way already.", "Stop it first; the text names it."],
  171: ["No recording is under way.", "Start one first."],
  172: ["The recording was made with another robot, or does not say with which.", "Play it on the robot that the text names, or import it with --robot."],
  173: ["The recording has a gap in which nobody knows where the robot was.", "Play the part before or after it, or record again; the text says where the gap is."],
  174: ["The disk did not take the samples fast enough, so the recording was ended.", "What was kept can be played; find out what slows the disk."],
  175: ["Frames, tools and what may touch what are not changed while a motion is under way, and no motion begins while frames or tools are being saved or read, or a changed scene is being put in force; while objects are being added, no jog begins.", "Wait until the robot stands, or stop it; what is being saved or put in force is so soon: ask again."],
  177: ["The controller does not offer its inputs and outputs to us, or did not answer.", "Ask again once it is connected; a controller of another maker may offer none."],
  178: ["A cell has one robot, the one of its controller.", "Start a cell for the other robot: openpendant serve with an emulator, and connect there."],
  180: ["There is no plan of this number.", "Make one with plans.make; plans.show lists them."],
  181: ["The plan is no longer what would be driven; the text names what changed.", "Plan anew."],
  182: ["As many plans are being made or kept as there may be.", "Wait for the one that is being made, or forget one with plans.drop."],
  183: ["The plan takes longer than a plan may.", "Split it, or ask for a higher speed."],
  184: ["More questions came than are answered in this time.", "Wait as many seconds as the value says."],
  185: ["A newer question of the same connection took the place of this one.", "Nothing to do."],
  186: ["A gateway's connection did not say first for whom it speaks.", "Update the gateway, or connect from another address than the gateway's."],
  187: ["Name, address or secret of the gateway is not the configured one.", "Compare [[gateways]] of the server's configuration with the gateway's own."],
  190: ["The tool is not at the object: the value is the distance, the limit the tool's reach.", "Move closer, or correct the object's place or the tool's grasp point."],
  191: ["Nothing holds the object that was to be let go, or something holds it already.", "Look at the scene: it says what holds each object."],
  195: ["There is no position of this name; the text says the nearest one.", "Ask for positions.list, or save the position first."],
  196: ["There is no mesh with this hash.", "Ask for shapes.meshes, and use a hash that it tells."],
} as const satisfies Record<number, CodeText>;

/** The texts of all codes in one language; without one a file does not compile. */
export type CodeTexts = Readonly<Record<keyof typeof codeTexts, CodeText>>;
