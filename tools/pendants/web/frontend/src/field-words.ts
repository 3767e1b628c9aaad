// Generated from the declarations in simplemsg/ by `make reference`; do not edit.
//
// What stands beside the fields of a frame where it is shown: units, names of values.
import * as protocol from "./protocol.ts";

/** Values by their names; of single bits where `areBits`. */
export interface ValueNames {
  areBits: boolean;
  named: Readonly<Record<string, number>>;
}

export interface FieldWords {
  unit?: string;
  values?: string;
  isSecret?: true;
  /** What the count of the records is called. */
  count?: string;
}

export interface MessageWords {
  /** On the wire, where two messages share it. */
  name?: string;
  /** Those beside which something stands. */
  fields?: Readonly<Record<string, FieldWords>>;
}

export const VALUE_NAMES: Readonly<Record<string, ValueNames>> = {
  Capability: { areBits: true, named: protocol.Capability },
  Notices: { areBits: false, named: protocol.Notices },
  Encrypted: { areBits: false, named: protocol.Encrypted },
  VerdictCode: { areBits: false, named: protocol.VerdictCode },
  OutcomeKind: { areBits: false, named: protocol.OutcomeKind },
  AuthorityAction: { areBits: false, named: protocol.AuthorityAction },
  LoginKind: { areBits: false, named: protocol.LoginKind },
  AccountRole: { areBits: false, named: protocol.AccountRole },
  PairingAction: { areBits: false, named: protocol.PairingAction },
  Motion: { areBits: false, named: protocol.Motion },
  EnablingPosition: { areBits: false, named: protocol.EnablingPosition },
  OperatingMode: { areBits: false, named: protocol.OperatingMode },
  MotionControlAction: { areBits: false, named: protocol.MotionControlAction },
  JogSpace: { areBits: false, named: protocol.JogSpace },
  RunKind: { areBits: false, named: protocol.RunKind },
  PlanState: { areBits: false, named: protocol.PlanState },
  PlanStage: { areBits: false, named: protocol.PlanStage },
  PrepareAction: { areBits: false, named: protocol.PrepareAction },
  Activity: { areBits: false, named: protocol.Activity },
  StopKind: { areBits: false, named: protocol.StopKind },
  JogReason: { areBits: false, named: protocol.JogReason },
  ProgramState: { areBits: false, named: protocol.ProgramState },
  LinkState: { areBits: false, named: protocol.LinkState },
  TriState: { areBits: false, named: protocol.TriState },
  ControllerMode: { areBits: false, named: protocol.ControllerMode },
  StateField: { areBits: true, named: protocol.StateField },
  AuthorityReason: { areBits: false, named: protocol.AuthorityReason },
  JogEnd: { areBits: false, named: protocol.JogEnd },
  Preparedness: { areBits: false, named: protocol.Preparedness },
  ControllerIdentity: { areBits: false, named: protocol.ControllerIdentity },
  NoticeKind: { areBits: false, named: protocol.NoticeKind },
  Change: { areBits: false, named: protocol.Change },
  OperatorAction: { areBits: false, named: protocol.OperatorAction },
};

export const WORDS: Readonly<Record<string, MessageWords>> = {
  hello: { fields: { state_rate: { unit: "Hz" } } },
  hello_reply: { name: "hello", fields: { capabilities: { values: "Capability" }, max_frame: { unit: "byte" }, tick_rate: { unit: "Hz" }, max_state_rate: { unit: "Hz" }, authority_timeout: { unit: "s" } } },
  declare: { fields: { enabling_deadline: { unit: "s" }, notices: { values: "Notices" } } },
  forwarded: { fields: { secret: { isSecret: true }, is_encrypted: { values: "Encrypted" } } },
  lobby_reply: { name: "lobby" },
  verdict: { fields: { code: { values: "VerdictCode" } } },
  outcome: { fields: { outcome: { values: "OutcomeKind" }, code: { values: "VerdictCode" }, plan_time: { unit: "s" }, motion_time: { unit: "s" } } },
  subscribe: { fields: { state_rate: { unit: "Hz" } } },
  authority: { fields: { action: { values: "AuthorityAction" } } },
  login: { fields: { kind: { values: "LoginKind" }, secret: { isSecret: true } } },
  set_account: { fields: { role: { values: "AccountRole" }, secret: { isSecret: true } } },
  pairing: { fields: { action: { values: "PairingAction" } } },
  pairing_reply: { name: "pairing", fields: { lifetime: { unit: "s" }, code: { isSecret: true } } },
  joint_move: { fields: { joints: { unit: "rad, m for a linear axis" } } },
  pose_move: { fields: { motion: { values: "Motion" }, position: { unit: "m" } } },
  joint_path: { fields: { joints: { unit: "rad, m for a linear axis" }, waypoints: { count: "count" } } },
  pose_path: { fields: { motion: { values: "Motion" }, position: { unit: "m" }, waypoints: { count: "count" } } },
  enabling: { fields: { position: { values: "EnablingPosition" } } },
  set_mode: { fields: { mode: { values: "OperatingMode" } } },
  set_speed: { fields: { tool_speed: { unit: "m/s" } } },
  motion_control: { fields: { action: { values: "MotionControlAction" } } },
  jog_start: { fields: { deadline: { unit: "s" }, space: { values: "JogSpace" } } },
  jog_step: { fields: { space: { values: "JogSpace" }, values: { unit: "rad, m" } } },
  program_run: { fields: { run: { values: "RunKind" } } },
  plan_changed: { fields: { state: { values: "PlanState" }, code: { values: "VerdictCode" }, stage: { values: "PlanStage" } } },
  prepare: { fields: { action: { values: "PrepareAction" } } },
  state: { fields: { time_s: { unit: "s" }, time_ns: { unit: "ns" }, age: { unit: "s" }, activity: { values: "Activity" }, stop: { values: "StopKind" }, operating_mode: { values: "OperatingMode" }, enabling: { values: "EnablingPosition" }, tool_speed_cap: { unit: "m/s" }, jog_reason: { values: "JogReason" }, program_state: { values: "ProgramState" }, link: { values: "LinkState" }, drives_powered: { values: "TriState" }, e_stopped: { values: "TriState" }, in_error: { values: "TriState" }, in_motion: { values: "TriState" }, mode: { values: "ControllerMode" }, motion_possible: { values: "TriState" }, valid_fields: { values: "StateField" }, tool_speed: { unit: "m/s" }, positions: { unit: "rad, m for a linear axis" }, velocities: { unit: "rad/s, m/s" }, tool_position: { unit: "m" } } },
  authority_changed: { fields: { reason: { values: "AuthorityReason" } } },
  stop_changed: { fields: { stop: { values: "StopKind" } } },
  mode_changed: { fields: { mode: { values: "OperatingMode" } } },
  jog_ended: { fields: { reason: { values: "JogEnd" }, stop_time: { unit: "s" }, joint_distance: { unit: "rad, m" }, tool_distance: { unit: "m" }, positions: { unit: "rad, m for a linear axis" } } },
  program_report: { fields: { state: { values: "ProgramState" } } },
  controller_changed: { fields: { prepared: { values: "Preparedness" }, identity: { values: "ControllerIdentity" } } },
  document_changed: { fields: { kind: { values: "NoticeKind" }, what: { values: "Change" } } },
  operator_event: { fields: { action: { values: "OperatorAction" } } },
  read_signals_reply: { name: "read_signals" },
};
