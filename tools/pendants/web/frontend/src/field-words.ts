// Generated from the declarations in simplemsg/ by `make reference`; do not edit.
//
// What stands beside the fields of a frame where it is shown: meanings, units, names of values.
import * as protocol from "./protocol.ts";

/** Values by their names; of single bits where `areBits`. */
export interface ValueNames {
  areBits: boolean;
  named: Readonly<Record<string, number>>;
}

export interface FieldWords {
  meaning: string;
  unit?: string;
  values?: string;
  isSecret?: true;
  /** What the count of the records is called. */
  count?: string;
}

export interface MessageWords {
  about: string;
  /** On the wire, where two messages share it. */
  name?: string;
  fields: Readonly<Record<string, FieldWords>>;
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
  ping: { about: "Asks whether the peer is there.", fields: {} },
  hello: { about: "Opens a conversation; always the first message.", fields: { protocol_version: { meaning: "version of these messages that the pendant speaks" }, state_rate: { meaning: "state messages wanted, 0 for none, else 1 to 125", unit: "Hz" }, cell: { meaning: "name of the cell, empty for the only one" }, client: { meaning: "name of the pendant, shown to others" } } },
  hello_reply: { about: "Welcomes a pendant and announces the limits of the conversation.", name: "hello", fields: { protocol_version: { meaning: "version of these messages that the server speaks" }, session: { meaning: "number of this connection, not 0" }, capabilities: { meaning: "bits: what the server offers", values: "Capability" }, max_frame: { meaning: "largest frame that the server takes", unit: "byte" }, dof: { meaning: "driven joints of the robot" }, tick_rate: { meaning: "the server's control rate", unit: "Hz" }, max_state_rate: { meaning: "fastest state rate", unit: "Hz" }, authority_timeout: { meaning: "the authority expires so long after a beat", unit: "s" }, cell: { meaning: "name of the cell" }, robot: { meaning: "name of the robot" }, server: { meaning: "name and version of the server" } } },
  declare: { about: "Says what else a pendant of version 3 wants; the verdict's value is the ramp time.", fields: { request_id: { meaning: "chosen by the pendant" }, enabling_deadline: { meaning: "enabling is let go so long after its last sign, 0.05 to 0.25; 0 as the cell", unit: "s" }, notices: { meaning: "1 if changes of documents and plans are to be told", values: "Notices" }, language: { meaning: "of the person, as en or de; for the audit log" } } },
  forwarded: { about: "Says for whom a gateway opened this connection; always the very first frame.", fields: { gateway: { meaning: "name of the gateway in the server's configuration" }, secret: { meaning: "its secret, 32 bytes in hexadecimal", isSecret: true }, address: { meaning: "address of the browser, IPv4 or IPv6, without a port" }, is_encrypted: { meaning: "1 if the browser came by TLS, else 0", values: "Encrypted" } } },
  lobby: { about: "Asks which cells there are, before or after hello; once a second.", fields: { request_id: { meaning: "chosen by the pendant" } } },
  lobby_reply: { about: "Tells which cells there are.", name: "lobby", fields: { request_id: { meaning: "of the request" }, body: { meaning: "one JSON object, UTF-8" } } },
  management: { about: "Asks for data that has no fixed layout; the body is one JSON object.", fields: { request_id: { meaning: "chosen by the pendant" }, body: { meaning: "one JSON object, UTF-8" } } },
  verdict: { about: "Answers a request; the header says accepted (success) or refused (failure).", fields: { request_id: { meaning: "of the request" }, code: { meaning: "0 accepted, else an entry of the catalogue", values: "VerdictCode" }, joint: { meaning: "index of the joint at fault, -1 for none" }, value: { meaning: "the value at fault, SI" }, limit: { meaning: "the limit that it breaks, SI" }, text: { meaning: "one sentence with the numbers" } } },
  outcome: { about: "Ends an accepted request: completed or aborted.", fields: { request_id: { meaning: "of the request" }, outcome: { meaning: "1 completed, 2 aborted", values: "OutcomeKind" }, code: { meaning: "0 completed, else an entry of the catalogue", values: "VerdictCode" }, joint: { meaning: "index of the joint at fault, -1 for none" }, value: { meaning: "the value at fault, SI" }, limit: { meaning: "the limit that it breaks, SI" }, plan_time: { meaning: "time that planning took", unit: "s" }, motion_time: { meaning: "planned duration of the motion", unit: "s" }, text: { meaning: "one sentence with the numbers" } } },
  subscribe: { about: "Chooses the rate of state messages.", fields: { request_id: { meaning: "chosen by the pendant" }, state_rate: { meaning: "state messages wanted, 0 for none, else 1 to 125", unit: "Hz" } } },
  authority: { about: "Requests, releases or takes over the motion authority.", fields: { request_id: { meaning: "chosen by the pendant" }, action: { meaning: "1 request, 2 release, 3 take over by role", values: "AuthorityAction" } } },
  authority_beat: { about: "Keeps the motion authority; send one each second while holding it.", fields: {} },
  login: { about: "Shows who is at the pendant, by password or pairing code.", fields: { request_id: { meaning: "chosen by the pendant" }, kind: { meaning: "1 password, 2 pairing code", values: "LoginKind" }, name: { meaning: "account, or the name of a guest" }, secret: { meaning: "password or pairing code", isSecret: true } } },
  set_account: { about: "Adds an account, or gives one another password.", fields: { request_id: { meaning: "chosen by the pendant" }, role: { meaning: "of a new account: 1 viewer, 2 operator, 3 programmer, 4 admin; 0 for a new password", values: "AccountRole" }, name: { meaning: "the account" }, secret: { meaning: "its new password", isSecret: true } } },
  pairing: { about: "Asks for a pairing code of the cell, or ends it and the guests that it let in.", fields: { request_id: { meaning: "chosen by the pendant" }, action: { meaning: "1 issue, 2 withdraw", values: "PairingAction" } } },
  pairing_reply: { about: "Tells the pairing code to whoever asked for it.", name: "pairing", fields: { request_id: { meaning: "of the request" }, lifetime: { meaning: "the code ends so long after this reply", unit: "s" }, code: { meaning: "as a teacher shows it", isSecret: true } } },
  joint_move: { about: "Moves all joints to a position, in a straight joint line.", fields: { request_id: { meaning: "chosen by the pendant" }, speed: { meaning: "fraction of the joints' largest speed, above 0, up to 1" }, joint_count: { meaning: "slots that are meant; must be the robot's driven joints" }, joints: { meaning: "target positions, unused slots 0", unit: "rad, m for a linear axis" } } },
  pose_move: { about: "Moves the tool to a pose, by PTP or in a straight line.", fields: { request_id: { meaning: "chosen by the pendant" }, motion: { meaning: "1 PTP, 2 LIN", values: "Motion" }, speed: { meaning: "fraction of the joints' largest speed, above 0, up to 1" }, frame: { meaning: "frame of the pose: base or root" }, position: { meaning: "x, y, z of the tool", unit: "m" }, orientation: { meaning: "quaternion x, y, z, w" } } },
  joint_path: { about: "Moves through joint positions without stopping.", fields: { request_id: { meaning: "chosen by the pendant" }, speed: { meaning: "fraction of the joints' largest speed, above 0, up to 1" }, joint_count: { meaning: "slots that are meant; must be the robot's driven joints" }, joints: { meaning: "joint positions, unused slots 0", unit: "rad, m for a linear axis" }, waypoints: { meaning: "the waypoints in order", count: "count" } } },
  pose_path: { about: "Moves the tool through poses.", fields: { request_id: { meaning: "chosen by the pendant" }, motion: { meaning: "1 PTP, 2 LIN", values: "Motion" }, speed: { meaning: "fraction of the joints' largest speed, above 0, up to 1" }, frame: { meaning: "frame of the poses: base or root" }, position: { meaning: "x, y, z of the tool", unit: "m" }, orientation: { meaning: "quaternion x, y, z, w" }, waypoints: { meaning: "the waypoints in order", count: "count" } } },
  software_stop: { about: "Stops the robot and latches; anyone may send it.", fields: { request_id: { meaning: "chosen by the pendant" }, reason: { meaning: "shown to others" } } },
  reset_stop: { about: "Unlatches the software stop; moves nothing.", fields: { request_id: { meaning: "chosen by the pendant" } } },
  enabling: { about: "TRAINING: position of the enabling device; repeat it every 50 ms while it is held.", fields: { position: { meaning: "0 released, 1 held, 2 panic", values: "EnablingPosition" } } },
  set_mode: { about: "Sets the mode of operation; stops what moves.", fields: { request_id: { meaning: "chosen by the pendant" }, mode: { meaning: "1 manual reduced speed, 2 manual high speed, 3 automatic, 4 recovery", values: "OperatingMode" } } },
  set_speed: { about: "Sets the speed override and the cap of the tool speed.", fields: { request_id: { meaning: "chosen by the pendant" }, override: { meaning: "fraction of the planned speed, 0.001 to 1; 0 pauses what moves" }, tool_speed: { meaning: "cap of tool and elbow, 0 to leave it as it is; in automatic only 0", unit: "m/s" } } },
  motion_control: { about: "Pauses, resumes or ends the motion or the program.", fields: { request_id: { meaning: "chosen by the pendant" }, action: { meaning: "1 pause, 2 resume, 3 program stop", values: "MotionControlAction" } } },
  jog_start: { about: "Begins a jog that lasts as long as its press is beaten.", fields: { request_id: { meaning: "chosen by the pendant" }, press: { meaning: "number of the press, higher than any before on this connection" }, state_sequence: { meaning: "sequence of a state message that came of late" }, deadline: { meaning: "the jog ends so long after a beat, 0.05 to 0.25", unit: "s" }, space: { meaning: "1 joints, 2 tool", values: "JogSpace" }, frame: { meaning: "tool jog: frame of the axes; base, tool or a named one" }, value_count: { meaning: "slots that are meant: driven joints, or 6 for the tool" }, values: { meaning: "-1 to 1: parts of the jog speed; tool: x, y, z, then about x, y, z" } } },
  jog_beat: { about: "Keeps a press alive; send one every 50 ms.", fields: { press: { meaning: "number of the press" }, beat: { meaning: "counts the beats of the press, from 1" } } },
  jog_release: { about: "Ends a press: the robot ramps to rest at once.", fields: { request_id: { meaning: "chosen by the pendant" }, press: { meaning: "number of the press" } } },
  jog_step: { about: "Moves by one increment, in a straight line.", fields: { request_id: { meaning: "chosen by the pendant" }, speed: { meaning: "fraction of the jog speed, above 0, up to 1" }, space: { meaning: "1 joints, 2 tool", values: "JogSpace" }, frame: { meaning: "tool step: frame of the axes; base, tool or a named one" }, value_count: { meaning: "slots that are meant: driven joints, or 6 for the tool" }, values: { meaning: "increments; tool: x, y, z, then about x, y, z", unit: "rad, m" } } },
  jog_undo: { about: "Moves back along the way of the last jog.", fields: { request_id: { meaning: "chosen by the pendant" }, speed: { meaning: "fraction of the jog speed, above 0, up to 1" } } },
  program_run: { about: "Runs a stored program, or one step of it.", fields: { request_id: { meaning: "chosen by the pendant" }, run: { meaning: "1 all, 2 step forward, 3 step backward", values: "RunKind" }, line: { meaning: "line to begin at, 0 for the first; 0 on a paused program resumes it" }, loops: { meaning: "how often, 0 for until it is stopped; to resume: as begun" }, revision: { meaning: "revision to run, 0 for the newest or that under way" }, speed: { meaning: "fraction of the programmed speeds, above 0, up to 1" }, program: { meaning: "name of the program" } } },
  home: { about: "Moves all joints to a named position of the robot or the cell.", fields: { request_id: { meaning: "chosen by the pendant" }, speed: { meaning: "fraction of the joints' largest speed, above 0, up to 1" }, target: { meaning: "a named position, such as home or zero; see positions.list" } } },
  execute: { about: "Executes a plan, sample by sample, as it was shown.", fields: { request_id: { meaning: "chosen by the pendant" }, plan: { meaning: "number of the plan" }, override_is_one: { meaning: "1 to be refused unless the speed override is 1, else 0" } } },
  plan_changed: { about: "A plan is being made, or has changed its state.", fields: { plan: { meaning: "number of the plan" }, state: { meaning: "what has become of it", values: "PlanState" }, code: { meaning: "why, an entry of the catalogue; 0 for nothing", values: "VerdictCode" }, stage: { meaning: "how far the planning has come", values: "PlanStage" }, fraction: { meaning: "of the time that planning may take, 0 to 1" }, text: { meaning: "one sentence, empty for none" } } },
  prepare: { about: "Prepares the controller, or takes a single step of that, where its dialect has one.", fields: { request_id: { meaning: "chosen by the pendant" }, action: { meaning: "1 prepare, 2 release; single steps: 3 alarms, 4 drives on, 5 drives off", values: "PrepareAction" }, token: { meaning: "of the verdict CONFIRM_FIRST, 0 at the first asking" } } },
  state: { about: "State of the cell, at the rate that the pendant chose.", fields: { sequence: { meaning: "counts the cell's state messages; a listener may see gaps" }, time_s: { meaning: "the server's monotonic time, whole seconds", unit: "s" }, time_ns: { meaning: "the server's monotonic time, rest", unit: "ns" }, age: { meaning: "age of the controller's last report, -1 before the first", unit: "s" }, dropped: { meaning: "state messages that this connection was too slow for" }, activity: { meaning: "what the cell does; 6: about to be paused", values: "Activity" }, request_id: { meaning: "request that is planned or moving, 0 for none" }, holder: { meaning: "session that holds the motion authority, 0 for none" }, stop: { meaning: "latched stop: 0 none, 1 software, 2 protective", values: "StopKind" }, operating_mode: { meaning: "the server's own mode", values: "OperatingMode" }, enabling: { meaning: "the authority's enabling device (training)", values: "EnablingPosition" }, override: { meaning: "speed override, 0 to 1" }, tool_speed_cap: { meaning: "cap of tool and elbow, 0 for none", unit: "m/s" }, jog_scale: { meaning: "part of the asked jog speed that is driven, 0 to 1" }, jog_reason: { meaning: "why it is less than 1", values: "JogReason" }, jog_joint: { meaning: "joint at fault, -1 for none" }, program_state: { meaning: "what the program is doing", values: "ProgramState" }, program_line: { meaning: "its current line, 0 for none" }, link: { meaning: "controller connection: 0 down, 1 up, 2 stale", values: "LinkState" }, drives_powered: { meaning: "the controller's own, -1 unknown", values: "TriState" }, e_stopped: { meaning: "the controller's own, -1 unknown", values: "TriState" }, error_code: { meaning: "the controller's own, 0 for none" }, in_error: { meaning: "the controller's own, -1 unknown", values: "TriState" }, in_motion: { meaning: "the controller's own, -1 unknown", values: "TriState" }, mode: { meaning: "the controller's own: -1 unknown, 1 manual, 2 automatic", values: "ControllerMode" }, motion_possible: { meaning: "the controller's own, -1 unknown", values: "TriState" }, valid_fields: { meaning: "bits: 2 positions, 4 velocities, 16 tool", values: "StateField" }, tool_speed: { meaning: "speed of the tool", unit: "m/s" }, positions: { meaning: "joint positions", unit: "rad, m for a linear axis" }, velocities: { meaning: "joint velocities", unit: "rad/s, m/s" }, tool_position: { meaning: "x, y, z of the tool in base", unit: "m" }, tool_orientation: { meaning: "quaternion x, y, z, w of the tool in base" } } },
  authority_changed: { about: "The motion authority changed hands.", fields: { holder: { meaning: "session that holds it now, 0 for nobody" }, reason: { meaning: "1 granted, 2 released, 3 expired, 4 connection lost, 5 taken over, 6 logged out, 7 role lost", values: "AuthorityReason" }, client: { meaning: "name of the new holder's pendant" } } },
  stop_changed: { about: "A stop was latched or reset.", fields: { stop: { meaning: "latched stop: 0 none, 1 software, 2 protective", values: "StopKind" }, session: { meaning: "who did it, 0 for the server itself" }, client: { meaning: "name of that pendant" }, reason: { meaning: "as given" } } },
  authority_wanted: { about: "Somebody asked for the authority that you hold.", fields: { session: { meaning: "who asked" }, client: { meaning: "name of that pendant" } } },
  mode_changed: { about: "The mode of operation changed.", fields: { mode: { meaning: "the mode now", values: "OperatingMode" }, session: { meaning: "who did it, 0 for the controller" }, client: { meaning: "name of that pendant" } } },
  jog_ended: { about: "A press ended and the robot came to rest.", fields: { press: { meaning: "number of the press" }, reason: { meaning: "why it ended", values: "JogEnd" }, stop_time: { meaning: "from the end of the press to rest or a new press, as sent", unit: "s" }, joint_distance: { meaning: "farthest that a joint went in that time", unit: "rad, m" }, tool_distance: { meaning: "way of the tool in that time", unit: "m" }, positions: { meaning: "where the joints stand", unit: "rad, m for a linear axis" } } },
  program_report: { about: "A program came to another line, paused or ended.", fields: { state: { meaning: "what it is doing", values: "ProgramState" }, line: { meaning: "its current line, 0 for none" }, loop: { meaning: "which run of it this is, from 1" }, revision: { meaning: "revision of that program in this run" }, program: { meaning: "name of the program" }, text: { meaning: "one sentence, empty for none" } } },
  controller_changed: { about: "What is known of the controller changed.", fields: { prepared: { meaning: "0 no, 1 yes, 2 not needed", values: "Preparedness" }, identity: { meaning: "0 unverified, 1 match, 2 mismatch", values: "ControllerIdentity" }, is_emulated: { meaning: "1 where it is known to be emulated" }, declaration: { meaning: "counts the changes of what controller.describe tells, from 1" } } },
  document_changed: { about: "A document of the cell, or what its signals are, changed; for whoever declared the wish.", fields: { kind: { meaning: "what changed; 0: look at everything", values: "NoticeKind" }, revision: { meaning: "the one that is kept now, 0 where it was deleted" }, session: { meaning: "connection that changed it, 0 for the server" }, what: { meaning: "1 new, 2 changed, 3 renamed, 4 deleted", values: "Change" }, name: { meaning: "of the document" }, from_name: { meaning: "its former name where it was renamed" }, client: { meaning: "name of whoever changed it" } } },
  operator_event: { about: "TRAINING: what a person does at an emulated controller; a real one refuses it. Action 3 does nothing: a success says that the controller is emulated. The server asks that once at each connect, on the state connection only.", fields: { action: { meaning: "1 emergency stop, 2 reset, 3 identify", values: "OperatorAction" } } },
  read_signals: { about: "Asks for sixteen digital inputs and outputs; on the motion or the state connection.", fields: { first: { meaning: "number of the first signal: 0, 16, 32, …" } } },
  read_signals_reply: { about: "Sixteen digital inputs and outputs, and how many of each there are.", name: "read_signals", fields: { first: { meaning: "number of the first signal, as asked" }, inputs: { meaning: "bits: the inputs" }, outputs: { meaning: "bits: the outputs" }, input_count: { meaning: "inputs in all" }, output_count: { meaning: "outputs in all" } } },
  write_outputs: { about: "Sets some of sixteen digital outputs; refused where there is no such output.", fields: { first: { meaning: "number of the first signal: 0, 16, 32, …" }, mask: { meaning: "bits: the outputs that are set" }, values: { meaning: "bits: their values" } } },
  set_inputs: { about: "TRAINING: sets inputs of an emulated controller, as its cabling would.", fields: { first: { meaning: "number of the first signal: 0, 16, 32, …" }, mask: { meaning: "bits: the inputs that are set" }, values: { meaning: "bits: their values" } } },
};
