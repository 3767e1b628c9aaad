// Generated from the declarations in simplemsg/ by `make reference`; do not edit.
//
// The management operations of the pendant protocol: types alone, of which a bundle holds nothing.
// A request or reply is the JSON body of a Management message.

export type JointDescription = {
  /** Its name. */ name: string;
  /** Rad, or m for a linear axis. */ unit: "rad" | "m";
  /** Lower limit [rad or m]. */ lower: number;
  /** Upper limit [rad or m]. */ upper: number;
  /** Greatest speed [rad/s or m/s]. */ velocity: number;
  /** Greatest acceleration [rad/s² or m/s²]. */ acceleration: number;
  /** What people call it, as on a pendant's keys. */ display_name?: string;
};
export type SpeedDescription = {
  /** Fraction of the planned speed. */ override: number;
  /** Cap of tool and elbow [m/s]; null where the mode sets none. */ tool_speed_cap: number | null;
};
export type SignalsDescription = {
  /** Whether the controller offers any to the server. */ offered: boolean;
  /** Values, from input 0. */ inputs: boolean[];
  /** Values, from output 0. */ outputs: boolean[];
};
export type RecordingDescription = {
  /** Its name. */ name: string;
  /** So far [s]. */ duration: number;
  /** So far. */ samples: number;
};
export type ProgramDescription = {
  /** Its name. */ name: string;
  /** Running, waiting or paused. */ state: string;
  /** Its line in the text, from 1. */ line: number;
  /** The one that runs; another may be kept by now. */ revision: number;
};
export type OwnerDescription = {
  /** Number of the connection. */ session: number;
  /** Name of the pendant. */ client: string;
};
export type StopDescription = {
  /** Number of the connection that asked for it. */ session: number;
  /** Name of its pendant. */ client: string;
  /** In the words of whoever stopped. */ reason: string;
};
export type ServedCell = {
  /** its name, for `connect`. */ cell: string;
  /** name of its robot. */ robot: string;
  /** manufacturer and model of the robot. */ display?: string;
  /** whether its controller is known to be emulated. */ emulated?: boolean;
  /** whether whoever comes from this address has to log in to move it. */ login_needed?: boolean;
  /** name of who has the motion authority; empty where nobody has it. */ holder?: string;
  /** whether the robot moves, as far as anyone knows. */ moving?: boolean;
  /** how many pendants it has. */ connections?: number;
};
export type Wish = "move" | "jog" | "program";
export type ConditionReport = {
  /** Its name. */ condition: string;
  /** What has to hold. */ meaning: string;
  /** Whether it does. */ holds: boolean;
  /** Entry of the catalogue. */ code?: number;
  /** Of that entry. */ name?: string;
  /** One sentence with the numbers. */ text?: string;
  /** What happened. */ cause?: string;
  /** What to do about it. */ remedy?: string;
};
export type EndReport = {
  /** Entry of the catalogue. */ code: number;
  /** Of that entry. */ name: string;
  /** One sentence with the numbers. */ text: string;
  /** What happened. */ cause: string;
  /** What to do about it. */ remedy: string;
};
export type WayReport = {
  /** The name, as `Upper-Arm towards -`, `tool Z+ in base`, or `Upper-Arm towards + and Wrist-Pitch towards -`. */ press: string;
  /** 1 joints, 2 tool. */ space: number;
  /** Of a tool key; empty for joints. */ frame: string;
  /** Parts of the jog speed, one per joint, or along and about the frame's axes. */ values: number[];
};
export type HoldReport = {
  /** `joint-limit`, `singularity` or `collision`. */ reason: string;
  /** What it is, with its numbers. */ text: string;
  /** What leads out, the best first; empty where nothing is known. */ ways: WayReport[];
};
export type ProgramHeading = {
  /** name of the program. */ name: string;
  /** counts its changes, from 1; goes on after a deletion. */ revision: number;
  /** size of what is kept [bytes]. */ size: number;
  /** who saved it. */ saved_by: string;
  /** wall-clock time in UTC, ISO 8601; for display only. */ saved_at: string;
  /** whether this revision is its deletion. */ deleted: boolean;
};
export type PointPose = {
  /** x, y, z in the frame [m]. */ position: [number, number, number];
  /** x, y, z, w. */ quaternion: [number, number, number, number];
  /** the frame's name. */ frame: string;
  /** the tool's name. */ tool: string;
};
export type ArmConfiguration = {
  /** where the wrist is, seen from axis 1. */ shoulder: "front" | "back";
  /** where the elbow is, seen from the line between shoulder and wrist. */ elbow: "up" | "down";
  /** the sign of the wrist's middle joint. */ wrist: "no-flip" | "flip";
  /** full turns of each joint; None where they are not said. */ turns?: number[] | null;
};
export type TeachPoint = {
  /** unique in its program. */ name: string;
  /** controller side [rad, m for a linear axis]. */ joints: number[];
  /** where that put the tool; None where nobody measured it. */ pose?: PointPose | null;
  /** which of the ways to reach the pose; None where the robot has no such words. */ configuration?: ArmConfiguration | null;
  /** lines of text; empty for none. */ comment?: string;
};
export type Way = "PTP" | "LIN" | "CIRC" | "SPLINE";
export type SpeedKind = "fraction" | "tool";
export type Speed = {
  /** `fraction` of the joints' greatest speeds, or the speed of the `tool`. */ kind: SpeedKind;
  /** more than 0 and at most 1, or the speed [m/s]. */ value: number;
};
export type Move = {
  /** how. */ way: Way;
  /** name of the point to go to. */ point: string;
  /** the points in between: one for CIRC, any number for SPLINE, none for the others. */ via?: string[];
  /** how fast; PTP takes a fraction only. Left out for full speed. */ speed?: Speed;
  /** where to turn towards the next point, 0 for a stop there [m; rad for PTP]. */ zone?: number;
  /** how long to stand there [s]; not together with a zone. */ dwell?: number;
  /** one line behind it. */ comment?: string;
  statement: "move";
};
export type RecordPoint = {
  /** the new point. */ point: TeachPoint;
  /** a move that names it; None for the point alone. */ move?: Move | null;
  /** the statement that the move is put before; None to append it. */ at?: number | null;
  edit: "record-point";
};
export type TouchUp = {
  /** name of the point. */ name: string;
  /** controller side [rad, m for a linear axis]. */ joints: number[];
  /** where that puts the tool; None where nobody measured it. */ pose?: PointPose | null;
  /** which of the ways to reach the pose. */ configuration?: ArmConfiguration | null;
  edit: "touch-up";
};
export type DeletePoint = {
  /** name of the point. */ name: string;
  edit: "delete-point";
};
export type RenamePoint = {
  /** name of the point. */ name: string;
  /** the name that it has afterwards. */ new_name: string;
  edit: "rename-point";
};
export type CommentPoint = {
  /** name of the point. */ name: string;
  /** lines of text. */ comment: string;
  edit: "comment-point";
};
export type ReorderPoint = {
  /** name of the point. */ name: string;
  /** its number afterwards. */ to: number;
  edit: "reorder-point";
};
export type Wait = {
  /** how long [s]. */ duration: number;
  /** one line behind it. */ comment?: string;
  statement: "wait";
};
export type WaitInput = {
  /** number of the input. */ signal: number;
  /** the value. */ value: boolean;
  /** how long to wait at most [s]; None for ever. */ timeout?: number | null;
  /** one line behind it. */ comment?: string;
  statement: "wait-input";
};
export type SetOutput = {
  /** number of the output. */ signal: number;
  /** the value. */ value: boolean;
  /** one line behind it. */ comment?: string;
  statement: "set-output";
};
export type ReadInput = {
  /** number of the input. */ signal: number;
  /** name of the flag. */ flag: string;
  /** one line behind it. */ comment?: string;
  statement: "read-input";
};
export type Attach = {
  /** name of the object. */ scene_object: string;
  /** one line behind it. */ comment?: string;
  statement: "attach";
};
export type Detach = {
  /** name of the object. */ scene_object: string;
  /** one line behind it. */ comment?: string;
  statement: "detach";
};
export type Loop = {
  /** how often; None for ever. */ passes?: number | null;
  /** one line behind it. */ comment?: string;
  statement: "loop";
};
export type IfInput = {
  /** number of the input. */ signal: number;
  /** the value. */ value: boolean;
  /** one line behind it. */ comment?: string;
  statement: "if-input";
};
export type IfFlag = {
  /** name of the flag. */ flag: string;
  /** the value. */ value: boolean;
  /** one line behind it. */ comment?: string;
  statement: "if-flag";
};
export type Else = {
  /** one line behind it. */ comment?: string;
  statement: "else";
};
export type End = {
  /** one line behind it. */ comment?: string;
  statement: "end";
};
export type Call = {
  /** its name. */ program: string;
  /** one line behind it. */ comment?: string;
  statement: "call";
};
export type Comment = {
  /** the line. */ comment?: string;
  statement: "comment";
};
export type InsertStatements = {
  /** what to put there. */ statements: (Move | Wait | WaitInput | SetOutput | ReadInput | Attach | Detach | Loop | IfInput | IfFlag | Else | End | Call | Comment)[];
  /** the statement that they are put before. */ at?: number | null;
  edit: "insert";
};
export type DeleteStatements = {
  /** number of the first of them. */ first: number;
  /** how many. */ count?: number;
  edit: "delete";
};
export type ReorderStatements = {
  /** number of the first of them. */ first: number;
  /** how many. */ count: number;
  /** the number that the first has afterwards. */ to: number;
  edit: "reorder";
};
export type ReplaceStatement = {
  /** number of the statement. */ at: number;
  /** what stands there afterwards. */ statement: Move | Wait | WaitInput | SetOutput | ReadInput | Attach | Detach | Loop | IfInput | IfFlag | Else | End | Call | Comment;
  edit: "replace";
};
export type CommentStatement = {
  /** number of the statement. */ at: number;
  /** one line. */ comment: string;
  edit: "comment";
};
export type DescribeProgram = {
  /** None; a program is renamed by `programs.rename`. */ name?: string | null;
  /** the tool that new points are taught with; None as it is. */ tool?: string | null;
  /** the frame that they are taught in; None as it is. */ frame?: string | null;
  /** about the program; None as it is. */ comment?: string | null;
  edit: "describe";
};
export type MoveVerdict = {
  /** the program that it is in. */ program: string;
  /** its line in the text, from 1. */ line: number;
  /** the point that it goes to. */ point: string;
  /** whether its zone joins it with the next move, without a stop. */ zone_used: boolean;
  /** whether it can be done. */ reachable: boolean;
  /** why not; entry of the catalogue. */ code?: number;
  /** the same, as a sentence with its numbers. */ text?: string;
};
export type HandOverVerdict = {
  /** the program that it is in. */ program: string;
  /** its line in the text, from 1. */ line: number;
  /** `attach` or `detach`. */ does: string;
  /** the object of the scene. */ object: string;
  /** whether it can be done. */ reachable: boolean;
  /** why not; entry of the catalogue. */ code?: number;
  /** the same, as a sentence with its numbers. */ text?: string;
};
export type StatementVerdict = {
  /** the program that it is in. */ program: string;
  /** its line in the text, from 1. */ line: number;
  /** such as `wait-input`, `set-output`, `if-flag` or `loop`. */ does: string;
  /** whether a run goes on there. */ reachable: boolean;
  /** why not; entry of the catalogue. */ code?: number;
  /** the same, as a sentence with its numbers. */ text?: string;
};
export type NotWalked = {
  /** the program that it is in. */ program: string;
  /** its line in the text, from 1. */ line: number;
};
export type PointVerdict = {
  /** name of the point. */ point: string;
  /** whether the robot can stand there. */ reachable: boolean;
  /** why not; entry of the catalogue. */ code?: number;
  /** the same, as a sentence with its numbers. */ text?: string;
};
export type PlacedPose = {
  /** x, y, z [m]. */ position: [number, number, number];
  /** quaternion x, y, z, w; left out for no rotation. */ orientation?: [number, number, number, number];
};
export type PtpAim = {
  kind: "ptp";
  joints?: number[] | null;
  pose?: PlacedPose | null;
  frame?: string;
  branch?: number | null;
};
export type LinAim = {
  kind: "lin";
  pose: PlacedPose;
  frame?: string;
};
export type PathAim = {
  kind: "path";
  waypoints: (number[] | PlacedPose)[];
  frame?: string;
  way?: "ptp" | "lin";
};
export type FreeAim = {
  kind: "free";
  joints?: number[] | null;
  pose?: PlacedPose | null;
  frame?: string;
  planner?: string;
  seed?: number;
  time_limit?: number;
  margin?: number;
};
export type PositionAim = {
  kind: "position";
  name: string;
};
export type FoundPose = {
  /** x, y, z [m]. */ position: number[];
  /** quaternion x, y, z, w. */ orientation: number[];
};
export type BasedOn = {
  /** revision of the scene. */ scene: number;
  /** revision of the tools. */ tools: number;
  /** revision of the user frames. */ frames: number;
  /** the selected tool; None for the bare flange. */ tool: string | null;
  /** objects that the robot carries. */ attached: string[];
};
export type Worst = {
  /** name of the joint, or of the point of the arm. */ joint: string;
  /** what is limited. */ quantity: string;
  /** to its limit, 1 being on the limit. */ ratio: number;
  /** when [s]. */ at: number;
};
export type PlanCertificate = {
  /** always true: what fails is refused. */ valid: boolean;
  /** least distance of a joint from the end of its range [rad or m]. */ margin: number;
  /** the greatest value of each quantity. */ worst: Worst[];
};
export type PlanClearance = {
  /** how near [m]. */ distance: number;
  /** one of them. */ first: string;
  /** the other. */ second: string;
  /** when [s]. */ at: number;
};
export type Unexecutable = {
  /** the condition of `why` that is broken; `plan` for one of the plan's own. */ condition: string;
  /** entry of the catalogue. */ code: number;
  /** one sentence with the numbers. */ text: string;
};
export type PlanHead = {
  /** its number. */ plan: number;
  /** planning, ready, running, done, stale, expired or dropped. */ state: string;
  /** of its goal; `program` for the preview of one. */ kind: string;
  /** what its maker calls it. */ label: string;
  /** who had it made. */ maker: string;
  /** of the motion [s]; 0 while it is planned. */ duration: number;
  /** how many; 0 while it is planned. */ samples: number;
  /** how long it is kept [s]; 0 where it is no longer ready. */ expires_in: number;
  /** why its state is what it is; 0 for nothing. */ code: number;
  /** the same in words. */ text: string;
};
export type RecordingHeading = {
  /** name of the recording. */ name: string;
  /** of its description: rename or delete it from this one. */ revision: number;
  /** who made it. */ saved_by: string;
  /** why it ended by itself, or what is wrong with it; empty where all is well. */ problem: string;
  /** name of the robot. */ robot?: string;
  /** it was stopped, not cut off. */ finished?: boolean;
  /** how many. */ samples?: number;
  /** from the first to the last sample [s]. */ duration?: number;
  /** samples a second, gaps left out [Hz]. */ rate?: number;
};
export type RecordingProgress = {
  /** its name. */ name: string;
  /** from the first to the last sample [s]. */ duration: number;
  /** so far. */ samples: number;
  /** samples that are on the disk. */ kept: number;
  /** between samples, so far. */ gaps: number;
};
export type NamedPosition = {
  /** what HOME takes in `target`. */ name: string;
  /** `robot` of the robot's file, which nobody changes here; `user` of this cell. */ kind: "robot" | "user";
  /** one value per driven joint [rad or m]. */ joints: number[];
  /** there, of the tool in base. */ pose: FoundPose;
  /** greatest over least singular value of the Jacobian, lengths in arm's sizes; None at a singularity. */ condition: number | null;
  /** whether the robot may stand there: inside its limits, and nothing touches. */ legal: boolean;
  /** what forbids it, in words; empty where it may. */ why: string;
};
export type ToolGrasp = {
  /** the grasp point in the tool's frame [m]; left out for its origin. */ point?: [number, number, number];
  /** how far from the point the body of an object may be, 0 to 0.05 [m]; left out for 0.010. */ reach?: number;
  /** number of the input of an emulated controller that says that the tool has a part: 1 after a grasp, 0 after one that missed and after letting go; left out for none. */ part?: number | null;
};
export type JointTable = {
  /** of the joints. */ names: string[];
  /** as people call them. */ display_names: string[];
  /** lower limits [rad, m for a linear axis]. */ lower: number[];
  /** upper limits [rad, m for a linear axis]. */ upper: number[];
  /** greatest speeds [rad/s or m/s]. */ velocity: number[];
  /** greatest accelerations [rad/s² or m/s²]. */ acceleration: number[];
};
export type ReplyDeadlines = {
  /** until a point is answered [s]. */ point: number;
  /** until a STOP is answered [s]. */ stop: number;
  /** until the robot moves after its first point [s]. */ motion: number;
};
export type ArmPosture = {
  /** `front` or `back`. */ shoulder: string;
  /** `up` or `down`. */ elbow: string;
  /** `no-flip` or `flip`. */ wrist: string;
  /** revolutions of each joint, 0 from -π up to π. */ turns: number[];
};
export type JointOutside = {
  /** its number, from 0. */ joint: number;
  /** what was given [rad, m for a linear axis]. */ value: number;
  /** lower limit [rad, m for a linear axis]. */ lower: number;
  /** upper limit [rad, m for a linear axis]. */ upper: number;
};
export type LinkPose = {
  /** its name. */ link: string;
  /** x, y, z [m]. */ position: number[];
  /** quaternion x, y, z, w. */ orientation: number[];
};
export type NearestSingularity = {
  /** `wrist`, `elbow`, `shoulder` or `unnamed`. */ kind: string;
  /** from it, in `unit`. */ distance: number;
  /** `rad` or `m`; empty for an unnamed one, whose distance is the least singular value. */ unit: string;
  /** numbers of the joints that, moved together there, leave the tool still. */ joints: number[];
};
export type NearestLimit = {
  /** its number, from 0. */ joint: number;
  /** how far it may go there [rad, m for a linear axis]. */ margin: number;
};
export type InverseSolution = {
  /** number of its configuration, from 1, which a motion takes by itself: the nearest, where a slow joint weighs more. Turns of one share it. It names the same one while joints, tool and frame stay. */ branch: number;
  /** inside the limits [rad, m for a linear axis]. */ joints: number[];
  /** how the arm stands; None where it has no flags. */ configuration: ArmPosture | null;
  /** greatest change of a joint from the seed [rad, m for a linear axis]. */ distance: number;
  /** distance from the pose, by forward kinematics [m]. */ position_error: number;
  /** angle from it [rad]. */ rotation_error: number;
  /** the joint that is nearest to an end of its range. */ nearest_limit: NearestLimit;
  /** names of two bodies that touch; None for none, and where it was not asked for. */ touches: string[] | null;
};
export type DrawnShape = {
  /** the link that it moves with. */ link: string;
  /** `box`, `cylinder`, `capsule` or `sphere`; round ones have their axis along z. */ form: string;
  /** `body`, `joint`, `foot` or `flange`. */ part: string;
  /** extents along its own x, y, z [m]; a capsule's length includes its caps. */ size: number[];
  /** its centre in the link's frame [m]. */ xyz: number[];
  /** its orientation in the link's frame. */ quat: number[];
  /** `#rrggbb`. */ colour: string;
};
export type DrawnStrut = {
  /** of the leg. */ name: string;
  /** the link at its one end. */ first_link: string;
  /** that end in the link's frame [m]. */ first: number[];
  /** the link at its other end. */ second_link: string;
  /** that end in that link's frame [m]. */ second: number[];
  /** its diameter [m]. */ diameter: number;
  /** `#rrggbb`. */ colour: string;
};
export type DrawnLink = {
  /** its name. */ link: string;
  /** the joint above it; None for the root. */ joint: string | null;
  /** hash of a mesh that shows it, see shapes.meshes; None where it has none. */ mesh: string | null;
};
export type JointCoupling = {
  /** its name. */ joint: string;
  /** movement of the other joint per movement of this one. */ gain: number;
};
export type DrawnJoint = {
  /** as in the robot file. */ name: string;
  /** what people call it. */ display_name: string;
  /** `revolute`, `prismatic` or `fixed`; of a platform `floating`, which is at home where its place says, and `leg`. */ type: string;
  /** the link that carries it. */ parent: string;
  /** the link that it carries. */ child: string;
  /** its place in the parent's frame [m]. */ xyz: number[];
  /** its orientation in the parent's frame. */ quat: number[];
  /** unit vector in its own frame; None where it has none. */ axis: number[] | null;
  /** lower limit [rad, m for a linear axis]; None where it has none. */ lower: number | null;
  /** upper limit [rad, m for a linear axis]; None where it has none. */ upper: number | null;
  /** whether it has a motor, and so a place in every joint position. */ driven: boolean;
  /** the joints whose controller-side values move it, too. */ coupled_to: JointCoupling[];
  /** what is added [rad, m for a linear axis]. */ offset: number;
};
export type MeshOnLink = {
  /** the link that it moves with. */ link: string;
  /** its origin in the link's frame [m]. */ xyz: number[];
  /** its orientation in the link's frame. */ quat: number[];
};
export type RobotMesh = {
  /** SHA-256 of its bytes. */ hash: string;
  /** how many it has. */ bytes: number;
  /** how to read it. */ form: "stl" | "obj";
  /** m per unit of the file along x, y, z; negative mirrors. */ unit_scale: number[];
  /** where it is. */ links: MeshOnLink[];
  /** `#rrggbb`. */ colour: string;
};
export type Session = {
  /** its number. */ session: number;
  /** name of the pendant. */ client: string;
  /** where it comes from. */ address: string;
  /** name of the account or guest; empty where nobody logged in. */ name: string;
  /** likewise. */ role: string;
  /** its enabling device (training) counts as let go after so long a silence [s]; an older server says nothing of it. */ enabling_deadline?: number;
};
export type ConnectionReport = {
  /** its number. */ session: number;
  /** where it comes from. */ address: string;
  /** as what it has its place: an account or a pairing code, this machine's only user, ROS-Industrial, a stranger who has not logged in, or a stranger who may only stop. */ standing: "account" | "pairing" | "single user" | "ros-industrial" | "stranger" | "stop";
  /** name of the pendant; empty where it has not said hello. */ client: string;
  /** name of its cell; likewise. */ cell: string;
  /** name of the account or guest; empty where nobody logged in. */ name: string;
  /** likewise. */ role: string;
  /** how long it has been open [s]. */ since: number;
  /** frames that it sent in the last second. */ frames: number;
  /** bytes that it sent in the last second. */ bytes: number;
  /** share of one processor core that the server spent on it in the last second, 0 to 1. */ cost: number;
};
export type Bar = {
  /** the address, or the /64 network of one of IPv6. */ address: string;
  /** for how much longer [s]. */ remaining: number;
};
export type User = {
  /** name of the account. */ name: string;
  /** what it may do. */ role: "viewer" | "operator" | "programmer" | "admin";
  /** whether nobody may log in with it. */ disabled: boolean;
};
export type UnreadableUser = {
  /** its name. */ name: string;
  /** what is wrong with it. */ problem: string;
};
export type Role = "viewer" | "operator" | "programmer" | "admin";
/** Return the whole state of the cell: robot, limits, owner, stop, obstacle. Role: viewer. */
export interface SnapshotRequest {
  op: "snapshot";
}
export interface SnapshotReply {
  /** Its name. */ cell: string;
  /** Name of the robot. */ robot: string;
  /** Its driven joints, base to tip. */ joints: JointDescription[];
  /** Names of the frames that a pose or a tool jog may use. */ frames: string[];
  /** What it is doing, in lower case. */ activity: string;
  /** The controller connection: down, up or stale. */ link: string;
  /** The controller's own mode. */ mode: string;
  /** The mode that rules here. */ operating_mode: string;
  /** Override and cap. */ speed: SpeedDescription;
  /** The selected tool; null for the bare flange. */ tool: string | null;
  /** Inputs and outputs. */ signals: SignalsDescription;
  /** What is being recorded; null for nothing. */ recording: RecordingDescription | null;
  /** Why the last recording ended by itself; empty where it did not. */ recording_problem: string;
  /** What is under way; null for nothing. */ program: ProgramDescription | null;
  /** Who holds the motion authority; null for nobody. */ owner: OwnerDescription | null;
  /** The latched stop; null where there is none. */ stop: StopDescription | null;
  /** Why no motion may start now; empty where it may. */ obstacle: string;
}
/** Return which cells and robots the server has behind this port, as a lobby tells them. Role: viewer. */
export interface CellsRequest {
  op: "cells";
}
export interface CellsReply {
  /** name and version of the server. */ server?: string;
  /** newest version of the pendant protocol that it speaks. */ version?: number;
  /** whether a class may be joined; no server has one yet. */ joins?: boolean;
  /** in the order of the server's configuration. */ cells: ServedCell[];
}
/** Return what keeps the robot from moving: every condition, and the first broken one. Role: viewer. */
export interface WhyRequest {
  op: "why";
  /** what shall move it. */ kind?: Wish;
  /** for whoever is in control, so that an onlooker may ask, or for this connection. */ whose?: "holder" | "mine";
}
export interface WhyReply {
  /** Name of the cell. */ cell: string;
  /** What shall move it. */ kind: Wish;
  /** Whether all hold. */ ready: boolean;
  /** The first that is broken; empty where all hold. */ broken: string;
  /** All of them. */ conditions: ConditionReport[];
  /** Why the last motion ended before its goal; null where it arrived or another began. */ ended?: EndReport | null;
  /** What else is to be known, such as that the robot moved without a command; empty from an older server, whose answer has none. */ remarks: string[];
  /** The enabling device (training) of whoever was asked about counts as let go after so long a silence [s]; an older server says nothing of it. */ enabling_deadline: number;
}
/** Return codes with cause and remedy, or messages, or operations of the protocol, in chunks. Role: viewer. */
export interface CatalogueRequest {
  op: "catalogue";
  /** what is wanted. */ part: "codes" | "messages" | "operations";
  /** number of the first entry that is wanted. */ offset?: number;
}
export interface CatalogueReply {
  /** of the protocol. */ version: number;
  /** which part they are of. */ part: string;
  /** number of the first of them. */ offset: number;
  /** entries of the part in all. */ total: number;
  /** as in `docs/generated/catalogue.json`, as many as fit 48 kB. */ entries: Record<string, unknown>[];
  /** offset to ask for next; None behind the last. */ next: number | null;
}
/** Return at what limit, singularity or contact the robot stands, and what leads out. Role: viewer. */
export interface JogRetreatRequest {
  op: "jog.retreat";
}
export interface JogRetreatReply {
  /** One thing that the robot stands at. */ holds: HoldReport[];
}
/** Return which programs there are, by name. Role: viewer. */
export interface ProgramsListRequest {
  op: "programs.list";
  /** how many to leave out at the beginning. */ first?: number;
}
export interface ProgramsListReply {
  /** up to 150 of them. */ programs: ProgramHeading[];
  /** the `first` to ask for the rest with; None at the end. */ next: number | null;
}
/** Make an empty program of this robot. Role: programmer. */
export interface ProgramsCreateRequest {
  op: "programs.create";
  /** name of the program. */ name: string;
  /** the frame that its points are taught in. */ frame?: string;
  /** the tool that they are taught with. */ tool?: string;
}
export interface ProgramsCreateReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Return a program, or a part of it where it is long. Role: viewer. */
export interface ProgramsLoadRequest {
  op: "programs.load";
  /** name of the program. */ name: string;
  /** as a text for people, or as JSON. */ format?: "text" | "json";
  /** an older one, where it is still kept; None for the newest. */ revision?: number | null;
  /** characters to leave out at the beginning. */ offset?: number;
}
export interface ProgramsLoadReply {
  /** name of the program. */ name: string;
  /** the one that this is. */ revision: number;
  /** who saved it. */ saved_by: string;
  /** wall-clock time in UTC, ISO 8601; for display only. */ saved_at: string;
  /** how the body is written. */ format: "text" | "json";
  /** the text, or the JSON as a text. */ body: string;
  /** the offset to ask for the rest with; None at the end. */ next: number | null;
  /** the statements to pause before, from 0, where the newest revision has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Return which revisions of a program are kept. Role: viewer. */
export interface ProgramsHistoryRequest {
  op: "programs.history";
  /** name of the program. */ name: string;
}
export interface ProgramsHistoryReply {
  /** up to 150 of them. */ programs: ProgramHeading[];
  /** the `first` to ask for the rest with; None at the end. */ next: number | null;
}
/** Save a whole program; one that is too long for a frame goes in parts, in order. Role: programmer. */
export interface ProgramsSaveRequest {
  op: "programs.save";
  /** name of the program; the text says the same. */ name: string;
  /** how the body is written. */ format?: "text" | "json";
  /** its text, or a part of it. */ body: string;
  /** the one that the change was made from; 0 for a new program. */ expected_revision: number;
  /** which part this is, from 1. */ part?: number;
  /** how many there are. */ parts?: number;
}
export interface ProgramsSaveReply {
  /** name of the program, after the last part. */ name?: string;
  /** the one that is kept now, after the last part. */ revision?: number;
  /** which part has come, where more are expected. */ part?: number;
  /** how many are expected. */ parts?: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Tell whether a text is a program of this robot; saves nothing. Role: viewer. */
export interface ProgramsCheckRequest {
  op: "programs.check";
  /** the text. */ body: string;
  /** how the body is written. */ format?: "text" | "json";
}
export interface ProgramsCheckReply {
  /** name of the program. */ name: string;
  /** how many. */ points: number;
  /** how many. */ statements: number;
  /** line of its first statement in the text that `load` gives, from 1. */ first_line: number;
}
/** Delete a program; its revisions stay in its history. Role: programmer. */
export interface ProgramsDeleteRequest {
  op: "programs.delete";
  /** name of the program. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface ProgramsDeleteReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Give a program another name; calls in other programs are not changed. Role: programmer. */
export interface ProgramsRenameRequest {
  op: "programs.rename";
  /** name of the program. */ name: string;
  /** the name that it has afterwards. */ new_name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface ProgramsRenameReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Edit a program. Role: programmer. */
export interface ProgramsEditRequest {
  op: "programs.edit";
  /** name of the program. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
  /** what to change: points or statements added, removed, moved, described. */ edit: RecordPoint | TouchUp | DeletePoint | RenamePoint | CommentPoint | ReorderPoint | InsertStatements | DeleteStatements | ReorderStatements | ReplaceStatement | CommentStatement | DescribeProgram;
}
export interface ProgramsEditReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Add a point where the robot stands, and the move to it. Role: programmer. */
export interface ProgramsRecordRequest {
  op: "programs.record";
  /** name of the program. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
  /** name of the new point. */ point: string;
  /** a move that names it; None for the point alone. */ move?: Move | null;
  /** the statement that the move is put before, from 0; None to append it. */ at?: number | null;
  /** about the point. */ comment?: string;
}
export interface ProgramsRecordReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Put a point where the robot stands now; its name and its statements stay. Role: programmer. */
export interface ProgramsTouchUpRequest {
  op: "programs.touch_up";
  /** name of the program. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
  /** name of the point. */ point: string;
}
export interface ProgramsTouchUpReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Take the last edit back; that is a new revision. Role: programmer. */
export interface ProgramsUndoRequest {
  op: "programs.undo";
  /** name of the program. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface ProgramsUndoReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Make the edit again that was taken back last. Role: programmer. */
export interface ProgramsRedoRequest {
  op: "programs.redo";
  /** name of the program. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface ProgramsRedoReply {
  /** name of the program. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** the statements to pause before, from 0, where it has any. */ breakpoints?: number[];
  /** how many are gone with their statements since they were set. */ dropped_breakpoints?: number;
}
/** Name the statements of a program to pause before; they follow its edits. Role: operator. Motion authority: for a program under way. */
export interface ProgramsBreakpointsRequest {
  op: "programs.breakpoints";
  /** name of the program. */ name: string;
  /** their numbers, from 0; none to run through. */ statements: number[];
}
export interface ProgramsBreakpointsReply {
  /** name of the program. */ name: string;
  /** their numbers, from 0. */ statements: number[];
  /** the one that they are of; missing where there are none. */ revision?: number;
  /** those that the run under way, of another revision, does not pause before. */ next_run?: number[];
}
/** Return what would happen if a program ran; nothing moves. Role: operator. */
export interface ProgramsDryRunRequest {
  op: "programs.dry_run";
  /** name of the program. */ name: string;
  /** whether its motions are kept as a plan to be looked at; from version 3 of the protocol. */ samples?: boolean;
}
export interface ProgramsDryRunReply {
  /** its name. */ program: string;
  /** the one that was walked through, which a run can be asked for. */ revision: number;
  /** how long it would take, one pass where it is endless [s]. */ duration: number;
  /** whether it would never end by itself. */ endless: boolean;
  /** whether all of it was looked at. */ complete: boolean;
  /** how many statements and points cannot be done, those included that are not told. */ refused: number;
  /** the first 100 moves, or as many as fit, those that cannot be done first. */ moves: MoveVerdict[];
  /** likewise, where it takes or leaves objects. */ scene: HandOverVerdict[];
  /** likewise, those with signals or flags, and loops. */ statements: StatementVerdict[];
  /** statements with signals, where the controller has not said which it has. */ unchecked: NotWalked[];
  /** likewise, the points that are named. */ points: PointVerdict[];
  /** statements in branches that are not taken. */ not_walked: NotWalked[];
  /** the way of the tool: time [s], then x, y, z in base [m]. */ path: number[][];
  /** where samples were asked for, the plan that `plans.samples` shows its motions by, one behind the other without waits, and that is never executed; None where there is none. */ plan?: number | null;
}
/** Return how far the dry run is that is under way. Role: viewer. */
export interface ProgramsDryRunProgressRequest {
  op: "programs.dry_run_progress";
}
export interface ProgramsDryRunProgressReply {
  /** whether a dry run is under way. */ running: boolean;
  /** blocks of motion that were looked at. */ blocks: number;
}
/** Plan a motion and keep it, to be looked at and executed; nothing moves. Role: operator. */
export interface PlansMakeRequest {
  op: "plans.make";
  /** where to, and how. */ goal: PtpAim | LinAim | PathAim | FreeAim | PositionAim;
  /** joints where it begins; None for where the robot stands: no other plan is executed. */ start?: number[] | null;
  /** fraction of the joints' greatest speeds, above 0, up to 1. */ speed?: number;
  /** cap of tool and elbow, beside that of the mode [m/s]; None for no other. */ tool_speed?: number | null;
  /** shown to others; up to 64 characters. */ label?: string;
}
export interface PlansMakeReply {
  /** its number. */ plan: number;
  /** `ready`. */ state: string;
  /** how long it is kept [s]. */ expires_in: number;
  /** of the motion [s]. */ duration: number;
  /** how many, one every 10 ms, the last at the end. */ samples: number;
  /** how long planning took [s]. */ plan_time: number;
  /** what found the path. */ planner: string;
  /** of a planner that draws numbers; 0 for others. */ seed: number;
  /** joints where it begins [rad, m for a linear axis]. */ start: number[];
  /** joints where it ends. */ end: number[];
  /** of the tool there, in base. */ end_pose: FoundPose;
  /** what it was made from. */ based_on: BasedOn;
  /** what the check of every sample found. */ certificate: PlanCertificate;
  /** where an object of the scene and another body come nearest; None where the scene has none. */ clearance: PlanClearance | null;
  /** whether `execute` would be accepted now. */ executable: boolean;
  /** what it would be refused for; None for nothing. */ why: Unexecutable | null;
}
/** Return samples of a plan, exactly as they would be executed. Role: viewer. */
export interface PlansSamplesRequest {
  op: "plans.samples";
  /** number of the plan. */ plan: number;
  /** number of the first sample, from 0. */ first?: number;
  /** rows at most; fewer come where a frame holds no more. */ count?: number;
  /** of each so many samples one. */ every?: number;
  /** whether the tool's place is told, too. */ with_tool?: boolean;
}
export interface PlansSamplesReply {
  /** its number. */ plan: number;
  /** number of the first sample that is told, from 0. */ first: number;
  /** of each so many samples one is told. */ every: number;
  /** samples of the plan. */ total: number;
  /** `t`, then `q0` and so on the joints, `v0` their speeds, `a0` their accelerations. */ columns: string[];
  /** the samples [s; rad, rad/s, rad/s², m for a linear axis]. */ rows: number[][];
  /** x, y, z [m] and quaternion x, y, z, w of the tool in base at each row, where asked. */ tool?: number[][];
  /** whether samples follow behind the last row. */ more: boolean;
}
/** Return all plans of the cell in short. Role: viewer. */
export interface PlansShowRequest {
  op: "plans.show";
}
export interface PlansShowReply {
  /** those that are made, kept or executed, and the last that were, by number. */ plans: PlanHead[];
}
/** Forget a plan of one's own, or any with the motion authority. Role: operator. */
export interface PlansDropRequest {
  op: "plans.drop";
  /** number of the plan. */ plan: number;
}
export interface PlansDropReply {}
/** Return which recordings there are, 100 at a time, and which one is under way. Role: viewer. */
export interface RecordingsListRequest {
  op: "recordings.list";
  /** how many to leave out at the beginning. */ first?: number;
}
export interface RecordingsListReply {
  /** up to 100 of them, by name. */ recordings: RecordingHeading[];
  /** how many there are. */ total: number;
  /** the one under way; None where nothing is recorded. */ recording: RecordingProgress | null;
  /** why the last one ended by itself; empty where it did not. */ problem: string;
}
/** Return what a recording is: robot, joints, rate, duration, gaps, problem. Role: viewer. */
export interface RecordingsDescribeRequest {
  op: "recordings.describe";
  /** name of the recording. */ name: string;
}
export interface RecordingsDescribeReply {
  /** names of the values of a sample: time, each joint, mark of a gap. */ columns: string[];
  /** name of the robot. */ robot: string;
  /** names of its joints. */ joints: string[];
  /** how often the controller was expected to report [s]. */ period: number;
  /** it was stopped, not cut off. */ finished: boolean;
  /** why it ended by itself; empty where it was stopped. */ problem: string;
  /** how many. */ samples: number;
  /** from the first to the last sample [s]. */ duration: number;
  /** samples a second, gaps left out [Hz]. */ rate: number;
  /** between samples. */ gaps: number;
  /** the longest of them [s]. */ longest_gap: number;
  /** name of the recording. */ name: string;
  /** of its description: rename or delete it from this one. */ revision: number;
}
/** Begin a recording; answered once it is kept. Role: programmer. */
export interface RecordingsStartRequest {
  op: "recordings.start";
  /** name of the new recording. */ name: string;
}
export interface RecordingsStartReply {
  /** names of the values of a sample: time, each joint, mark of a gap. */ columns: string[];
  /** name of the robot. */ robot: string;
  /** names of its joints. */ joints: string[];
  /** how often the controller was expected to report [s]. */ period: number;
  /** it was stopped, not cut off. */ finished: boolean;
  /** why it ended by itself; empty where it was stopped. */ problem: string;
  /** how many. */ samples: number;
  /** from the first to the last sample [s]. */ duration: number;
  /** samples a second, gaps left out [Hz]. */ rate: number;
  /** between samples. */ gaps: number;
  /** the longest of them [s]. */ longest_gap: number;
}
/** End the recording under way; answered once all of it is kept. Role: programmer. */
export interface RecordingsStopRequest {
  op: "recordings.stop";
}
export interface RecordingsStopReply {
  /** names of the values of a sample: time, each joint, mark of a gap. */ columns: string[];
  /** name of the robot. */ robot: string;
  /** names of its joints. */ joints: string[];
  /** how often the controller was expected to report [s]. */ period: number;
  /** it was stopped, not cut off. */ finished: boolean;
  /** why it ended by itself; empty where it was stopped. */ problem: string;
  /** how many. */ samples: number;
  /** from the first to the last sample [s]. */ duration: number;
  /** samples a second, gaps left out [Hz]. */ rate: number;
  /** between samples. */ gaps: number;
  /** the longest of them [s]. */ longest_gap: number;
}
/** Save a part of a recording as a new one. Role: programmer. */
export interface RecordingsTrimRequest {
  op: "recordings.trim";
  /** name of the recording. */ name: string;
  /** name of the part. */ new_name: string;
  /** first time that is kept [s]. */ begins?: number;
  /** last time that is kept [s]; None for the end. */ ends?: number | null;
}
export interface RecordingsTrimReply {
  /** name of the recording. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Give a recording another name. Role: programmer. */
export interface RecordingsRenameRequest {
  op: "recordings.rename";
  /** name of the recording. */ name: string;
  /** the name that it has afterwards. */ new_name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface RecordingsRenameReply {
  /** name of the recording. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Delete a recording; its samples are gone at once. Role: programmer. */
export interface RecordingsDeleteRequest {
  op: "recordings.delete";
  /** name of the recording. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface RecordingsDeleteReply {
  /** name of the recording. */ name: string;
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Play a recording back; answered when it is planned, and the motion begins with the answer. Role: operator. Motion authority: always. */
export interface RecordingsPlayRequest {
  op: "recordings.play";
  /** name of the recording. */ name: string;
  /** speed relative to the recording, 0.1 to 4; the limits keep it down. */ factor?: number;
  /** how far the path may lie from a sample in any joint [rad or m]; None for as near as it can without following noise, 0.002 at best and 0.01 at most. */ tolerance?: number | null;
  /** how many times; in between the robot goes softly back to the first sample. */ repeats?: number;
  /** first time of the recording that is played [s]. */ begins?: number;
  /** last time that is played [s]; None for the end. */ ends?: number | null;
  /** longest gap that is played across [s]. */ bridge?: number;
}
export interface RecordingsPlayReply {
  /** how many are played. */ samples: number;
  /** how long their recording took [s]. */ recorded: number;
  /** how long playing them once was to take [s]. */ asked: number;
  /** how long it takes under the limits [s]. */ possible: number;
  /** time of the soft way to the first sample [s]; 0 where the robot stands there. */ approach: number;
  /** time of the whole motion, repeats and ways back included [s]. */ total: number;
  /** greatest distance of a sample from the path, in any joint [rad or m]. */ deviation: number;
  /** samples whose time did not advance. */ dropped: number;
  /** gaps that are played across. */ gaps: number;
  /** the longest of them [s]. */ longest_gap: number;
  /** speed relative to the recording that is possible. */ factor: number;
}
/** Return all frames and tools, which tool is selected, and the revisions. Role: viewer. */
export interface FramesShowRequest {
  op: "frames.show";
  /** the part of 50 entries from this number on, the tools being the first; null for all. */ first?: number | null;
}
export interface FramesShowReply {
  /** user frames and tools, as in a file of schema `openpendant-frames/1`. */ content: Record<string, unknown>;
  /** of all frames, the robot's own among them; in a part, of what it holds. */ names: string[];
  /** what a change of frames is made from. */ frames_revision: number;
  /** what a change of tools is made from. */ tools_revision: number;
  /** what is wrong with a document of the store, by its kind. */ problems: Record<string, unknown>;
  /** in a part, how many tools and user frames there are. */ total?: number;
  /** in a part, the `first` of the next one; null in the last. */ next?: number | null;
}
/** Add a user frame. Role: programmer. */
export interface FramesAddRequest {
  op: "frames.add";
  /** name of the frame. */ name: string;
  /** the frame that it hangs from. */ parent?: string;
  /** of the frame in its parent. */ pose: PlacedPose;
  /** the one of the frames that the change was made from. */ expected_revision: number;
}
export interface FramesAddReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Put a user frame elsewhere. Role: programmer. */
export interface FramesMoveRequest {
  op: "frames.move";
  /** name of the frame. */ name: string;
  /** the frame that it hangs from afterwards; None for the same. */ parent?: string | null;
  /** of the frame in its parent. */ pose: PlacedPose;
  /** the one of the frames that the change was made from. */ expected_revision: number;
}
export interface FramesMoveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Give a user frame another name. Role: programmer. */
export interface FramesRenameRequest {
  op: "frames.rename";
  /** name of the frame. */ name: string;
  /** the name that it has afterwards. */ new_name: string;
  /** the one of the frames that the change was made from. */ expected_revision: number;
}
export interface FramesRenameReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Remove a user frame from which no other hangs. Role: programmer. */
export interface FramesRemoveRequest {
  op: "frames.remove";
  /** name of the frame. */ name: string;
  /** the one of the frames that the change was made from. */ expected_revision: number;
}
export interface FramesRemoveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Return the frame of three or four points; keeps nothing, `add` does. Role: programmer. */
export interface FramesTeachRequest {
  op: "frames.teach";
  /** in base [m]: origin, on x, on the side of y; or two on x and two on y. */ points: [number, number, number][];
}
export interface FramesTeachReply {
  /** the frame in base. */ pose: FoundPose;
  /** between the directions taught for x and y [rad]; π/2 determines best. */ angle: number;
  /** by how much the frame tilts where a point is off [rad per m of error]. */ tilt_per_error: number;
  /** by how much the axes miss the right angle [rad]; 0 for three points. */ skew: number;
}
/** Return where a pose of one frame is in another. Role: viewer. */
export interface FramesTransformRequest {
  op: "frames.transform";
  /** the frame that the pose is given in. */ source: string;
  /** the frame that it is wanted in. */ target: string;
  /** the pose; the origin of the source where left out. */ pose?: PlacedPose;
  /** not now but then, up to ten seconds [s]. */ seconds_ago?: number;
}
export interface FramesTransformReply {
  /** in the target frame. */ pose: FoundPose;
}
/** Replace all user frames by those of a file's content. Role: programmer. */
export interface FramesImportRequest {
  op: "frames.import";
  /** as in a file of schema `openpendant-frames/1`. */ content: Record<string, unknown>;
  /** the one of the frames that the change was made from. */ expected_revision: number;
}
export interface FramesImportReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Return every named position, whether the robot may stand there, and the revision. Role: viewer. */
export interface PositionsListRequest {
  op: "positions.list";
}
export interface PositionsListReply {
  /** those of the robot's file first, then those of the cell by name. */ positions: NamedPosition[];
  /** what a change is made from. */ revision: number;
  /** what is wrong with the document of the store; empty for nothing. */ problem: string;
}
/** Give a joint position a name; where it has one already in this cell, that is moved. Role: programmer. */
export interface PositionsSaveRequest {
  op: "positions.save";
  /** what it is called: 1 to 32 printable bytes. */ name: string;
  /** one value per driven joint [rad or m]; None for where the robot stands. */ joints?: number[] | null;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface PositionsSaveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** what to know before a motion there: near a singularity or a limit, or something touches; None for nothing. */ warning: string | null;
}
/** Give a position of this cell another name. Role: programmer. */
export interface PositionsRenameRequest {
  op: "positions.rename";
  /** the name that it has. */ name: string;
  /** the name that it has afterwards. */ new_name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface PositionsRenameReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Forget a position of this cell. Role: programmer. */
export interface PositionsDeleteRequest {
  op: "positions.delete";
  /** the name that it has. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface PositionsDeleteReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Add a tool. Role: programmer. */
export interface ToolsAddRequest {
  op: "tools.add";
  /** name of the tool. */ name: string;
  /** its centre point in the flange. */ tcp: PlacedPose;
  /** where it grasps; None for the default. */ grasp?: ToolGrasp | null;
  /** the one of the tools that the change was made from. */ expected_revision: number;
}
export interface ToolsAddReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Give a tool another centre point and another grasp. Role: programmer. Motion authority: for the selected tool. */
export interface ToolsMoveRequest {
  op: "tools.move";
  /** name of the tool. */ name: string;
  /** its centre point in the flange. */ tcp: PlacedPose;
  /** where it grasps; None for the default, not for the one it had. */ grasp?: ToolGrasp | null;
  /** the one of the tools that the change was made from. */ expected_revision: number;
}
export interface ToolsMoveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Remove a tool that is not selected. Role: programmer. */
export interface ToolsRemoveRequest {
  op: "tools.remove";
  /** name of the tool. */ name: string;
  /** the one of the tools that the change was made from. */ expected_revision: number;
}
export interface ToolsRemoveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Select a tool; in force once it is answered. Role: programmer. Motion authority: always. */
export interface ToolsSelectRequest {
  op: "tools.select";
  /** name of the tool; None for the bare flange. */ name: string | null;
  /** the one of the tools that the change was made from. */ expected_revision: number;
}
export interface ToolsSelectReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Return the centre point of the tool that touched one point; keeps nothing, `add` does. Role: programmer. */
export interface ToolsCalibrateRequest {
  op: "tools.calibrate";
  /** 4 to 20 joint positions that touch it [rad, m for a linear axis]. */ positions: number[][];
}
export interface ToolsCalibrateReply {
  /** x, y, z in the flange [m]. */ position: number[];
  /** how far each position's centre stays from the point that was touched [m]. */ residuals: number[];
  /** the largest of them [m]. */ max_residual: number;
  /** of the centre point [m]; None where it cannot be told. */ uncertainty: number | null;
}
/** Replace all tools by those of a file's content. Role: programmer. Motion authority: always. */
export interface ToolsImportRequest {
  op: "tools.import";
  /** as in a file of schema `openpendant-frames/1`. */ content: Record<string, unknown>;
  /** the one of the tools that the change was made from. */ expected_revision: number;
}
export interface ToolsImportReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Return the scene as a file's content, and its revision. Role: viewer. */
export interface SceneShowRequest {
  op: "scene.show";
}
export interface SceneShowReply {
  /** as in a file of schema `openpendant-scene/1`. */ content: Record<string, unknown>;
  /** what the next change is made from. */ revision: number;
}
/** Add an object, also while the robot moves. Role: programmer. Motion authority: while the robot moves, or for what it carries. */
export interface SceneAddRequest {
  op: "scene.add";
  /** as in a scene file: name, shape, position, quaternion, frame. */ object: Record<string, unknown>;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneAddReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Remove an object. Role: programmer. Motion authority: while the robot moves, or for what it carries. */
export interface SceneRemoveRequest {
  op: "scene.remove";
  /** name of the object. */ name: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneRemoveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Put an object elsewhere. Role: programmer. Motion authority: while the robot moves, or for what it carries. */
export interface SceneMoveRequest {
  op: "scene.move";
  /** name of the object. */ name: string;
  /** in base. */ pose: PlacedPose;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneMoveReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Let two bodies touch. Role: programmer. Motion authority: while the robot moves. */
export interface SceneAllowRequest {
  op: "scene.allow";
  /** one of them: an object, or a link of the robot. */ first: string;
  /** the other. */ second: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneAllowReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Let two bodies touch no more. Role: programmer. Motion authority: while the robot moves. */
export interface SceneForbidRequest {
  op: "scene.forbid";
  /** one of them: an object, or a link of the robot. */ first: string;
  /** the other. */ second: string;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneForbidReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Let a link take an object where both are now, if the object is within the tool's reach. Role: programmer. Motion authority: always. */
export interface SceneAttachRequest {
  op: "scene.attach";
  /** name of the object. */ name: string;
  /** the link, measured from its origin; None for the tool's, measured from its grasp point. */ link?: string | null;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneAttachReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
  /** from the grasp point to the nearest point of the body [m]; 0 inside. */ distance?: number;
  /** pose of the object in the tool, or in the link where it is not the tool's. */ grasp?: FoundPose;
}
/** Leave an object that the robot carries where it is now; it does not fall. Role: programmer. Motion authority: always. */
export interface SceneDetachRequest {
  op: "scene.detach";
  /** name of the object. */ name: string;
  /** ignored; the server knows which link has it. */ link?: string | null;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneDetachReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Replace the scene by that of a file's content. Role: programmer. Motion authority: while the robot moves, or for what it carries. */
export interface SceneImportRequest {
  op: "scene.import";
  /** as in a file of schema `openpendant-scene/1`, without meshes. */ content: Record<string, unknown>;
  /** the one that the change was made from. */ expected_revision: number;
}
export interface SceneImportReply {
  /** the one that is kept now: make the next change from it. */ revision: number;
}
/** Return which two bodies are nearest to each other now, and how near. Role: viewer. */
export interface SceneNearestRequest {
  op: "scene.nearest";
}
export interface SceneNearestReply {
  /** how near [m]; None where there is nothing to check. */ distance: number | null;
  /** one of them. */ first?: string;
  /** the other. */ second?: string;
  /** the nearest point of the first, in base [m]. */ first_point?: number[];
  /** likewise. */ second_point?: number[];
}
/** Return all inputs and outputs. Role: viewer. */
export interface SignalsReadRequest {
  op: "signals.read";
}
export interface SignalsReadReply {
  /** whether the controller offers any to the server. */ offered: boolean;
  /** values. */ inputs: boolean[];
  /** values. */ outputs: boolean[];
}
/** Give an output a value; answered once the controller has done it. Role: operator. Motion authority: always. */
export interface SignalsSetRequest {
  op: "signals.set";
  /** its number, from 0. */ output: number;
  /** on or off. */ value: boolean;
}
export interface SignalsSetReply {}
/** Return which robots the server knows, and which one this cell has. Role: viewer. */
export interface RobotsListRequest {
  op: "robots.list";
}
export interface RobotsListReply {
  /** names of all that the server knows. */ robots: string[];
  /** the one that this cell has. */ loaded: string;
}
/** Return the specification of this cell's robot. Role: viewer. */
export interface RobotsDescribeRequest {
  op: "robots.describe";
  /** name of the robot; None for this cell's, which is the only one that it describes. */ name?: string | null;
}
export interface RobotsDescribeReply {
  /** its robot file: kind, tables, sources, frames. */ facts: Record<string, unknown>;
  /** of its joints; missing for a robot without a chain of joints. */ limits?: JointTable;
  /** of its joints [rad, m for a linear axis]; likewise. */ home_position?: number[];
  /** names of those that find ways around obstacles here, the default first; from version 3 of the protocol. */ planners?: string[];
}
/** Demand that this cell has a certain robot; refused unless it has it already. Role: programmer. */
export interface RobotsLoadRequest {
  op: "robots.load";
  /** name of the robot. */ name: string;
}
export interface RobotsLoadReply {
  /** its name. */ loaded: string;
}
/** Return what the controller can do; ask again after each CONTROLLER_CHANGED. Role: viewer. */
export interface ControllerDescribeRequest {
  op: "controller.describe";
}
export interface ControllerDescribeReply {
  /** counts the changes of this answer, from 1; as in CONTROLLER_CHANGED. */ declaration: number;
  /** how it is spoken to. */ dialect: string;
  /** whether it is known to be emulated: it says so, and so does the cell's file. */ emulated: boolean;
  /** whether it says so on this connection. */ says_emulated: boolean;
  /** whether it is prepared to be moved. */ prepared: "no" | "yes" | "not needed";
  /** whether it is that of the cell's robot, as far as that was looked at. */ identity: "unverified" | "match" | "mismatch";
  /** how a planned motion goes to it. */ feeding: "stream" | "knots" | "download";
  /** which jogs it takes; with `increments` JOG_START is refused, with `none` all are. */ jog: "continuous" | "increments" | "none";
  /** whether a motion pauses on its path, or cannot be paused. */ pause: "path" | "none";
  /** when the speed override acts. */ override: "live" | "before start" | "none";
  /** type of the messages that points travel in. */ points: number;
  /** points that may wait for their answers at once. */ in_flight: number;
  /** of one part of a motion; None for no bound. */ most_points: number | null;
  /** how far points of a planned motion are sent ahead of the robot [s]. */ lead: number;
  /** likewise of a jog [s]. */ jog_lead: number;
  /** what it does between points, in words. */ interpolation: string;
  /** of that at the tool [m]; 0 where it goes through every point. */ path_tolerance: number;
  /** likewise [rad]. */ angle_tolerance: number;
  /** who holds the speed of a mode. */ speed_enforced_by: "server" | "controller";
  /** whether STOP has a connection of its own. */ second_stop: boolean;
  /** whether the robot stops by itself where its motion connection is lost. */ link_loss_stops: boolean;
  /** longest motion after a STOP that arrived [s]. */ residual_motion: number;
  /** longest motion after the last that could be delivered [s]. */ blind_motion: number;
  /** what stops the robot where the server's process stands still. */ freeze_protection: "second connection" | "link shutdown" | "controller's own timeout" | "none";
  /** how long a released jog may ramp before that becomes a STOP [s]. */ ramp_time: number;
  /** what a report is held against: `due`, what was due, or `place` on the path. */ following: "due" | "place";
  /** how far a turning joint may be from that while it stands [rad]. */ following_tolerance: number;
  /** how far each joint may be behind its set-points besides [s]. */ lag: number;
  /** of a reported position, accepted besides [rad or m]. */ noise: number;
  /** of its reports [s]. */ state_period: number;
  /** a new motion begins from a report that is no older [s]. */ fresh_age: number;
  /** a motion ends where the newest report is older [s]. */ abort_age: number;
  /** how far a motion may begin from where the robot stands [rad or m]; None for no bound. */ start_tolerance: number | null;
  /** what PREPARE may ask of it; empty where that is refused. */ prepare: string[];
  /** what tells that it is the robot's own controller. */ identify: string[];
  /** `openpendant` where it has some for the server. */ signals: "none" | "openpendant";
  /** how long its answers are waited for. */ reply_deadlines: ReplyDeadlines;
}
/** Return where the tool is at a joint position: matrix, angles, quaternion, configuration. Role: viewer. */
export interface KinematicsFkRequest {
  op: "kinematics.fk";
  /** the joint position [rad, m for a linear axis]; None for where the robot is reported now. */ joints?: number[] | null;
  /** base, root or a user frame that stands still. */ frame?: string;
  /** a tool, or flange; None for the selected tool. */ tool?: string | null;
  /** a link whose place is wanted; None for the tool. */ link?: string | null;
  /** whether all links are told as well. */ all_links?: boolean;
}
export interface KinematicsFkReply {
  /** x, y, z [m]. */ position: number[];
  /** quaternion x, y, z, w; w is not negative. */ orientation: number[];
  /** 4 × 4, row by row: [[R, p], [0, 1]] [m]. */ matrix: number[][];
  /** roll, pitch, yaw [rad] with R = Rz(yaw) Ry(pitch) Rx(roll). */ rpy: number[];
  /** False at a pitch of ±π/2, where roll is 0 and yaw the sum or difference. */ rpy_unique: boolean;
  /** rotation vector x, y, z [rad]. */ axis_angle: number[];
  /** how the arm stands; None where it has no flags. */ configuration: ArmPosture | null;
  /** joints outside their limits; the pose is told all the same. */ limits: JointOutside[];
  /** all links, where asked for. */ links?: LinkPose[];
}
/** Return the Jacobian of the tool centre point, its condition and the nearest singularity. Role: viewer. */
export interface KinematicsJacobianRequest {
  op: "kinematics.jacobian";
  /** the joint position [rad, m for a linear axis]; None for where the robot is reported now. */ joints?: number[] | null;
  /** whose axes. */ frame?: "base" | "root";
  /** a tool, or flange; None for the selected tool. */ tool?: string | null;
}
export interface KinematicsJacobianReply {
  /** 6 × n, rows vx, vy, vz, ωx, ωy, ωz, per unit of controller-side joint speed [m/rad and rad/rad; m/m and rad/m on a linear axis]. */ jacobian: number[][];
  /** `linear-first`; the RoboAnalyzer's paper stacks [ω; v], so swap the halves for it. */ order: string;
  /** greatest over least singular value, 1 at best; None for infinite. */ condition: number | null;
  /** square root of the determinant of J Jᵀ, of Jᵀ J with fewer than six joints. */ manipulability: number;
  /** which, and how far. */ nearest_singularity: NearestSingularity;
  /** length by which those of the Jacobian are divided for these three [m]. */ size: number;
}
/** Return joint positions that put the tool at a pose; of a connection's only the newest waits. Role: viewer. */
export interface KinematicsIkRequest {
  op: "kinematics.ik";
  /** the wanted pose of the tool. */ pose: PlacedPose;
  /** base, root or a user frame that stands still. */ frame?: string;
  /** a tool, or flange; None for the selected tool. */ tool?: string | null;
  /** the joint position to be near to; None for where the robot is reported now. */ seed?: number[] | null;
  /** the nearest answer, each configuration at its nearest turn, or all turns in the limits. */ branches?: "nearest" | "all" | "turns";
  /** whether each answer also tells what touches in the cell's scene. */ scene?: boolean;
}
export interface KinematicsIkReply {
  /** at most 64. */ solutions: InverseSolution[];
  /** how many there are of the kind that was asked for. */ total: number;
  /** whether nothing is missing in `total`; false for `nearest`, for an arm with a self-motion or without a closed form, and at a singularity: those are samples. */ complete: boolean;
}
/** Return what a robot looks like, and how its joints move it. Role: viewer. */
export interface ShapesShowRequest {
  op: "shapes.show";
  /** a robot of the catalogue; None for that of this cell. */ robot?: string | null;
}
export interface ShapesShowReply {
  /** its name. */ robot: string;
  /** its solids. */ shapes: DrawnShape[];
  /** its rods. */ struts: DrawnStrut[];
  /** its links, root to tool. */ links: DrawnLink[];
  /** its joints, root to tool. */ joints: DrawnJoint[];
  /** joint position of home, controller side [rad, m for a linear axis]. */ home: number[];
  /** SHA-256 of all this: a page need not draw the same anew. */ hash: string;
}
/** Return the meshes of this cell's robot. Role: viewer. */
export interface ShapesMeshesRequest {
  op: "shapes.meshes";
}
export interface ShapesMeshesReply {
  /** none for a robot of the catalogue. */ meshes: RobotMesh[];
}
/** Return some bytes of a mesh; ask for the next once these came. Role: viewer. */
export interface ShapesMeshRequest {
  op: "shapes.mesh";
  /** its SHA-256, as shapes.meshes tells it. */ hash: string;
  /** number of the first byte that is wanted. */ offset?: number;
}
export interface ShapesMeshReply {
  /** how many the whole mesh has. */ bytes_total: number;
  /** number of the first byte here. */ offset: number;
  /** the bytes in base64, at most 32,768 of them. */ data: string;
  /** whether more follow. */ more: boolean;
}
/** Return the way of the tool since the trace was cleared. Role: viewer. */
export interface TraceShowRequest {
  op: "trace.show";
  /** points to leave out at the beginning. */ first?: number;
}
export interface TraceShowReply {
  /** up to 800 of them: x, y, z in base [m]. */ points: number[][];
  /** how many there are. */ total: number;
}
/** Forget the way of the tool. Role: operator. */
export interface TraceClearRequest {
  op: "trace.clear";
}
export interface TraceClearReply {}
/** Return what this connection was granted. Role: anybody. */
export interface AccessWhoamiRequest {
  op: "access.whoami";
}
export interface AccessWhoamiReply {
  /** its number. */ session: number;
  /** name of the account or guest; empty where nobody logged in. */ name: string;
  /** viewer, operator, programmer or admin; empty likewise. */ role: string;
  /** why: a password, a pairing code, or this machine's only user; empty likewise. */ basis: string;
  /** what it may ask for. */ permissions: string[];
}
/** End what this connection was granted. Role: anybody. */
export interface AccessLogoutRequest {
  op: "access.logout";
}
export interface AccessLogoutReply {}
/** Return who is connected to this cell. Role: admin. */
export interface AccessSessionsRequest {
  op: "access.sessions";
}
export interface AccessSessionsReply {
  /** all that said hello. */ sessions: Session[];
}
/** Return whether logins are demanded of other machines, and whether the port is encrypted. Role: anybody. */
export interface AccessExposureRequest {
  op: "access.exposure";
}
export interface AccessExposureReply {
  /** whether who comes from another machine has to log in to do more than stop. */ logins_demanded: boolean;
  /** whether the pendant port is encrypted. */ tls: boolean;
}
/** Return every connection of the server with its address, standing, rate and cost. Role: admin. */
export interface AccessConnectionsRequest {
  op: "access.connections";
  /** only connections with a greater number. */ after?: number;
}
export interface AccessConnectionsReply {
  /** at most a hundred. */ connections: ConnectionReport[];
  /** how many follow; ask again with the last number as `after`. */ more: number;
  /** addresses of which nobody may do more than stop, the soonest to be free first. */ barred: Bar[];
}
/** Close a connection at once, of whatever cell; what it moves is stopped. Role: admin. */
export interface AccessCloseRequest {
  op: "access.close";
  /** its number. */ session: number;
}
export interface AccessCloseReply {}
/** Let nobody of an address in, not even to stop, and close what is open from there. Role: admin. */
export interface AccessBarRequest {
  op: "access.bar";
  /** of IPv4, or of IPv6 for its whole /64 network. */ address: string;
  /** for so long, at most a day. */ minutes?: number;
}
export interface AccessBarReply {
  /** how many connections. */ closed: number;
}
/** Let an address in again. Role: admin. */
export interface AccessUnbarRequest {
  op: "access.unbar";
  /** as it was barred, or as `access.connections` shows it. */ address: string;
}
export interface AccessUnbarReply {}
/** Return which accounts there are. Role: admin. */
export interface UsersListRequest {
  op: "users.list";
}
export interface UsersListReply {
  /** by name. */ users: User[];
  /** what should be accounts and cannot be read, by name; they can be removed. */ unreadable: UnreadableUser[];
}
/** Remove an account; whoever is logged in with it is logged out. Role: admin. */
export interface UsersRemoveRequest {
  op: "users.remove";
  /** name of the account. */ name: string;
}
export interface UsersRemoveReply {}
/** Give an account another role, which holds at once. Role: admin. */
export interface UsersSetRoleRequest {
  op: "users.set_role";
  /** name of the account. */ name: string;
  /** viewer, operator, programmer or admin. */ role: Role;
}
export interface UsersSetRoleReply {}
/** Keep an account but let nobody log in with it. Role: admin. */
export interface UsersDisableRequest {
  op: "users.disable";
  /** name of the account. */ name: string;
}
export interface UsersDisableReply {}
/** Let an account be used again. Role: admin. */
export interface UsersEnableRequest {
  op: "users.enable";
  /** name of the account. */ name: string;
}
export interface UsersEnableReply {}
/** Request and reply of every operation by the value of `op`. */
export interface Operations {
  "snapshot": [SnapshotRequest, SnapshotReply];
  "cells": [CellsRequest, CellsReply];
  "why": [WhyRequest, WhyReply];
  "catalogue": [CatalogueRequest, CatalogueReply];
  "jog.retreat": [JogRetreatRequest, JogRetreatReply];
  "programs.list": [ProgramsListRequest, ProgramsListReply];
  "programs.create": [ProgramsCreateRequest, ProgramsCreateReply];
  "programs.load": [ProgramsLoadRequest, ProgramsLoadReply];
  "programs.history": [ProgramsHistoryRequest, ProgramsHistoryReply];
  "programs.save": [ProgramsSaveRequest, ProgramsSaveReply];
  "programs.check": [ProgramsCheckRequest, ProgramsCheckReply];
  "programs.delete": [ProgramsDeleteRequest, ProgramsDeleteReply];
  "programs.rename": [ProgramsRenameRequest, ProgramsRenameReply];
  "programs.edit": [ProgramsEditRequest, ProgramsEditReply];
  "programs.record": [ProgramsRecordRequest, ProgramsRecordReply];
  "programs.touch_up": [ProgramsTouchUpRequest, ProgramsTouchUpReply];
  "programs.undo": [ProgramsUndoRequest, ProgramsUndoReply];
  "programs.redo": [ProgramsRedoRequest, ProgramsRedoReply];
  "programs.breakpoints": [ProgramsBreakpointsRequest, ProgramsBreakpointsReply];
  "programs.dry_run": [ProgramsDryRunRequest, ProgramsDryRunReply];
  "programs.dry_run_progress": [ProgramsDryRunProgressRequest, ProgramsDryRunProgressReply];
  "plans.make": [PlansMakeRequest, PlansMakeReply];
  "plans.samples": [PlansSamplesRequest, PlansSamplesReply];
  "plans.show": [PlansShowRequest, PlansShowReply];
  "plans.drop": [PlansDropRequest, PlansDropReply];
  "recordings.list": [RecordingsListRequest, RecordingsListReply];
  "recordings.describe": [RecordingsDescribeRequest, RecordingsDescribeReply];
  "recordings.start": [RecordingsStartRequest, RecordingsStartReply];
  "recordings.stop": [RecordingsStopRequest, RecordingsStopReply];
  "recordings.trim": [RecordingsTrimRequest, RecordingsTrimReply];
  "recordings.rename": [RecordingsRenameRequest, RecordingsRenameReply];
  "recordings.delete": [RecordingsDeleteRequest, RecordingsDeleteReply];
  "recordings.play": [RecordingsPlayRequest, RecordingsPlayReply];
  "frames.show": [FramesShowRequest, FramesShowReply];
  "frames.add": [FramesAddRequest, FramesAddReply];
  "frames.move": [FramesMoveRequest, FramesMoveReply];
  "frames.rename": [FramesRenameRequest, FramesRenameReply];
  "frames.remove": [FramesRemoveRequest, FramesRemoveReply];
  "frames.teach": [FramesTeachRequest, FramesTeachReply];
  "frames.transform": [FramesTransformRequest, FramesTransformReply];
  "frames.import": [FramesImportRequest, FramesImportReply];
  "positions.list": [PositionsListRequest, PositionsListReply];
  "positions.save": [PositionsSaveRequest, PositionsSaveReply];
  "positions.rename": [PositionsRenameRequest, PositionsRenameReply];
  "positions.delete": [PositionsDeleteRequest, PositionsDeleteReply];
  "tools.add": [ToolsAddRequest, ToolsAddReply];
  "tools.move": [ToolsMoveRequest, ToolsMoveReply];
  "tools.remove": [ToolsRemoveRequest, ToolsRemoveReply];
  "tools.select": [ToolsSelectRequest, ToolsSelectReply];
  "tools.calibrate": [ToolsCalibrateRequest, ToolsCalibrateReply];
  "tools.import": [ToolsImportRequest, ToolsImportReply];
  "scene.show": [SceneShowRequest, SceneShowReply];
  "scene.add": [SceneAddRequest, SceneAddReply];
  "scene.remove": [SceneRemoveRequest, SceneRemoveReply];
  "scene.move": [SceneMoveRequest, SceneMoveReply];
  "scene.allow": [SceneAllowRequest, SceneAllowReply];
  "scene.forbid": [SceneForbidRequest, SceneForbidReply];
  "scene.attach": [SceneAttachRequest, SceneAttachReply];
  "scene.detach": [SceneDetachRequest, SceneDetachReply];
  "scene.import": [SceneImportRequest, SceneImportReply];
  "scene.nearest": [SceneNearestRequest, SceneNearestReply];
  "signals.read": [SignalsReadRequest, SignalsReadReply];
  "signals.set": [SignalsSetRequest, SignalsSetReply];
  "robots.list": [RobotsListRequest, RobotsListReply];
  "robots.describe": [RobotsDescribeRequest, RobotsDescribeReply];
  "robots.load": [RobotsLoadRequest, RobotsLoadReply];
  "controller.describe": [ControllerDescribeRequest, ControllerDescribeReply];
  "kinematics.fk": [KinematicsFkRequest, KinematicsFkReply];
  "kinematics.jacobian": [KinematicsJacobianRequest, KinematicsJacobianReply];
  "kinematics.ik": [KinematicsIkRequest, KinematicsIkReply];
  "shapes.show": [ShapesShowRequest, ShapesShowReply];
  "shapes.meshes": [ShapesMeshesRequest, ShapesMeshesReply];
  "shapes.mesh": [ShapesMeshRequest, ShapesMeshReply];
  "trace.show": [TraceShowRequest, TraceShowReply];
  "trace.clear": [TraceClearRequest, TraceClearReply];
  "access.whoami": [AccessWhoamiRequest, AccessWhoamiReply];
  "access.logout": [AccessLogoutRequest, AccessLogoutReply];
  "access.sessions": [AccessSessionsRequest, AccessSessionsReply];
  "access.exposure": [AccessExposureRequest, AccessExposureReply];
  "access.connections": [AccessConnectionsRequest, AccessConnectionsReply];
  "access.close": [AccessCloseRequest, AccessCloseReply];
  "access.bar": [AccessBarRequest, AccessBarReply];
  "access.unbar": [AccessUnbarRequest, AccessUnbarReply];
  "users.list": [UsersListRequest, UsersListReply];
  "users.remove": [UsersRemoveRequest, UsersRemoveReply];
  "users.set_role": [UsersSetRoleRequest, UsersSetRoleReply];
  "users.disable": [UsersDisableRequest, UsersDisableReply];
  "users.enable": [UsersEnableRequest, UsersEnableReply];
}
