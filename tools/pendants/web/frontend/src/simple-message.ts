// Generated from the declarations in simplemsg/ by `make reference`; do not edit.
//
// The messages of controllers: those of the standard and Motoman's.
import type { Bare, Header, Layouts, Opaque } from "./codec.ts";

/** One point of a JOINT_TRAJ; the same fields as a JOINT_TRAJ_PT. */
export interface TrajPoint {
  /** index of the point from 0, or a special sequence */
  sequence: number;
  /** target positions, unused slots 0 [rad, m for a linear axis] */
  joints: number[];
  /** fraction of the largest joint speed, 0 to 1 */
  velocity: number;
  /** time allotted to this segment, not a time stamp [s] */
  duration: number;
}

/** One group's share of a 2016 or 2017 message. */
export interface MotomanGroup {
  /** group number */
  robot_id: number;
  /** bits: 1 time, 2 position, 4 velocity, 8 acceleration */
  valid_fields: number;
  /** time from the start of the trajectory [s] */
  time: number;
  /** joint positions [rad, m for a linear axis] */
  positions: number[];
  /** joint velocities [rad/s, m/s] */
  velocities: number[];
  /** joint accelerations [rad/s², m/s²] */
  accelerations: number[];
}

/** 1, either way. Asks whether the peer is there. */
export interface Ping extends Header {
  type: "ping";
}

/** 2, client to controller. Asks for the version of the controller's server program. */
export interface GetVersion extends Header {
  type: "get_version";
}

/** 2, controller to client. Version of the controller's server program. */
export interface GetVersionReply extends Header {
  type: "get_version_reply";
  /** major version */
  major: number;
  /** minor version */
  minor: number;
  /** patch level */
  patch: number;
}

/** 10, controller to client. Where the joints stand; the only joint state that the generic ROS-I client decodes. */
export interface JointPosition extends Header {
  type: "joint_position";
  /** 0 when reporting state */
  sequence: number;
  /** joint positions, unused slots 0 [rad, m for a linear axis] */
  joints: number[];
}

/** 11, client to controller. One trajectory point; request when streaming, topic when downloading. */
export interface JointTrajPt extends Header {
  type: "joint_traj_pt";
  /** index of the point from 0, or a special sequence */
  sequence: number;
  /** target positions, unused slots 0 [rad, m for a linear axis] */
  joints: number[];
  /** fraction of the largest joint speed, 0 to 1 */
  velocity: number;
  /** time allotted to this segment, not a time stamp [s] */
  duration: number;
}

/** 12, client to controller. A whole trajectory; deprecated, no vendor's server is known to take it. */
export interface JointTraj extends Header {
  type: "joint_traj";
  /** the points in order */
  points: TrajPoint[];
}

/** 13, controller to client. State of the controller as a whole. */
export interface Status extends Header {
  type: "status";
  /** tri-state: motors have power */
  drives_powered: number;
  /** tri-state: an emergency stop is active */
  e_stopped: number;
  /** the controller's own error number, 0 for none; from a pendant server also 1,000,000 + a verdict of its own */
  error_code: number;
  /** tri-state: an error is active */
  in_error: number;
  /** tri-state: the robot moves */
  in_motion: number;
  /** -1 unknown, 1 manual, 2 automatic */
  mode: number;
  /** tri-state: a new trajectory would start now */
  motion_possible: number;
}

/** 14, client to controller. One trajectory point with velocity, acceleration and time. */
export interface JointTrajPtFull extends Header {
  type: "joint_traj_pt_full";
  /** robot or group number, zero based */
  robot_id: number;
  /** index of the point from 0, or a special sequence */
  sequence: number;
  /** bits: 1 time, 2 position, 4 velocity, 8 acceleration */
  valid_fields: number;
  /** time from the start of the trajectory [s] */
  time: number;
  /** joint positions [rad, m for a linear axis] */
  positions: number[];
  /** joint velocities [rad/s, m/s] */
  velocities: number[];
  /** joint accelerations [rad/s², m/s²] */
  accelerations: number[];
}

/** 15, controller to client. Where the joints stand and how they move. */
export interface JointFeedback extends Header {
  type: "joint_feedback";
  /** robot or group number, zero based */
  robot_id: number;
  /** bits: 1 time, 2 position, 4 velocity, 8 acceleration */
  valid_fields: number;
  /** the controller's time, where it has one [s] */
  time: number;
  /** joint positions [rad, m for a linear axis] */
  positions: number[];
  /** joint velocities [rad/s, m/s] */
  velocities: number[];
  /** joint accelerations [rad/s², m/s²] */
  accelerations: number[];
}

/** 2001, client to controller. Starts, stops or asks about motion. */
export interface MotomanMotionCtrl extends Header {
  type: "motoman_motion_ctrl";
  /** group number */
  robot_id: number;
  /** echoed in the reply */
  sequence: number;
  /** what to do */
  command: number;
  /** unused, 0 */
  data: number[];
}

/** 2002, controller to client. Verdict on 14, 2001, 2016 and 2018. */
export interface MotomanMotionReply extends Header {
  type: "motoman_motion_reply";
  /** group number */
  robot_id: number;
  /** sequence of the request */
  sequence: number;
  /** command of the request, or its message type */
  command: number;
  /** 0 success, 1 busy, else why not */
  result: number;
  /** reason; of CHECK_QUEUE_CNT: increments still queued */
  subcode: number;
  /** unused, 0 */
  data: number[];
}

/** 2003, client to controller. Reads one bit. */
export interface MotomanReadSingleIo extends Header {
  type: "motoman_read_single_io";
  /** address of the bit */
  address: number;
}

/** 2004, controller to client. Value of one bit. */
export interface MotomanReadSingleIoReply extends Header {
  type: "motoman_read_single_io_reply";
  /** 0 or 1 */
  value: number;
  /** 0 success, 1001 and up failed */
  result_code: number;
}

/** 2005, client to controller. Writes one bit. */
export interface MotomanWriteSingleIo extends Header {
  type: "motoman_write_single_io";
  /** address of the bit */
  address: number;
  /** 0 or 1 */
  value: number;
}

/** 2006, controller to client. Verdict on writing one bit. */
export interface MotomanWriteSingleIoReply extends Header {
  type: "motoman_write_single_io_reply";
  /** 0 success, 1001 and up failed */
  result_code: number;
}

/** 2007, client to controller. Reads eight bits. */
export interface MotomanReadGroupIo extends Header {
  type: "motoman_read_group_io";
  /** address of the group: bit address / 10 */
  address: number;
}

/** 2008, controller to client. Value of eight bits. */
export interface MotomanReadGroupIoReply extends Header {
  type: "motoman_read_group_io_reply";
  /** 0 to 255 */
  value: number;
  /** 0 success, 1001 and up failed */
  result_code: number;
}

/** 2009, client to controller. Writes eight bits. */
export interface MotomanWriteGroupIo extends Header {
  type: "motoman_write_group_io";
  /** address of the group: bit address / 10 */
  address: number;
  /** 0 to 255 */
  value: number;
}

/** 2010, controller to client. Verdict on writing eight bits. */
export interface MotomanWriteGroupIoReply extends Header {
  type: "motoman_write_group_io_reply";
  /** 0 success, 1001 and up failed */
  result_code: number;
}

/** 2012, client to controller. Reads a register. */
export interface MotomanReadMregister extends Header {
  type: "motoman_read_mregister";
  /** register number, 0 to 999 */
  address: number;
}

/** 2012, controller to client. Value of a register. */
export interface MotomanReadMregisterReply extends Header {
  type: "motoman_read_mregister_reply";
  /** 0 to 65535 */
  value: number;
  /** 0 success, 1001 and up failed */
  result_code: number;
}

/** 2013, client to controller. Writes a register. */
export interface MotomanWriteMregister extends Header {
  type: "motoman_write_mregister";
  /** register number, 0 to 559 */
  address: number;
  /** 0 to 65535 */
  value: number;
}

/** 2013, controller to client. Verdict on writing a register. */
export interface MotomanWriteMregisterReply extends Header {
  type: "motoman_write_mregister_reply";
  /** 0 success, 1001 and up failed */
  result_code: number;
}

/** 2016, client to controller. One trajectory point of several groups; exactly num_groups records, or four. */
export interface MotomanJointTrajPtFullEx extends Header {
  type: "motoman_joint_traj_pt_full_ex";
  /** groups that are meant */
  num_groups: number;
  /** index of the point from 0 */
  sequence: number;
  /** a record for each group */
  groups: MotomanGroup[];
}

/** 2017, controller to client. Joint state of several groups; always four records. */
export interface MotomanJointFeedbackEx extends Header {
  type: "motoman_joint_feedback_ex";
  /** groups that are meant */
  num_groups: number;
  /** a record for each group */
  groups: MotomanGroup[];
}

/** 2018, client to controller. Selects a tool file. */
export interface MotomanSelectTool extends Header {
  type: "motoman_select_tool";
  /** group number */
  group: number;
  /** tool file, 0 to 63 */
  tool: number;
  /** echoed in the reply */
  sequence: number;
}

/** 2020, client to controller. Asks for the Denavit-Hartenberg parameters. */
export interface MotomanGetDhParameters extends Header {
  type: "motoman_get_dh_parameters";
}

/** 2020, controller to client. Denavit-Hartenberg parameters. */
export interface MotomanGetDhParametersReply extends Header {
  type: "motoman_get_dh_parameters_reply";
  /** theta, d, a, alpha of each link of each group [not stated by the vendor] */
  groups: number[];
}

export type ControllerMessage =
  | Ping
  | GetVersion
  | GetVersionReply
  | JointPosition
  | JointTrajPt
  | JointTraj
  | Status
  | JointTrajPtFull
  | JointFeedback
  | MotomanMotionCtrl
  | MotomanMotionReply
  | MotomanReadSingleIo
  | MotomanReadSingleIoReply
  | MotomanWriteSingleIo
  | MotomanWriteSingleIoReply
  | MotomanReadGroupIo
  | MotomanReadGroupIoReply
  | MotomanWriteGroupIo
  | MotomanWriteGroupIoReply
  | MotomanReadMregister
  | MotomanReadMregisterReply
  | MotomanWriteMregister
  | MotomanWriteMregisterReply
  | MotomanJointTrajPtFullEx
  | MotomanJointFeedbackEx
  | MotomanSelectTool
  | MotomanGetDhParameters
  | MotomanGetDhParametersReply
  | Bare
  | Opaque;

export const LAYOUTS: Layouts = {
  ping: [1, "ignored", ""],
  get_version: [2, "request", ""],
  get_version_reply: [2, "answer", "major:i minor:i patch:i"],
  joint_position: [10, "topic", "sequence:i joints:R10"],
  joint_traj_pt: [11, "request", "sequence:i joints:R10 velocity:r duration:r"],
  joint_traj: [12, "request", "", { name: "points", of: "sequence:i joints:R10 velocity:r duration:r", count: "after", least: 1, most: 200 }],
  status: [13, "topic", "drives_powered:i e_stopped:i error_code:i in_error:i in_motion:i mode:i motion_possible:i"],
  joint_traj_pt_full: [14, "request", "robot_id:i sequence:i valid_fields:i time:r positions:R10 velocities:R10 accelerations:R10"],
  joint_feedback: [15, "topic", "robot_id:i valid_fields:i time:r positions:R10 velocities:R10 accelerations:R10"],
  motoman_motion_ctrl: [2001, "request", "robot_id:i sequence:i command:i data:R10"],
  motoman_motion_reply: [2002, "reply", "robot_id:i sequence:i command:i result:i subcode:i data:R10"],
  motoman_read_single_io: [2003, "request", "address:i"],
  motoman_read_single_io_reply: [2004, "reply", "value:i result_code:i"],
  motoman_write_single_io: [2005, "request", "address:i value:i"],
  motoman_write_single_io_reply: [2006, "reply", "result_code:i"],
  motoman_read_group_io: [2007, "request", "address:i"],
  motoman_read_group_io_reply: [2008, "reply", "value:i result_code:i"],
  motoman_write_group_io: [2009, "request", "address:i value:i"],
  motoman_write_group_io_reply: [2010, "reply", "result_code:i"],
  motoman_read_mregister: [2012, "request", "address:i"],
  motoman_read_mregister_reply: [2012, "answer", "value:i result_code:i"],
  motoman_write_mregister: [2013, "request", "address:i value:i"],
  motoman_write_mregister_reply: [2013, "answer", "result_code:i"],
  motoman_joint_traj_pt_full_ex: [2016, "request", "num_groups:i sequence:i", { name: "groups", of: "robot_id:i valid_fields:i&15 time:r positions:R10 velocities:R10 accelerations:R10", count: "none", least: 1, most: 4, meant: "num_groups" }],
  motoman_joint_feedback_ex: [2017, "topic", "num_groups:i", { name: "groups", of: "robot_id:i valid_fields:i&15 time:r positions:R10 velocities:R10 accelerations:R10", count: "none", least: 4, most: 4 }],
  motoman_select_tool: [2018, "request", "group:i tool:i sequence:i"],
  motoman_get_dh_parameters: [2020, "request", ""],
  motoman_get_dh_parameters_reply: [2020, "answer", "groups:R128"],
};
