"""One sample of every declared message. Reals are exact in four bytes, arrays tell slots apart."""

from __future__ import annotations

from openpendant.simplemsg import (
    MOTOMAN,
    PENDANT,
    STANDARD,
    GetVersion,
    GetVersionReply,
    JointFeedback,
    JointPosition,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    Ping,
    Status,
    TrajPoint,
)
from openpendant.simplemsg import motoman as m
from openpendant.simplemsg import pendant as p


def _ramp(first: float, count: int = 10) -> tuple[float, ...]:
    return tuple(first + 0.25 * index for index in range(count))


_A, _B, _C = _ramp(-1.0), _ramp(5.0), _ramp(-9.5)
_XYZ, _QUATERNION = (0.5, -0.25, 1.75), (0.0, -0.5, 0.0, 0.5)
_GROUPS = tuple(m.MotomanGroup(number, 15, 0.5 * number, _A, _B, _C) for number in range(4))

_ALL: tuple[Message, ...] = (
    Ping(),
    GetVersion(),
    GetVersionReply(1, 2, 3),
    JointPosition(0, _A),
    JointTrajPt(7, _A, 0.125, 2.5),
    JointTraj((TrajPoint(0, _A, 0.125, 2.5), TrajPoint(1, _B, 0.25, 0.75))),
    Status(1, 0, -77, 1, -1, 2, 1),
    JointTrajPtFull(1, 9, 15, 0.5, _A, _B, _C),
    JointFeedback(1, 7, 0.5, _A, _B, _C),
    m.MotomanMotionCtrl(0, 4, 200101, _A),
    m.MotomanMotionReply(0, 4, 200101, 3, 3004, _A),
    m.MotomanReadSingleIo(27010),
    m.MotomanReadSingleIoReply(1, 0),
    m.MotomanWriteSingleIo(27010, 1),
    m.MotomanWriteSingleIoReply(1001),
    m.MotomanReadGroupIo(2701),
    m.MotomanReadGroupIoReply(255, 0),
    m.MotomanWriteGroupIo(2701, 128),
    m.MotomanWriteGroupIoReply(0),
    m.MotomanReadMregister(999),
    m.MotomanReadMregisterReply(65535, 0),
    m.MotomanWriteMregister(559, 65535),
    m.MotomanWriteMregisterReply(0),
    m.MotomanJointTrajPtFullEx(2, 5, _GROUPS[:2]),
    m.MotomanJointFeedbackEx(2, _GROUPS),
    m.MotomanSelectTool(0, 63, 8),
    m.MotomanGetDhParameters(),
    m.MotomanGetDhParametersReply(_ramp(0.0, 128)),
    p.Hello(1, 25.0, "cell-a", "Kleine Taste äöü"),
    p.HelloReply(1, 7, 31, 65532, 6, 100.0, 125.0, 3.0, "cell-a", "ur5", "openpendant 0.1.0"),
    p.Management(3, b'{"op":"snapshot"}'),
    p.Verdict(3, 45, 2, 3.5, 3.25, "joint elbow: 3.5 rad is beyond 3.25 rad"),
    p.Outcome(3, 2, 61, -1, 0.5, 0.25, 0.0625, 1.5, "the controller was silent for 500 ms"),
    p.Subscribe(4, 25.0),
    p.Authority(5, 1),
    p.AuthorityBeat(),
    # Whatever writes messages down writes asterisks for these, so that only asterisks come back.
    p.Login(12, 1, "Ada", "********"),
    p.SetAccount(22, 2, "Grace", "********"),
    p.Pairing(23, 1),
    p.PairingReply(23, 900, "********"),
    p.JointMove(6, 0.5, 6, _A),
    p.PoseMove(7, 2, 0.25, "base", _XYZ, _QUATERNION),
    p.JointPath(8, 0.5, 6, (p.JointWaypoint(_A), p.JointWaypoint(_B))),
    p.PosePath(9, 1, 0.5, "root", (p.PoseWaypoint(_XYZ, _QUATERNION),)),
    p.SoftwareStop(10, "a person stepped in"),
    p.ResetStop(11),
    p.Enabling(1),
    p.SetMode(13, 2),
    p.SetSpeed(14, 0.5, 0.125),
    p.MotionControl(15, 1),
    p.JogStart(16, 5, 991, 0.125, 2, "table", 6, _A),
    p.JogBeat(5, 3),
    p.JogRelease(17, 5),
    p.JogStep(18, 0.5, 1, "", 6, _B),
    p.JogUndo(19, 0.25),
    p.ProgramRun(20, 1, 12, 3, 5, 0.5, "Kleine Kiste"),
    p.Home(21, 0.125, "home"),
    p.State(
        sequence=1,
        time_s=1234,
        time_ns=999_999_999,
        age=0.0078125,
        dropped=2,
        activity=3,
        request_id=9,
        holder=7,
        stop=1,
        operating_mode=1,
        enabling=1,
        override=0.75,
        tool_speed_cap=0.25,
        jog_scale=0.5,
        jog_reason=2,
        jog_joint=3,
        program_state=2,
        program_line=17,
        link=2,
        drives_powered=1,
        e_stopped=0,
        error_code=-5,
        in_error=0,
        in_motion=1,
        mode=2,
        motion_possible=0,
        valid_fields=22,
        tool_speed=0.125,
        positions=_A,
        velocities=_B,
        tool_position=_XYZ,
        tool_orientation=_QUATERNION,
    ),
    p.AuthorityChanged(7, 3, "Kleine Taste"),
    p.StopChanged(1, 7, "Kleine Taste", "a person stepped in"),
    p.AuthorityWanted(8, "Große Taste"),
    p.ModeChanged(2, 7, "Kleine Taste"),
    p.JogEnded(5, 2, 0.125, 0.0625, 0.03125, _C),
    p.ProgramReport(2, 17, 1, 5, "Kleine Kiste", "paused on the way to P3"),
    p.OperatorEvent(2),
    p.ReadSignals(16),
    p.ReadSignalsReply(16, 0xA5, 0x8001, 24, 32),
    p.WriteOutputs(0, 0x0F, 0x05),
    p.SetInputs(16, 0x8000, 0x8000),
)

SAMPLES: dict[type[Message], Message] = {type(sample): sample for sample in _ALL}

_SHARED = set(STANDARD.messages)

# A message that all dialects share is tried in the first of them.
DECLARED: dict[str, type[Message]] = {
    f"{dialect.name}:{cls.__name__}": cls
    for dialect in (STANDARD, MOTOMAN, PENDANT)
    for cls in dialect.messages
    if dialect is STANDARD or cls not in _SHARED
}
