-- Generated from the declarations in simplemsg/ by `make reference`; do not edit.
-- A Wireshark dissector of ROS-Industrial simple message: standard, Motoman and pendant
-- messages. Run `wireshark -X lua_script:openpendant.lua`, or put it into the folder
-- of personal Lua plugins.

local DEFAULT_PORTS = "11000,11002,11010,12000,12002,50240-50242"
local TYPE_NAMES = { [65112] = "set_inputs", [65111] = "write_outputs", [65110] = "read_signals", [65100] = "operator_event", [65055] = "document_changed", [65043] = "controller_changed", [65026] = "program_report", [65025] = "jog_ended", [65024] = "mode_changed", [65023] = "authority_wanted", [65022] = "stop_changed", [65021] = "authority_changed", [65020] = "state", [65042] = "prepare", [65054] = "plan_changed", [65053] = "execute", [65041] = "home", [65040] = "program_run", [65034] = "jog_undo", [65033] = "jog_step", [65032] = "jog_release", [65031] = "jog_beat", [65030] = "jog_start", [65019] = "motion_control", [65018] = "set_speed", [65017] = "set_mode", [65016] = "enabling", [65015] = "reset_stop", [65014] = "software_stop", [65013] = "pose_path", [65012] = "joint_path", [65011] = "pose_move", [65010] = "joint_move", [65009] = "pairing", [65008] = "set_account", [65007] = "login", [65006] = "authority_beat", [65005] = "authority", [65004] = "subscribe", [65003] = "outcome", [65002] = "verdict", [65001] = "management", [65052] = "lobby", [65050] = "forwarded", [65051] = "declare", [65000] = "hello", [2020] = "motoman_get_dh_parameters", [2018] = "motoman_select_tool", [2017] = "motoman_joint_feedback_ex", [2016] = "motoman_joint_traj_pt_full_ex", [2013] = "motoman_write_mregister", [2012] = "motoman_read_mregister", [2010] = "motoman_write_group_io_reply", [2009] = "motoman_write_group_io", [2008] = "motoman_read_group_io_reply", [2007] = "motoman_read_group_io", [2006] = "motoman_write_single_io_reply", [2005] = "motoman_write_single_io", [2004] = "motoman_read_single_io_reply", [2003] = "motoman_read_single_io", [2002] = "motoman_motion_reply", [2001] = "motoman_motion_ctrl", [15] = "joint_feedback", [14] = "joint_traj_pt_full", [13] = "status", [12] = "joint_traj", [11] = "joint_traj_pt", [10] = "joint_position", [2] = "get_version", [1] = "ping", [20] = "read_input", [21] = "write_output" }
local NAMED_OPAQUE = { [20] = "read_input", [21] = "write_output" }
local VALUES = {
  SpecialSequence = { [-1] = "START_DOWNLOAD", [-2] = "START_STREAMING", [-3] = "END", [-4] = "STOP" },
  TriState = { [-1] = "UNKNOWN", [0] = "FALSE", [1] = "TRUE" },
  ControllerMode = { [-1] = "UNKNOWN", [1] = "MANUAL", [2] = "AUTO" },
  ValidField = { { 1, "TIME" }, { 2, "POSITION" }, { 4, "VELOCITY" }, { 8, "ACCELERATION" } },
  MotionCommand = { [200101] = "CHECK_MOTION_READY", [200102] = "CHECK_QUEUE_CNT", [200111] = "STOP_MOTION", [200112] = "START_SERVOS", [200113] = "STOP_SERVOS", [200114] = "RESET_ALARM", [200121] = "START_TRAJ_MODE", [200122] = "STOP_TRAJ_MODE", [200130] = "DISCONNECT" },
  MotionResult = { [0] = "SUCCESS", [1] = "BUSY", [2] = "FAILURE", [3] = "INVALID", [4] = "ALARM", [5] = "NOT_READY", [6] = "MP_FAILURE" },
  Subcode = { [3000] = "INVALID_UNSPECIFIED", [3001] = "INVALID_MESSAGE_SIZE", [3002] = "INVALID_HEADER", [3003] = "INVALID_MESSAGE_TYPE", [3004] = "INVALID_GROUP", [3005] = "INVALID_SEQUENCE", [3006] = "INVALID_COMMAND", [3010] = "INVALID_DATA", [3011] = "INVALID_START_POSITION", [3012] = "INVALID_POSITION", [3013] = "INVALID_SPEED", [3014] = "INVALID_ACCELERATION", [3015] = "INVALID_INSUFFICIENT_FIELDS", [3016] = "INVALID_TIME", [3017] = "INVALID_TOOL", [5000] = "NOT_READY_UNSPECIFIED", [5001] = "NOT_READY_ALARM", [5002] = "NOT_READY_ERROR", [5003] = "NOT_READY_EMERGENCY_STOP", [5004] = "NOT_READY_NOT_IN_PLAY", [5005] = "NOT_READY_NOT_REMOTE", [5006] = "NOT_READY_SERVO_OFF", [5007] = "NOT_READY_HOLD", [5008] = "NOT_READY_JOB_NOT_STARTED", [5009] = "NOT_READY_NOT_WAITING", [5010] = "NOT_READY_SKILLSEND", [5011] = "NOT_READY_PFL_ACTIVE", [5012] = "NOT_READY_INCREMENT_REJECTED" },
  IoResult = { [0] = "SUCCESS", [1001] = "READ_ADDRESS_INVALID", [1002] = "WRITE_ADDRESS_INVALID", [1003] = "WRITE_VALUE_INVALID", [1004] = "READ_API_ERROR", [1005] = "WRITE_API_ERROR" },
  Capability = { { 1, "JOINT_MOVE" }, { 2, "POSE_MOVE" }, { 4, "JOINT_PATH" }, { 8, "POSE_PATH" }, { 16, "SOFTWARE_STOP" }, { 32, "JOG" }, { 64, "MODES" }, { 128, "PAUSE" }, { 256, "PROGRAMS" }, { 512, "RECORDING" }, { 1024, "LOGIN" }, { 2048, "SIGNALS" }, { 4096, "SCENE" }, { 8192, "PLANS" }, { 16384, "KINEMATICS" }, { 32768, "SHAPES" }, { 65536, "NOTICES" }, { 131072, "POSITIONS" }, { 262144, "GRASP" }, { 1048576, "PREPARE" } },
  Notices = { [0] = "UNWANTED", [1] = "WANTED" },
  Encrypted = { [0] = "NO", [1] = "YES" },
  VerdictCode = { [0] = "ACCEPTED", [1] = "HELLO_FIRST", [2] = "VERSION", [3] = "UNKNOWN_CELL", [4] = "NOT_IN_CONTROL", [5] = "HELD_BY_OTHER", [6] = "ADDRESS_NOT_ALLOWED", [7] = "NOT_AUTOMATIC", [8] = "AUTHORITY_LOST", [9] = "NO_PLACE", [10] = "NO_TAKE_OVER", [20] = "STOP_LATCHED", [21] = "PLANNING", [22] = "MOVING", [23] = "CONTROLLER_DOWN", [24] = "FEEDBACK_STALE", [25] = "CONTROLLER_NOT_READY", [26] = "NOT_STANDING", [27] = "STOPPED", [28] = "SHUTTING_DOWN", [29] = "MODE_FORBIDS", [30] = "NOT_ENABLED", [31] = "ENABLING_LOST", [32] = "MODE_CHANGED", [33] = "MODE_NOT_OURS", [34] = "PRESS_DEAD", [35] = "PRESS_STALE", [36] = "PROTECTIVE_STOP", [37] = "PAUSED", [38] = "NOTHING_TO_CONTROL", [39] = "PROGRAM_STOPPED", [40] = "OVERTAKEN_BY_STOP", [41] = "MALFORMED", [42] = "BAD_ARGUMENT", [43] = "NOT_FINITE", [44] = "WRONG_JOINT_COUNT", [45] = "OUT_OF_RANGE", [46] = "TOO_FAST", [47] = "TOO_SHARP", [48] = "UNREACHABLE", [49] = "BRANCH_CHANGE", [50] = "NOT_TIMEABLE", [51] = "NO_MOTION", [52] = "UNKNOWN_FRAME", [53] = "CERTIFICATE_REFUSED", [54] = "PLANNER_FAILED", [55] = "SEQUENCE", [56] = "TOO_MANY_POINTS", [57] = "TRAJECTORY_INCOMPLETE", [58] = "TRAJECTORY_LATE", [60] = "CONTROLLER_REFUSED", [61] = "CONTROLLER_SILENT", [62] = "CONTROLLER_LOST", [63] = "CONTROLLER_MISMATCH", [64] = "CONTROLLER_STOPPED", [65] = "NOT_ARRIVED", [66] = "NOT_FOLLOWING", [67] = "JOG_INCREMENTS_ONLY", [68] = "CANNOT_PAUSE", [69] = "CONFIRM_FIRST", [70] = "NOT_PREPARED", [72] = "LEFT_THE_PATH", [73] = "OVER_SPEED", [74] = "OVER_RANGE", [80] = "FRAME_REFUSED", [81] = "NOT_IN_HISTORY", [82] = "POOR_GEOMETRY", [83] = "BAD_FILE", [84] = "PLATFORM_LIMIT", [85] = "NO_ASSEMBLY", [86] = "NOT_INSTALLED", [87] = "UNKNOWN_OBJECT", [88] = "DUPLICATE_OBJECT", [89] = "START_IN_COLLISION", [90] = "GOAL_IN_COLLISION", [91] = "PATH_IN_COLLISION", [92] = "NO_PATH_FOUND", [93] = "BAD_CIRCLE", [94] = "ZONE_TOO_LARGE", [100] = "REVISION_CONFLICT", [101] = "NOT_FOUND", [102] = "DISK_FULL", [103] = "STORE_READ_ONLY", [104] = "STORE_FAILED", [105] = "STORE_BUSY", [106] = "BAD_NAME", [107] = "TOO_LARGE", [108] = "BAD_DOCUMENT", [109] = "OUT_OF_SEQUENCE", [110] = "PROGRAM_SYNTAX", [111] = "PROGRAM_TOO_LARGE", [112] = "PROGRAM_INVALID", [113] = "PROGRAM_WRONG_ROBOT", [114] = "PROGRAM_UNKNOWN", [115] = "POINT_UNKNOWN", [116] = "POINT_IN_USE", [117] = "POINT_EXISTS", [118] = "POINT_INCONSISTENT", [119] = "CALL_TOO_DEEP", [120] = "INPUT_TIMEOUT", [121] = "PROGRAM_NOT_RUNNING", [122] = "PROGRAM_RUNNING", [123] = "PROGRAM_STUCK", [124] = "NOTHING_TO_UNDO", [125] = "STEP_BACK_REFUSED", [126] = "FLAG_NOT_READ", [127] = "STEP_FORWARD_REFUSED", [130] = "LOGIN_NEEDED", [131] = "LOGIN_FAILED", [132] = "LOCKED_OUT", [133] = "LOGIN_BUSY", [134] = "ROLE_TOO_LOW", [135] = "PAIRING_WRONG", [136] = "NAME_TAKEN", [137] = "BAD_PASSWORD", [138] = "BAD_ACCOUNT_NAME", [139] = "ACCOUNT_EXISTS", [140] = "UNKNOWN_ACCOUNT", [141] = "LAST_ADMIN", [142] = "REQUEST_REPEATED", [143] = "ACCOUNT_FULL", [144] = "ADDRESS_BARRED", [145] = "BAR_REFUSED", [146] = "NO_JOG_TO_UNDO", [147] = "UNKNOWN_CONNECTION", [148] = "OUTSIDE_LIMITS", [149] = "SERVER_LATE", [150] = "CELL_FAULTED", [151] = "OVERRIDE_ZERO", [160] = "NO_SIGNAL", [161] = "NO_STORE", [170] = "RECORDING_RUNNING", [171] = "NOT_RECORDING", [172] = "RECORDING_WRONG_ROBOT", [173] = "RECORDING_GAP", [174] = "RECORDING_FELL_BEHIND", [175] = "CHANGE_WHILE_MOVING", [177] = "SIGNALS_UNAVAILABLE", [178] = "ROBOT_FIXED", [180] = "PLAN_UNKNOWN", [181] = "PLAN_STALE", [182] = "TOO_MANY_PLANS", [183] = "PLAN_TOO_LONG", [184] = "TOO_OFTEN", [185] = "SUPERSEDED", [186] = "FORWARD_FIRST", [187] = "FORWARD_REFUSED", [190] = "NOTHING_GRIPPED", [191] = "NOT_HELD", [195] = "UNKNOWN_POSITION", [196] = "UNKNOWN_MESH" },
  OutcomeKind = { [1] = "COMPLETED", [2] = "ABORTED" },
  AuthorityAction = { [1] = "REQUEST", [2] = "RELEASE", [3] = "FORCE" },
  LoginKind = { [1] = "PASSWORD", [2] = "PAIRING" },
  AccountRole = { [0] = "AS_IT_IS", [1] = "VIEWER", [2] = "OPERATOR", [3] = "PROGRAMMER", [4] = "ADMIN" },
  PairingAction = { [1] = "ISSUE", [2] = "WITHDRAW" },
  Motion = { [1] = "PTP", [2] = "LIN" },
  EnablingPosition = { [0] = "RELEASED", [1] = "HELD", [2] = "PANIC" },
  OperatingMode = { [1] = "MANUAL_REDUCED", [2] = "MANUAL_HIGH", [3] = "AUTOMATIC", [4] = "RECOVERY" },
  MotionControlAction = { [1] = "PAUSE", [2] = "RESUME", [3] = "PROGRAM_STOP" },
  JogSpace = { [1] = "JOINTS", [2] = "TOOL" },
  RunKind = { [1] = "ALL", [2] = "STEP_FORWARD", [3] = "STEP_BACKWARD" },
  PlanState = { [1] = "PLANNING", [2] = "READY", [3] = "RUNNING", [4] = "DONE", [5] = "STALE", [6] = "EXPIRED", [7] = "DROPPED" },
  PlanStage = { [0] = "NONE", [1] = "SEARCHING", [2] = "SHORTENING", [3] = "CHECKING" },
  PrepareAction = { [1] = "PREPARE", [2] = "RELEASE", [3] = "ALARMS", [4] = "DRIVES_ON", [5] = "DRIVES_OFF" },
  Activity = { [0] = "IDLE", [1] = "PLANNING", [2] = "MOVING", [3] = "STOPPING", [4] = "JOGGING", [5] = "PAUSED", [6] = "PAUSING" },
  StopKind = { [0] = "NONE", [1] = "SOFTWARE", [2] = "PROTECTIVE" },
  JogReason = { [0] = "NONE", [1] = "JOINT_LIMIT", [2] = "SINGULARITY", [3] = "COLLISION", [4] = "TOOL_SPEED", [5] = "JOINT_SPEED", [6] = "WORKSPACE", [7] = "ELBOW_SPEED", [8] = "DIRECTION", [9] = "REACH" },
  ProgramState = { [0] = "NONE", [1] = "RUNNING", [2] = "PAUSED", [3] = "AT_BREAKPOINT", [4] = "STEPPED" },
  LinkState = { [0] = "DOWN", [1] = "UP", [2] = "STALE" },
  StateField = { { 2, "POSITION" }, { 4, "VELOCITY" }, { 16, "TOOL" } },
  AuthorityReason = { [1] = "GRANTED", [2] = "RELEASED", [3] = "EXPIRED", [4] = "CONNECTION_LOST", [5] = "TAKEN_OVER", [6] = "LOGGED_OUT", [7] = "ROLE_LOST" },
  JogEnd = { [1] = "RELEASED", [2] = "SILENT", [3] = "CONNECTION_LOST", [4] = "REPLACED", [5] = "STOPPED" },
  Preparedness = { [0] = "NO", [1] = "YES", [2] = "NOT_NEEDED" },
  ControllerIdentity = { [0] = "UNVERIFIED", [1] = "MATCH", [2] = "MISMATCH" },
  NoticeKind = { [0] = "EVERYTHING", [1] = "PROGRAM", [2] = "RECORDING", [3] = "FRAMES", [4] = "TOOLS", [5] = "SCENE", [6] = "POSITIONS", [7] = "SIGNALS", [8] = "EXERCISE", [9] = "ROBOT" },
  Change = { [1] = "NEW", [2] = "CHANGED", [3] = "RENAMED", [4] = "DELETED" },
  OperatorAction = { [1] = "EMERGENCY_STOP", [2] = "RESET", [3] = "IDENTIFY" },
}
local MESSAGES = {
  { type = 1, name = "ping", filter = "ping", any_body = true, fields = {} },
  { type = 2, name = "get_version", filter = "get_version", fields = {} },
  { type = 2, name = "get_version", filter = "get_version_reply", is_reply = true, fields = {
    { kind = "int", name = "major", meaning = "major version" },
    { kind = "int", name = "minor", meaning = "minor version" },
    { kind = "int", name = "patch", meaning = "patch level" },
  } },
  { type = 10, name = "joint_position", filter = "joint_position", fields = {
    { kind = "int", name = "sequence", meaning = "0 when reporting state" },
    { kind = "reals", size = 10, name = "joints", unit = "rad, m for a linear axis", meaning = "joint positions, unused slots 0" },
  } },
  { type = 11, name = "joint_traj_pt", filter = "joint_traj_pt", fields = {
    { kind = "int", name = "sequence", meaning = "index of the point from 0, or a special sequence", values = VALUES.SpecialSequence },
    { kind = "reals", size = 10, name = "joints", unit = "rad, m for a linear axis", meaning = "target positions, unused slots 0" },
    { kind = "real", name = "velocity", meaning = "fraction of the largest joint speed, 0 to 1" },
    { kind = "real", name = "duration", unit = "s", meaning = "time allotted to this segment, not a time stamp" },
  } },
  { type = 12, name = "joint_traj", filter = "joint_traj", fields = {
    { kind = "array", name = "points", meaning = "the points in order", least = 1, most = 200, count_name = "size", count_place = "after", record = {
      { kind = "int", name = "sequence", meaning = "index of the point from 0, or a special sequence", values = VALUES.SpecialSequence },
      { kind = "reals", size = 10, name = "joints", unit = "rad, m for a linear axis", meaning = "target positions, unused slots 0" },
      { kind = "real", name = "velocity", meaning = "fraction of the largest joint speed, 0 to 1" },
      { kind = "real", name = "duration", unit = "s", meaning = "time allotted to this segment, not a time stamp" },
    } },
  } },
  { type = 13, name = "status", filter = "status", fields = {
    { kind = "int", name = "drives_powered", meaning = "tri-state: motors have power", values = VALUES.TriState },
    { kind = "int", name = "e_stopped", meaning = "tri-state: an emergency stop is active", values = VALUES.TriState },
    { kind = "int", name = "error_code", meaning = "the controller's own error number, 0 for none; from a pendant server also 1,000,000 + a verdict of its own" },
    { kind = "int", name = "in_error", meaning = "tri-state: an error is active", values = VALUES.TriState },
    { kind = "int", name = "in_motion", meaning = "tri-state: the robot moves", values = VALUES.TriState },
    { kind = "int", name = "mode", meaning = "-1 unknown, 1 manual, 2 automatic", values = VALUES.ControllerMode },
    { kind = "int", name = "motion_possible", meaning = "tri-state: a new trajectory would start now", values = VALUES.TriState },
  } },
  { type = 14, name = "joint_traj_pt_full", filter = "joint_traj_pt_full", fields = {
    { kind = "int", name = "robot_id", meaning = "robot or group number, zero based" },
    { kind = "int", name = "sequence", meaning = "index of the point from 0, or a special sequence", values = VALUES.SpecialSequence },
    { kind = "int", name = "valid_fields", meaning = "bits: 1 time, 2 position, 4 velocity, 8 acceleration", bits = VALUES.ValidField },
    { kind = "real", name = "time", unit = "s", meaning = "time from the start of the trajectory" },
    { kind = "reals", size = 10, name = "positions", unit = "rad, m for a linear axis", meaning = "joint positions" },
    { kind = "reals", size = 10, name = "velocities", unit = "rad/s, m/s", meaning = "joint velocities" },
    { kind = "reals", size = 10, name = "accelerations", unit = "rad/s², m/s²", meaning = "joint accelerations" },
  } },
  { type = 15, name = "joint_feedback", filter = "joint_feedback", fields = {
    { kind = "int", name = "robot_id", meaning = "robot or group number, zero based" },
    { kind = "int", name = "valid_fields", meaning = "bits: 1 time, 2 position, 4 velocity, 8 acceleration", bits = VALUES.ValidField },
    { kind = "real", name = "time", unit = "s", meaning = "the controller's time, where it has one" },
    { kind = "reals", size = 10, name = "positions", unit = "rad, m for a linear axis", meaning = "joint positions" },
    { kind = "reals", size = 10, name = "velocities", unit = "rad/s, m/s", meaning = "joint velocities" },
    { kind = "reals", size = 10, name = "accelerations", unit = "rad/s², m/s²", meaning = "joint accelerations" },
  } },
  { type = 2001, name = "motoman_motion_ctrl", filter = "motoman_motion_ctrl", fields = {
    { kind = "int", name = "robot_id", meaning = "group number" },
    { kind = "int", name = "sequence", meaning = "echoed in the reply" },
    { kind = "int", name = "command", meaning = "what to do", values = VALUES.MotionCommand },
    { kind = "reals", size = 10, name = "data", meaning = "unused, 0" },
  } },
  { type = 2002, name = "motoman_motion_reply", filter = "motoman_motion_reply", fields = {
    { kind = "int", name = "robot_id", meaning = "group number" },
    { kind = "int", name = "sequence", meaning = "sequence of the request" },
    { kind = "int", name = "command", meaning = "command of the request, or its message type", values = VALUES.MotionCommand },
    { kind = "int", name = "result", meaning = "0 success, 1 busy, else why not", values = VALUES.MotionResult },
    { kind = "int", name = "subcode", meaning = "reason; of CHECK_QUEUE_CNT: increments still queued", values = VALUES.Subcode },
    { kind = "reals", size = 10, name = "data", meaning = "unused, 0" },
  } },
  { type = 2003, name = "motoman_read_single_io", filter = "motoman_read_single_io", fields = {
    { kind = "int", name = "address", meaning = "address of the bit" },
  } },
  { type = 2004, name = "motoman_read_single_io_reply", filter = "motoman_read_single_io_reply", fields = {
    { kind = "int", name = "value", meaning = "0 or 1" },
    { kind = "int", name = "result_code", meaning = "0 success, 1001 and up failed", values = VALUES.IoResult },
  } },
  { type = 2005, name = "motoman_write_single_io", filter = "motoman_write_single_io", fields = {
    { kind = "int", name = "address", meaning = "address of the bit" },
    { kind = "int", name = "value", meaning = "0 or 1" },
  } },
  { type = 2006, name = "motoman_write_single_io_reply", filter = "motoman_write_single_io_reply", fields = {
    { kind = "int", name = "result_code", meaning = "0 success, 1001 and up failed", values = VALUES.IoResult },
  } },
  { type = 2007, name = "motoman_read_group_io", filter = "motoman_read_group_io", fields = {
    { kind = "int", name = "address", meaning = "address of the group: bit address / 10" },
  } },
  { type = 2008, name = "motoman_read_group_io_reply", filter = "motoman_read_group_io_reply", fields = {
    { kind = "int", name = "value", meaning = "0 to 255" },
    { kind = "int", name = "result_code", meaning = "0 success, 1001 and up failed", values = VALUES.IoResult },
  } },
  { type = 2009, name = "motoman_write_group_io", filter = "motoman_write_group_io", fields = {
    { kind = "int", name = "address", meaning = "address of the group: bit address / 10" },
    { kind = "int", name = "value", meaning = "0 to 255" },
  } },
  { type = 2010, name = "motoman_write_group_io_reply", filter = "motoman_write_group_io_reply", fields = {
    { kind = "int", name = "result_code", meaning = "0 success, 1001 and up failed", values = VALUES.IoResult },
  } },
  { type = 2012, name = "motoman_read_mregister", filter = "motoman_read_mregister", fields = {
    { kind = "int", name = "address", meaning = "register number, 0 to 999" },
  } },
  { type = 2012, name = "motoman_read_mregister_reply", filter = "motoman_read_mregister_reply", is_reply = true, fields = {
    { kind = "int", name = "value", meaning = "0 to 65535" },
    { kind = "int", name = "result_code", meaning = "0 success, 1001 and up failed", values = VALUES.IoResult },
  } },
  { type = 2013, name = "motoman_write_mregister", filter = "motoman_write_mregister", fields = {
    { kind = "int", name = "address", meaning = "register number, 0 to 559" },
    { kind = "int", name = "value", meaning = "0 to 65535" },
  } },
  { type = 2013, name = "motoman_write_mregister_reply", filter = "motoman_write_mregister_reply", is_reply = true, fields = {
    { kind = "int", name = "result_code", meaning = "0 success, 1001 and up failed", values = VALUES.IoResult },
  } },
  { type = 2016, name = "motoman_joint_traj_pt_full_ex", filter = "motoman_joint_traj_pt_full_ex", fields = {
    { kind = "int", name = "num_groups", meaning = "groups that are meant" },
    { kind = "int", name = "sequence", meaning = "index of the point from 0" },
    { kind = "array", name = "groups", meaning = "a record for each group", least = 1, most = 4, meant_by = "num_groups", record = {
      { kind = "int", name = "robot_id", meaning = "group number" },
      { kind = "int", name = "valid_fields", meaning = "bits: 1 time, 2 position, 4 velocity, 8 acceleration", keeps = 16, bits = VALUES.ValidField },
      { kind = "real", name = "time", unit = "s", meaning = "time from the start of the trajectory" },
      { kind = "reals", size = 10, name = "positions", unit = "rad, m for a linear axis", meaning = "joint positions" },
      { kind = "reals", size = 10, name = "velocities", unit = "rad/s, m/s", meaning = "joint velocities" },
      { kind = "reals", size = 10, name = "accelerations", unit = "rad/s², m/s²", meaning = "joint accelerations" },
    } },
  } },
  { type = 2017, name = "motoman_joint_feedback_ex", filter = "motoman_joint_feedback_ex", fields = {
    { kind = "int", name = "num_groups", meaning = "groups that are meant" },
    { kind = "array", name = "groups", meaning = "a record for each group", least = 4, most = 4, record = {
      { kind = "int", name = "robot_id", meaning = "group number" },
      { kind = "int", name = "valid_fields", meaning = "bits: 1 time, 2 position, 4 velocity, 8 acceleration", keeps = 16, bits = VALUES.ValidField },
      { kind = "real", name = "time", unit = "s", meaning = "time from the start of the trajectory" },
      { kind = "reals", size = 10, name = "positions", unit = "rad, m for a linear axis", meaning = "joint positions" },
      { kind = "reals", size = 10, name = "velocities", unit = "rad/s, m/s", meaning = "joint velocities" },
      { kind = "reals", size = 10, name = "accelerations", unit = "rad/s², m/s²", meaning = "joint accelerations" },
    } },
  } },
  { type = 2018, name = "motoman_select_tool", filter = "motoman_select_tool", fields = {
    { kind = "int", name = "group", meaning = "group number" },
    { kind = "int", name = "tool", meaning = "tool file, 0 to 63" },
    { kind = "int", name = "sequence", meaning = "echoed in the reply" },
  } },
  { type = 2020, name = "motoman_get_dh_parameters", filter = "motoman_get_dh_parameters", fields = {} },
  { type = 2020, name = "motoman_get_dh_parameters", filter = "motoman_get_dh_parameters_reply", is_reply = true, fields = {
    { kind = "reals", size = 128, name = "groups", unit = "not stated by the vendor", meaning = "theta, d, a, alpha of each link of each group" },
  } },
  { type = 65000, name = "hello", filter = "hello", fields = {
    { kind = "int", name = "protocol_version", meaning = "version of these messages that the pendant speaks" },
    { kind = "real", name = "state_rate", unit = "Hz", meaning = "state messages wanted, 0 for none, else 1 to 125" },
    { kind = "text", size = 32, name = "cell", meaning = "name of the cell, empty for the only one" },
    { kind = "text", size = 32, name = "client", meaning = "name of the pendant, shown to others" },
  } },
  { type = 65000, name = "hello", filter = "hello_reply", is_reply = true, fields = {
    { kind = "int", name = "protocol_version", meaning = "version of these messages that the server speaks" },
    { kind = "int", name = "session", meaning = "number of this connection, not 0" },
    { kind = "int", name = "capabilities", meaning = "bits: what the server offers", bits = VALUES.Capability },
    { kind = "int", name = "max_frame", unit = "byte", meaning = "largest frame that the server takes" },
    { kind = "int", name = "dof", meaning = "driven joints of the robot" },
    { kind = "real", name = "tick_rate", unit = "Hz", meaning = "the server's control rate" },
    { kind = "real", name = "max_state_rate", unit = "Hz", meaning = "fastest state rate" },
    { kind = "real", name = "authority_timeout", unit = "s", meaning = "the authority expires so long after a beat" },
    { kind = "text", size = 32, name = "cell", meaning = "name of the cell" },
    { kind = "text", size = 32, name = "robot", meaning = "name of the robot" },
    { kind = "text", size = 32, name = "server", meaning = "name and version of the server" },
  } },
  { type = 65051, name = "declare", filter = "declare", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "enabling_deadline", unit = "s", meaning = "enabling is let go so long after its last sign, 0.05 to 0.25; 0 as the cell" },
    { kind = "int", name = "notices", meaning = "1 if changes of documents and plans are to be told", values = VALUES.Notices },
    { kind = "text", size = 8, name = "language", meaning = "of the person, as en or de; for the audit log" },
  } },
  { type = 65050, name = "forwarded", filter = "forwarded", fields = {
    { kind = "text", size = 32, name = "gateway", meaning = "name of the gateway in the server's configuration" },
    { kind = "text", size = 64, name = "secret", meaning = "its secret, 32 bytes in hexadecimal" },
    { kind = "text", size = 64, name = "address", meaning = "address of the browser, IPv4 or IPv6, without a port" },
    { kind = "int", name = "is_encrypted", meaning = "1 if the browser came by TLS, else 0", values = VALUES.Encrypted },
  } },
  { type = 65052, name = "lobby", filter = "lobby", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
  } },
  { type = 65052, name = "lobby", filter = "lobby_reply", is_reply = true, fields = {
    { kind = "int", name = "request_id", meaning = "of the request" },
    { kind = "json", name = "body", meaning = "one JSON object, UTF-8" },
  } },
  { type = 65001, name = "management", filter = "management", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "json", name = "body", meaning = "one JSON object, UTF-8" },
  } },
  { type = 65002, name = "verdict", filter = "verdict", fields = {
    { kind = "int", name = "request_id", meaning = "of the request" },
    { kind = "int", name = "code", meaning = "0 accepted, else an entry of the catalogue", values = VALUES.VerdictCode },
    { kind = "int", name = "joint", meaning = "index of the joint at fault, -1 for none" },
    { kind = "real", name = "value", meaning = "the value at fault, SI" },
    { kind = "real", name = "limit", meaning = "the limit that it breaks, SI" },
    { kind = "text", size = 160, name = "text", meaning = "one sentence with the numbers" },
  } },
  { type = 65003, name = "outcome", filter = "outcome", fields = {
    { kind = "int", name = "request_id", meaning = "of the request" },
    { kind = "int", name = "outcome", meaning = "1 completed, 2 aborted", values = VALUES.OutcomeKind },
    { kind = "int", name = "code", meaning = "0 completed, else an entry of the catalogue", values = VALUES.VerdictCode },
    { kind = "int", name = "joint", meaning = "index of the joint at fault, -1 for none" },
    { kind = "real", name = "value", meaning = "the value at fault, SI" },
    { kind = "real", name = "limit", meaning = "the limit that it breaks, SI" },
    { kind = "real", name = "plan_time", unit = "s", meaning = "time that planning took" },
    { kind = "real", name = "motion_time", unit = "s", meaning = "planned duration of the motion" },
    { kind = "text", size = 160, name = "text", meaning = "one sentence with the numbers" },
  } },
  { type = 65004, name = "subscribe", filter = "subscribe", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "state_rate", unit = "Hz", meaning = "state messages wanted, 0 for none, else 1 to 125" },
  } },
  { type = 65005, name = "authority", filter = "authority", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "action", meaning = "1 request, 2 release, 3 take over by role", values = VALUES.AuthorityAction },
  } },
  { type = 65006, name = "authority_beat", filter = "authority_beat", fields = {} },
  { type = 65007, name = "login", filter = "login", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "kind", meaning = "1 password, 2 pairing code", values = VALUES.LoginKind },
    { kind = "text", size = 32, name = "name", meaning = "account, or the name of a guest" },
    { kind = "text", size = 128, name = "secret", meaning = "password or pairing code" },
  } },
  { type = 65008, name = "set_account", filter = "set_account", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "role", meaning = "of a new account: 1 viewer, 2 operator, 3 programmer, 4 admin; 0 for a new password", values = VALUES.AccountRole },
    { kind = "text", size = 32, name = "name", meaning = "the account" },
    { kind = "text", size = 128, name = "secret", meaning = "its new password" },
  } },
  { type = 65009, name = "pairing", filter = "pairing", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "action", meaning = "1 issue, 2 withdraw", values = VALUES.PairingAction },
  } },
  { type = 65009, name = "pairing", filter = "pairing_reply", is_reply = true, fields = {
    { kind = "int", name = "request_id", meaning = "of the request" },
    { kind = "int", name = "lifetime", unit = "s", meaning = "the code ends so long after this reply" },
    { kind = "text", size = 8, name = "code", meaning = "as a teacher shows it" },
  } },
  { type = 65010, name = "joint_move", filter = "joint_move", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "speed", meaning = "fraction of the joints' largest speed, above 0, up to 1" },
    { kind = "int", name = "joint_count", meaning = "slots that are meant; must be the robot's driven joints" },
    { kind = "reals", size = 10, name = "joints", unit = "rad, m for a linear axis", meaning = "target positions, unused slots 0" },
  } },
  { type = 65011, name = "pose_move", filter = "pose_move", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "motion", meaning = "1 PTP, 2 LIN", values = VALUES.Motion },
    { kind = "real", name = "speed", meaning = "fraction of the joints' largest speed, above 0, up to 1" },
    { kind = "text", size = 32, name = "frame", meaning = "frame of the pose: base or root" },
    { kind = "reals", size = 3, name = "position", unit = "m", meaning = "x, y, z of the tool" },
    { kind = "reals", size = 4, name = "orientation", meaning = "quaternion x, y, z, w" },
  } },
  { type = 65012, name = "joint_path", filter = "joint_path", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "speed", meaning = "fraction of the joints' largest speed, above 0, up to 1" },
    { kind = "int", name = "joint_count", meaning = "slots that are meant; must be the robot's driven joints" },
    { kind = "array", name = "waypoints", meaning = "the waypoints in order", least = 1, most = 1600, count_name = "count", count_place = "before", record = {
      { kind = "reals", size = 10, name = "joints", unit = "rad, m for a linear axis", meaning = "joint positions, unused slots 0" },
    } },
  } },
  { type = 65013, name = "pose_path", filter = "pose_path", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "motion", meaning = "1 PTP, 2 LIN", values = VALUES.Motion },
    { kind = "real", name = "speed", meaning = "fraction of the joints' largest speed, above 0, up to 1" },
    { kind = "text", size = 32, name = "frame", meaning = "frame of the poses: base or root" },
    { kind = "array", name = "waypoints", meaning = "the waypoints in order", least = 1, most = 1600, count_name = "count", count_place = "before", record = {
      { kind = "reals", size = 3, name = "position", unit = "m", meaning = "x, y, z of the tool" },
      { kind = "reals", size = 4, name = "orientation", meaning = "quaternion x, y, z, w" },
    } },
  } },
  { type = 65014, name = "software_stop", filter = "software_stop", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "text", size = 64, name = "reason", meaning = "shown to others" },
  } },
  { type = 65015, name = "reset_stop", filter = "reset_stop", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
  } },
  { type = 65016, name = "enabling", filter = "enabling", fields = {
    { kind = "int", name = "position", meaning = "0 released, 1 held, 2 panic", values = VALUES.EnablingPosition },
  } },
  { type = 65017, name = "set_mode", filter = "set_mode", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "mode", meaning = "1 manual reduced speed, 2 manual high speed, 3 automatic, 4 recovery", values = VALUES.OperatingMode },
  } },
  { type = 65018, name = "set_speed", filter = "set_speed", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "override", meaning = "fraction of the planned speed, 0.001 to 1; 0 pauses what moves" },
    { kind = "real", name = "tool_speed", unit = "m/s", meaning = "cap of tool and elbow, 0 to leave it as it is; in automatic only 0" },
  } },
  { type = 65019, name = "motion_control", filter = "motion_control", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "action", meaning = "1 pause, 2 resume, 3 program stop", values = VALUES.MotionControlAction },
  } },
  { type = 65030, name = "jog_start", filter = "jog_start", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "press", meaning = "number of the press, higher than any before on this connection" },
    { kind = "int", name = "state_sequence", meaning = "sequence of a state message that came of late" },
    { kind = "real", name = "deadline", unit = "s", meaning = "the jog ends so long after a beat, 0.05 to 0.25" },
    { kind = "int", name = "space", meaning = "1 joints, 2 tool", values = VALUES.JogSpace },
    { kind = "text", size = 32, name = "frame", meaning = "tool jog: frame of the axes; base, tool or a named one" },
    { kind = "int", name = "value_count", meaning = "slots that are meant: driven joints, or 6 for the tool" },
    { kind = "reals", size = 10, name = "values", meaning = "-1 to 1: parts of the jog speed; tool: x, y, z, then about x, y, z" },
  } },
  { type = 65031, name = "jog_beat", filter = "jog_beat", fields = {
    { kind = "int", name = "press", meaning = "number of the press" },
    { kind = "int", name = "beat", meaning = "counts the beats of the press, from 1" },
  } },
  { type = 65032, name = "jog_release", filter = "jog_release", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "press", meaning = "number of the press" },
  } },
  { type = 65033, name = "jog_step", filter = "jog_step", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "speed", meaning = "fraction of the jog speed, above 0, up to 1" },
    { kind = "int", name = "space", meaning = "1 joints, 2 tool", values = VALUES.JogSpace },
    { kind = "text", size = 32, name = "frame", meaning = "tool step: frame of the axes; base, tool or a named one" },
    { kind = "int", name = "value_count", meaning = "slots that are meant: driven joints, or 6 for the tool" },
    { kind = "reals", size = 10, name = "values", unit = "rad, m", meaning = "increments; tool: x, y, z, then about x, y, z" },
  } },
  { type = 65034, name = "jog_undo", filter = "jog_undo", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "speed", meaning = "fraction of the jog speed, above 0, up to 1" },
  } },
  { type = 65040, name = "program_run", filter = "program_run", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "run", meaning = "1 all, 2 step forward, 3 step backward", values = VALUES.RunKind },
    { kind = "int", name = "line", meaning = "line to begin at, 0 for the first; 0 on a paused program resumes it" },
    { kind = "int", name = "loops", meaning = "how often, 0 for until it is stopped; to resume: as begun" },
    { kind = "int", name = "revision", meaning = "revision to run, 0 for the newest or that under way" },
    { kind = "real", name = "speed", meaning = "fraction of the programmed speeds, above 0, up to 1" },
    { kind = "text", size = 64, name = "program", meaning = "name of the program" },
  } },
  { type = 65041, name = "home", filter = "home", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "real", name = "speed", meaning = "fraction of the joints' largest speed, above 0, up to 1" },
    { kind = "text", size = 32, name = "target", meaning = "a named position, such as home or zero; see positions.list" },
  } },
  { type = 65053, name = "execute", filter = "execute", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "plan", meaning = "number of the plan" },
    { kind = "int", name = "override_is_one", meaning = "1 to be refused unless the speed override is 1, else 0" },
  } },
  { type = 65054, name = "plan_changed", filter = "plan_changed", fields = {
    { kind = "int", name = "plan", meaning = "number of the plan" },
    { kind = "int", name = "state", meaning = "what has become of it", values = VALUES.PlanState },
    { kind = "int", name = "code", meaning = "why, an entry of the catalogue; 0 for nothing", values = VALUES.VerdictCode },
    { kind = "int", name = "stage", meaning = "how far the planning has come", values = VALUES.PlanStage },
    { kind = "real", name = "fraction", meaning = "of the time that planning may take, 0 to 1" },
    { kind = "text", size = 96, name = "text", meaning = "one sentence, empty for none" },
  } },
  { type = 65042, name = "prepare", filter = "prepare", fields = {
    { kind = "int", name = "request_id", meaning = "chosen by the pendant" },
    { kind = "int", name = "action", meaning = "1 prepare, 2 release; single steps: 3 alarms, 4 drives on, 5 drives off", values = VALUES.PrepareAction },
    { kind = "int", name = "token", meaning = "of the verdict CONFIRM_FIRST, 0 at the first asking" },
  } },
  { type = 65020, name = "state", filter = "state", fields = {
    { kind = "int", name = "sequence", meaning = "counts the cell's state messages; a listener may see gaps" },
    { kind = "int", name = "time_s", unit = "s", meaning = "the server's monotonic time, whole seconds" },
    { kind = "int", name = "time_ns", unit = "ns", meaning = "the server's monotonic time, rest" },
    { kind = "real", name = "age", unit = "s", meaning = "age of the controller's last report, -1 before the first" },
    { kind = "int", name = "dropped", meaning = "state messages that this connection was too slow for" },
    { kind = "int", name = "activity", meaning = "what the cell does; 6: about to be paused", values = VALUES.Activity },
    { kind = "int", name = "request_id", meaning = "request that is planned or moving, 0 for none" },
    { kind = "int", name = "holder", meaning = "session that holds the motion authority, 0 for none" },
    { kind = "int", name = "stop", meaning = "latched stop: 0 none, 1 software, 2 protective", values = VALUES.StopKind },
    { kind = "int", name = "operating_mode", meaning = "the server's own mode", values = VALUES.OperatingMode },
    { kind = "int", name = "enabling", meaning = "the authority's enabling device (training)", values = VALUES.EnablingPosition },
    { kind = "real", name = "override", meaning = "speed override, 0 to 1" },
    { kind = "real", name = "tool_speed_cap", unit = "m/s", meaning = "cap of tool and elbow, 0 for none" },
    { kind = "real", name = "jog_scale", meaning = "part of the asked jog speed that is driven, 0 to 1" },
    { kind = "int", name = "jog_reason", meaning = "why it is less than 1", values = VALUES.JogReason },
    { kind = "int", name = "jog_joint", meaning = "joint at fault, -1 for none" },
    { kind = "int", name = "program_state", meaning = "what the program is doing", values = VALUES.ProgramState },
    { kind = "int", name = "program_line", meaning = "its current line, 0 for none" },
    { kind = "int", name = "link", meaning = "controller connection: 0 down, 1 up, 2 stale", values = VALUES.LinkState },
    { kind = "int", name = "drives_powered", meaning = "the controller's own, -1 unknown", values = VALUES.TriState },
    { kind = "int", name = "e_stopped", meaning = "the controller's own, -1 unknown", values = VALUES.TriState },
    { kind = "int", name = "error_code", meaning = "the controller's own, 0 for none" },
    { kind = "int", name = "in_error", meaning = "the controller's own, -1 unknown", values = VALUES.TriState },
    { kind = "int", name = "in_motion", meaning = "the controller's own, -1 unknown", values = VALUES.TriState },
    { kind = "int", name = "mode", meaning = "the controller's own: -1 unknown, 1 manual, 2 automatic", values = VALUES.ControllerMode },
    { kind = "int", name = "motion_possible", meaning = "the controller's own, -1 unknown", values = VALUES.TriState },
    { kind = "int", name = "valid_fields", meaning = "bits: 2 positions, 4 velocities, 16 tool", bits = VALUES.StateField },
    { kind = "real", name = "tool_speed", unit = "m/s", meaning = "speed of the tool" },
    { kind = "reals", size = 10, name = "positions", unit = "rad, m for a linear axis", meaning = "joint positions" },
    { kind = "reals", size = 10, name = "velocities", unit = "rad/s, m/s", meaning = "joint velocities" },
    { kind = "reals", size = 3, name = "tool_position", unit = "m", meaning = "x, y, z of the tool in base" },
    { kind = "reals", size = 4, name = "tool_orientation", meaning = "quaternion x, y, z, w of the tool in base" },
  } },
  { type = 65021, name = "authority_changed", filter = "authority_changed", fields = {
    { kind = "int", name = "holder", meaning = "session that holds it now, 0 for nobody" },
    { kind = "int", name = "reason", meaning = "1 granted, 2 released, 3 expired, 4 connection lost, 5 taken over, 6 logged out, 7 role lost", values = VALUES.AuthorityReason },
    { kind = "text", size = 32, name = "client", meaning = "name of the new holder's pendant" },
  } },
  { type = 65022, name = "stop_changed", filter = "stop_changed", fields = {
    { kind = "int", name = "stop", meaning = "latched stop: 0 none, 1 software, 2 protective", values = VALUES.StopKind },
    { kind = "int", name = "session", meaning = "who did it, 0 for the server itself" },
    { kind = "text", size = 32, name = "client", meaning = "name of that pendant" },
    { kind = "text", size = 64, name = "reason", meaning = "as given" },
  } },
  { type = 65023, name = "authority_wanted", filter = "authority_wanted", fields = {
    { kind = "int", name = "session", meaning = "who asked" },
    { kind = "text", size = 32, name = "client", meaning = "name of that pendant" },
  } },
  { type = 65024, name = "mode_changed", filter = "mode_changed", fields = {
    { kind = "int", name = "mode", meaning = "the mode now", values = VALUES.OperatingMode },
    { kind = "int", name = "session", meaning = "who did it, 0 for the controller" },
    { kind = "text", size = 32, name = "client", meaning = "name of that pendant" },
  } },
  { type = 65025, name = "jog_ended", filter = "jog_ended", fields = {
    { kind = "int", name = "press", meaning = "number of the press" },
    { kind = "int", name = "reason", meaning = "why it ended", values = VALUES.JogEnd },
    { kind = "real", name = "stop_time", unit = "s", meaning = "from the end of the press to rest or a new press, as sent" },
    { kind = "real", name = "joint_distance", unit = "rad, m", meaning = "farthest that a joint went in that time" },
    { kind = "real", name = "tool_distance", unit = "m", meaning = "way of the tool in that time" },
    { kind = "reals", size = 10, name = "positions", unit = "rad, m for a linear axis", meaning = "where the joints stand" },
  } },
  { type = 65026, name = "program_report", filter = "program_report", fields = {
    { kind = "int", name = "state", meaning = "what it is doing", values = VALUES.ProgramState },
    { kind = "int", name = "line", meaning = "its current line, 0 for none" },
    { kind = "int", name = "loop", meaning = "which run of it this is, from 1" },
    { kind = "int", name = "revision", meaning = "revision of that program in this run" },
    { kind = "text", size = 64, name = "program", meaning = "name of the program" },
    { kind = "text", size = 160, name = "text", meaning = "one sentence, empty for none" },
  } },
  { type = 65043, name = "controller_changed", filter = "controller_changed", fields = {
    { kind = "int", name = "prepared", meaning = "0 no, 1 yes, 2 not needed", values = VALUES.Preparedness },
    { kind = "int", name = "identity", meaning = "0 unverified, 1 match, 2 mismatch", values = VALUES.ControllerIdentity },
    { kind = "int", name = "is_emulated", meaning = "1 where it is known to be emulated" },
    { kind = "int", name = "declaration", meaning = "counts the changes of what controller.describe tells, from 1" },
  } },
  { type = 65055, name = "document_changed", filter = "document_changed", fields = {
    { kind = "int", name = "kind", meaning = "what changed; 0: look at everything", values = VALUES.NoticeKind },
    { kind = "int", name = "revision", meaning = "the one that is kept now, 0 where it was deleted" },
    { kind = "int", name = "session", meaning = "connection that changed it, 0 for the server" },
    { kind = "int", name = "what", meaning = "1 new, 2 changed, 3 renamed, 4 deleted", values = VALUES.Change },
    { kind = "text", size = 64, name = "name", meaning = "of the document" },
    { kind = "text", size = 64, name = "from_name", meaning = "its former name where it was renamed" },
    { kind = "text", size = 32, name = "client", meaning = "name of whoever changed it" },
  } },
  { type = 65100, name = "operator_event", filter = "operator_event", fields = {
    { kind = "int", name = "action", meaning = "1 emergency stop, 2 reset, 3 identify", values = VALUES.OperatorAction },
  } },
  { type = 65110, name = "read_signals", filter = "read_signals", fields = {
    { kind = "int", name = "first", meaning = "number of the first signal: 0, 16, 32, …" },
  } },
  { type = 65110, name = "read_signals", filter = "read_signals_reply", is_reply = true, fields = {
    { kind = "int", name = "first", meaning = "number of the first signal, as asked" },
    { kind = "int", name = "inputs", meaning = "bits: the inputs", keeps = 65536 },
    { kind = "int", name = "outputs", meaning = "bits: the outputs", keeps = 65536 },
    { kind = "int", name = "input_count", meaning = "inputs in all" },
    { kind = "int", name = "output_count", meaning = "outputs in all" },
  } },
  { type = 65111, name = "write_outputs", filter = "write_outputs", fields = {
    { kind = "int", name = "first", meaning = "number of the first signal: 0, 16, 32, …" },
    { kind = "int", name = "mask", meaning = "bits: the outputs that are set", keeps = 65536 },
    { kind = "int", name = "values", meaning = "bits: their values", keeps = 65536 },
  } },
  { type = 65112, name = "set_inputs", filter = "set_inputs", fields = {
    { kind = "int", name = "first", meaning = "number of the first signal: 0, 16, 32, …" },
    { kind = "int", name = "mask", meaning = "bits: the inputs that are set", keeps = 65536 },
    { kind = "int", name = "values", meaning = "bits: their values", keeps = 65536 },
  } },
}

-- Fields. Reals of both widths share one field: values are given as numbers, never as bytes.

local proto = Proto("openpendant", "ROS-Industrial simple message (openpendant)")

local DIRECTIONS = { [1] = "topic", [2] = "request", [3] = "reply" }
local REPLY_CODES = { [0] = "UNUSED", [1] = "SUCCESS", [2] = "FAILURE" }
local COMM_TYPES = { [0] = "INVALID", [1] = "TOPIC", [2] = "REQUEST", [3] = "REPLY" }

local header = {
    length = ProtoField.int32("openpendant.length", "length"),
    msg_type = ProtoField.int32("openpendant.msg_type", "message type", base.DEC, TYPE_NAMES),
    comm_type = ProtoField.int32("openpendant.comm_type", "communication type", base.DEC, COMM_TYPES),
    reply_code = ProtoField.int32("openpendant.reply_code", "reply code", base.DEC, REPLY_CODES),
    name = ProtoField.string("openpendant.name", "name"),
    byte_order = ProtoField.string("openpendant.byte_order", "byte order"),
    real_size = ProtoField.uint32("openpendant.real_size", "bytes of a real"),
    body = ProtoField.bytes("openpendant.body", "body"),
}

-- Not of the group "malformed": that filter is left to bytes which break a dissector.
local experts = {
    framing = ProtoExpert.new("openpendant.framing_fault", "no simple message",
        expert.group.PROTOCOL, expert.severity.ERROR),
    header = ProtoExpert.new("openpendant.header_fault", "header breaks a rule",
        expert.group.PROTOCOL, expert.severity.ERROR),
    body = ProtoExpert.new("openpendant.body_fault", "body is not as declared",
        expert.group.PROTOCOL, expert.severity.ERROR),
    reply = ProtoExpert.new("openpendant.other_reply", "reply with a body of the vendor's own",
        expert.group.PROTOCOL, expert.severity.NOTE),
    unknown = ProtoExpert.new("openpendant.unknown_type", "message type without a known layout",
        expert.group.UNDECODED, expert.severity.NOTE),
    refused = ProtoExpert.new("openpendant.refused", "refused",
        expert.group.RESPONSE_CODE, expert.severity.NOTE),
    cut = ProtoExpert.new("openpendant.cut_short", "cut short by the capture",
        expert.group.UNDECODED, expert.severity.WARN),
}

local all_fields = {}
for _, field in pairs(header) do all_fields[#all_fields + 1] = field end

local function label(field)
    if field.unit then return field.name .. " [" .. field.unit .. "]" end
    return field.name
end

-- Wireshark looks the names of values up by unsigned words.
local function unsigned(values)
    if not values then return nil end
    local names = {}
    for value, name in pairs(values) do names[value % 2 ^ 32] = name end
    return names
end

local function declare(path, fields)
    for _, field in ipairs(fields) do
        local filter = path .. "." .. field.name
        if field.kind == "array" then
            if field.count_name then
                field.count = ProtoField.int32(path .. "." .. field.count_name, field.count_name)
                all_fields[#all_fields + 1] = field.count
            end
            declare(filter, field.record)
        else
            if field.kind == "int" then
                field.proto = ProtoField.int32(
                    filter, label(field), base.DEC, unsigned(field.values), nil, field.meaning)
            elseif field.kind == "text" or field.kind == "json" then
                field.proto = ProtoField.string(filter, label(field), base.UNICODE, field.meaning)
            else
                field.proto = ProtoField.double(filter, label(field), base.NONE, field.meaning)
            end
            all_fields[#all_fields + 1] = field.proto
        end
    end
end

local by_type = {}
for _, message in ipairs(MESSAGES) do
    declare("openpendant." .. message.filter, message.fields)
    local layouts = by_type[message.type] or {}
    by_type[message.type] = layouts
    layouts[message.is_reply and "reply" or "other"] = message
end

proto.fields = all_fields
local all_experts = {}
for _, one in pairs(experts) do all_experts[#all_experts + 1] = one end
proto.experts = all_experts

-- Preferences.

proto.prefs.ports = Pref.range("TCP ports", DEFAULT_PORTS, "Ports that carry simple message", 65535)
proto.prefs.real_size = Pref.enum("Size of reals", 0, "Told by the size of the body, or always as chosen", {
    { 1, "told by the body, else 4", 0 }, { 2, "4 bytes", 4 }, { 3, "8 bytes", 8 },
}, false)

-- Bytes.

local LONGEST = 65535
local HEADER, PREFIX = 16, 4

local function int_at(tvb, at, little)
    if little then return tvb(at, 4):le_int() end
    return tvb(at, 4):int()
end

local function real_at(tvb, at, little, width)
    if little then return tvb(at, width):le_float() end
    return tvb(at, width):float()
end

-- Says whether a text is UTF-8, as strictly as Python does: no surrogates, nothing overlong.
local function is_utf8(text)
    local at, size = 1, #text
    while at <= size do
        local first = text:byte(at)
        local more, least = 0, 0
        if first >= 0xF0 and first <= 0xF4 then more, least = 3, 0x10000
        elseif first >= 0xE0 and first < 0xF0 then more, least = 2, 0x800
        elseif first >= 0xC2 and first < 0xE0 then more, least = 1, 0x80
        elseif first >= 0x80 then return false end
        local code = first
        if more > 0 then code = first % (2 ^ (6 - more)) end
        if at + more > size then return false end
        for i = 1, more do
            local byte = text:byte(at + i)
            if byte < 0x80 or byte > 0xBF then return false end
            code = code * 64 + byte % 64
        end
        if code < least or code > 0x10FFFF or (code >= 0xD800 and code <= 0xDFFF) then return false end
        at = at + more + 1
    end
    return true
end

local function text_of(range)
    local raw = range:raw()
    local stop = raw:find("\0", 1, true)
    if stop then raw = raw:sub(1, stop - 1) end
    return raw
end

-- Returns whether the length at `at` is little-endian; nil where neither reading is a length.
local function byte_order(tvb, at)
    local little, big = tvb(at, 4):le_int(), tvb(at, 4):int()
    if little >= HEADER - PREFIX and little <= LONGEST then return true, little end
    if big >= HEADER - PREFIX and big <= LONGEST then return false, big end
    return nil
end

-- Layout.

local function fixed_size(field, width)
    if field.kind == "int" then return 4 end
    if field.kind == "real" then return width end
    if field.kind == "reals" then return field.size * width end
    if field.kind == "text" then return field.size end
    return 0
end

local function size_of(fields, width)
    local size = 0
    for _, field in ipairs(fields) do size = size + fixed_size(field, width) end
    return size
end

local function has_reals(fields)
    for _, field in ipairs(fields) do
        if field.kind == "real" or field.kind == "reals" then return true end
        if field.kind == "array" and has_reals(field.record) then return true end
    end
    return false
end

-- Returns the offset of an int field in the head of a message.
local function offset_of(fields, name, width)
    local at = 0
    for _, field in ipairs(fields) do
        if field.name == name then return at end
        at = at + fixed_size(field, width)
    end
end

-- Returns how many records the array at the end of a body holds, or nil and the reason.
local function records_in(message, array, tvb, little, width)
    local head = size_of(message.fields, width)
    local record = size_of(array.record, width)
    local rest = tvb:len() - HEADER - head
    local counted = array.count_name and 4 or 0
    local number = (rest - counted) / record
    if rest < counted or number ~= math.floor(number) or number < array.least or number > array.most then
        return nil, string.format("%d bytes are no %d to %d records of %d bytes",
            rest, array.least, array.most, record)
    end
    if array.count_name then
        local at = HEADER + head
        if array.count_place == "after" then at = at + number * record end
        local count = int_at(tvb, at, little)
        if count ~= number then
            return nil, string.format("%s is %d, the body holds %d records", array.count_name, count, number)
        end
    end
    if array.meant_by then
        local at = HEADER + offset_of(message.fields, array.meant_by, width)
        local meant = int_at(tvb, at, little)
        if meant < array.least or meant > number or (number ~= meant and number ~= array.most) then
            return nil, string.format("%s is %d, the body holds %d records", array.meant_by, meant, number)
        end
    end
    return number
end

-- Returns the first text of a body that is not UTF-8.
local function broken_text(message, tvb, width)
    local at = HEADER
    for _, field in ipairs(message.fields) do
        if field.kind == "text" and not is_utf8(text_of(tvb(at, field.size))) then return field.name end
        at = at + fixed_size(field, width)
    end
end

-- Says whether a body has the declared layout with reals of a width; the second value is why not.
local function fits(message, tvb, little, width)
    local size = tvb:len() - HEADER
    local head = size_of(message.fields, width)
    local last = message.fields[#message.fields]
    local kind = last and last.kind
    if kind == "array" then
        if size < head then
            return false, string.format("the body has %d bytes, its head %d", size, head)
        end
        local number, reason = records_in(message, last, tvb, little, width)
        if not number then return false, reason end
    elseif kind == "json" and size < head then
        return false, string.format("the body has %d bytes, its head %d", size, head)
    elseif kind ~= "json" and size ~= head then
        return false, string.format("the body has %d bytes, not %d", size, head)
    end
    local broken = broken_text(message, tvb, width)
    if broken then return false, broken .. " is not UTF-8" end
    return true
end

-- Returns the width of reals with which a body fits, or nil and the reason why none does.
local function width_of(message, tvb, little)
    local preferred = proto.prefs.real_size
    local widths = { 4, 8 }
    if preferred == 4 or preferred == 8 then widths = { preferred } end
    local first_reason
    for _, width in ipairs(widths) do
        local ok, reason = fits(message, tvb, little, width)
        if ok then return width end
        first_reason = first_reason or reason
    end
    return nil, first_reason
end

-- Showing.

local SHOWN_IN_INFO = { sequence = true, request_id = true, command = true, result = true, subcode = true, code = true }

-- Returns the names of the bits of a value, those without a name in hexadecimal; nil for none.
local function bits_of(field, value)
    local set, rest = {}, value % 2 ^ 32
    for _, bit in ipairs(field.bits) do
        if math.floor(rest / bit[1]) % 2 == 1 then
            set[#set + 1] = bit[2]
            rest = rest - bit[1]
        end
    end
    if #set == 0 then return nil end
    if rest > 0 then set[#set + 1] = string.format("0x%x", rest) end
    return table.concat(set, "|")
end

local function show_int(tree, field, tvb, at, little, notes)
    local value = int_at(tvb, at, little)
    if field.keeps then value = value % field.keeps end
    local item = tree:add(field.proto, tvb(at, 4), value)
    local bits = field.bits and bits_of(field, value)
    if bits then item:append_text(" (" .. bits .. ")") end
    if notes and SHOWN_IN_INFO[field.name] then
        notes[#notes + 1] = string.format("%s=%s", field.name, field.values and field.values[value] or value)
    end
end

local function show_reals(tree, field, tvb, at, little, width)
    local branch = tree:add(tvb(at, field.size * width), label(field))
    for index = 0, field.size - 1 do
        local place = at + index * width
        local item = branch:add(field.proto, tvb(place, width), real_at(tvb, place, little, width))
        item:prepend_text(string.format("[%d] ", index))
    end
end

local function show_json(tree, field, tvb, at)
    if at == tvb:len() then return end
    local range = tvb(at)
    local text = range:raw()
    if is_utf8(text) and not text:find("\0", 1, true) then
        tree:add(field.proto, range, text)
    else
        tree:add(field.proto, range)
    end
end

local show_fields

local function show_records(tree, message, array, tvb, at, little, width)
    local number = records_in(message, array, tvb, little, width)
    local record = size_of(array.record, width)
    if array.count_name and array.count_place == "before" then
        tree:add(array.count, tvb(at, 4), number)
        at = at + 4
    end
    for index = 0, number - 1 do
        local branch = tree:add(tvb(at, record), string.format("%s[%d]", array.name, index))
        show_fields(branch, message, array.record, tvb, at, little, width)
        at = at + record
    end
    if array.count_name and array.count_place == "after" then
        tree:add(array.count, tvb(at, 4), number)
    end
end

show_fields = function(tree, message, fields, tvb, at, little, width, notes)
    for _, field in ipairs(fields) do
        if field.kind == "int" then
            show_int(tree, field, tvb, at, little, notes)
        elseif field.kind == "real" then
            tree:add(field.proto, tvb(at, width), real_at(tvb, at, little, width))
        elseif field.kind == "reals" then
            show_reals(tree, field, tvb, at, little, width)
        elseif field.kind == "text" then
            local range = tvb(at, field.size)
            tree:add(field.proto, range, text_of(range))
        elseif field.kind == "json" then
            show_json(tree, field, tvb, at)
        else
            show_records(tree, message, field, tvb, at, little, width)
        end
        at = at + fixed_size(field, width)
    end
end

-- Frames.

local function broken_rule(msg_type, comm_type, reply_code)
    if msg_type == 0 then return "message type 0 is reserved" end
    if comm_type == 0 then return "communication type 0 is invalid" end
    if (comm_type == 3) == (reply_code == 0) then
        return string.format("reply code %d does not go with communication type %d", reply_code, comm_type)
    end
end

local function layout_of(msg_type, comm_type)
    local layouts = by_type[msg_type]
    if not layouts then return nil end
    if comm_type == 3 and layouts.reply then return layouts.reply end
    return layouts.other
end

local function show_raw(tree, tvb)
    if tvb:len() > HEADER then tree:add(header.body, tvb(HEADER)) end
end

-- Shows a body and returns what the info column says of it.
local function show_body(tree, message, tvb, comm_type, little)
    if not message then
        show_raw(tree, tvb)
        if comm_type ~= 3 or tvb:len() > HEADER then tree:add_proto_expert_info(experts.unknown) end
        return {}
    end
    if message.any_body then
        show_raw(tree, tvb)
        return {}
    end
    local width, reason = width_of(message, tvb, little)
    if not width then
        show_raw(tree, tvb)
        if comm_type ~= 3 then
            tree:add_proto_expert_info(experts.body, reason)
            return { "[malformed: " .. reason .. "]" }
        end
        if tvb:len() > HEADER then tree:add_proto_expert_info(experts.reply, reason) end
        return {}
    end
    if has_reals(message.fields) then tree:add(header.real_size, width):set_generated() end
    local notes = {}
    show_fields(tree, message, message.fields, tvb, HEADER, little, width, notes)
    return notes
end

local function show_framing_fault(tvb, pinfo, root, reason)
    local tree = root:add(proto, tvb(), "Simple message: " .. reason)
    tree:add(header.body, tvb())
    tree:add_proto_expert_info(experts.framing, reason)
    pinfo.cols.info:append("[" .. reason .. "] ")
end

-- Dissects one whole frame.
local function dissect_frame(tvb, pinfo, root)
    local size = tvb:len()
    if size < PREFIX then
        if size > 0 then show_framing_fault(tvb, pinfo, root, "less than a length") end
        return size
    end
    local little, length = byte_order(tvb, 0)
    if little == nil then
        show_framing_fault(tvb, pinfo, root, "no length between 12 and 65535 in either byte order")
        return size
    end
    local tree = root:add(proto, tvb())
    tree:add(header.length, tvb(0, 4), length)
    tree:add(header.byte_order, little and "little" or "big"):set_generated()
    if size < HEADER or size < PREFIX + length then
        if size > PREFIX then tree:add(header.body, tvb(PREFIX)) end
        tree:add_proto_expert_info(experts.cut)
        pinfo.cols.info:append("[cut short] ")
        return size
    end
    local msg_type, comm_type, reply_code = int_at(tvb, 4, little), int_at(tvb, 8, little), int_at(tvb, 12, little)
    local message = layout_of(msg_type, comm_type)
    local name = message and message.name or NAMED_OPAQUE[msg_type] or "unknown"
    tree:add(header.msg_type, tvb(4, 4), msg_type)
    tree:add(header.comm_type, tvb(8, 4), comm_type)
    tree:add(header.reply_code, tvb(12, 4), reply_code)
    tree:add(header.name, name):set_generated()
    local kind = DIRECTIONS[comm_type] or string.format("communication type %d", comm_type)
    local words = { name .. "(" .. string.format("%d", msg_type) .. ")", kind }
    if comm_type == 3 then words[#words + 1] = REPLY_CODES[reply_code] or string.format("code %d", reply_code) end
    local rule = broken_rule(msg_type, comm_type, reply_code)
    if rule then
        show_raw(tree, tvb)
        tree:add_proto_expert_info(experts.header, rule)
        words[#words + 1] = "[" .. rule .. "]"
    else
        for _, note in ipairs(show_body(tree, message, tvb, comm_type, little)) do words[#words + 1] = note end
        if comm_type == 3 and reply_code == 2 then tree:add_proto_expert_info(experts.refused) end
    end
    local summary = table.concat(words, " ")
    tree:append_text(", " .. summary)
    pinfo.cols.info:append(summary .. "  ")
    return size
end

-- Returns the size of the frame at `at`; what has no length is taken as one piece to its end.
local function frame_size(tvb, pinfo, at)
    local left = tvb:reported_length_remaining(at)
    if tvb:len() - at < PREFIX then return left end
    local little, length = byte_order(tvb, at)
    if little == nil then return left end
    return PREFIX + length
end

function proto.dissector(tvb, pinfo, tree)
    pinfo.cols.protocol = "SimpleMessage"
    pinfo.cols.info = ""
    dissect_tcp_pdus(tvb, tree, PREFIX, frame_size, dissect_frame, true)
    return tvb:len()
end

-- Takes a stream on any port whose first bytes are a frame of a known type with a sound header.
local function heuristic(tvb, pinfo, tree)
    if tvb:len() < HEADER then return false end
    local little = byte_order(tvb, 0)
    if little == nil then return false end
    local msg_type, comm_type, reply_code = int_at(tvb, 4, little), int_at(tvb, 8, little), int_at(tvb, 12, little)
    if not by_type[msg_type] or comm_type < 1 or comm_type > 3 then return false end
    if reply_code < 0 or reply_code > 2 or broken_rule(msg_type, comm_type, reply_code) then return false end
    pinfo.conversation = proto
    proto.dissector(tvb, pinfo, tree)
    return true
end

proto:register_heuristic("tcp", heuristic)

local tcp_ports = DissectorTable.get("tcp.port")
local registered = ""

local function register_ports()
    if registered ~= "" then tcp_ports:remove(registered, proto) end
    registered = proto.prefs.ports
    if registered ~= "" then tcp_ports:add(registered, proto) end
end

proto.prefs_changed = register_ports
register_ports()
