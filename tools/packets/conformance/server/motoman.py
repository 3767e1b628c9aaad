"""Section Y: the Motoman dialect, MotoROS for ROS 1; only with `--dialect motoman`.

Nothing here starts trajectory mode or switches power, so nothing moves: what is asked are
questions, stops, and requests that must be refused.
"""

from __future__ import annotations

from openpendant.simplemsg import (
    CommType,
    GetVersion,
    JointTrajPtFull,
    Message,
    MsgType,
    ReplyCode,
    ValidField,
    joint_array,
)
from openpendant.simplemsg.motoman import (
    MotionCommand,
    MotionResult,
    MotomanGetDhParameters,
    MotomanMotionCtrl,
    MotomanMotionReply,
    MotomanReadSingleIo,
    MotomanReadSingleIoReply,
    MotomanSelectTool,
    Subcode,
)

from ..findings import PASSED, CheckFinding, CheckVerdict, deviates
from .checks import DIALECT, check
from .monitor import rate
from .recordings import Sample, sample
from .target import Target
from .wire import CannotJudge, RuleBroken, raw_frame

_NO_COMMAND = 200_199
_DH_BYTES = 512
_EMPTY = joint_array(())


async def _ask(target: Target, message: Message | bytes, what: str) -> MotomanMotionReply:
    """Ask and return the 2002 that must be the answer."""
    reply = await (await target.motion()).ask(message, what)
    found = reply.message()
    if not isinstance(found, MotomanMotionReply):
        raise RuleBroken(f"{what} was answered by {reply}, not by type 2002")
    return found


def _control(command: int, group: int = 0, sequence: int = 17) -> MotomanMotionCtrl:
    return MotomanMotionCtrl(group, sequence, command, _EMPTY)


def _point(**changed: object) -> JointTrajPtFull:
    valid = int(ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY)
    point = JointTrajPtFull(0, 1, valid, 1.0, _EMPTY, _EMPTY, _EMPTY)
    for name, value in changed.items():
        setattr(point, name, value)
    return point


def _expect(found: MotomanMotionReply, what: str, *accepted: tuple[int, int]) -> CheckFinding:
    """Judge result and subcode; -1 as a subcode accepts any."""
    for result, subcode in accepted:
        if found.result == result and subcode in (-1, found.subcode):
            return CheckFinding(CheckVerdict.PASSED, f"result {result}, subcode {found.subcode}")
    raise RuleBroken(f"{what}: result {found.result}, subcode {found.subcode}")


async def _refused(target: Target, point: JointTrajPtFull, subcode: int, what: str) -> CheckFinding:
    """Send a point that must not be taken; a controller that is not ready says that first."""
    found = await _ask(target, point, what)
    if found.result == MotionResult.NOT_READY:
        raise CannotJudge(f"the controller is not ready (5/{found.subcode}) and looks no further")
    return _expect(found, what, (MotionResult.INVALID, subcode))


@check("YS01", profiles=DIALECT)
async def _ready(target: Target) -> CheckFinding:
    found = await _ask(target, _control(MotionCommand.CHECK_MOTION_READY), "CHECK_MOTION_READY")
    if found.result == MotionResult.FAILURE and not 5000 <= found.subcode <= 5012:
        raise RuleBroken(f"not ready for reason {found.subcode}; known: 5000 to 5012")
    return _expect(
        found, "CHECK_MOTION_READY", (MotionResult.SUCCESS, -1), (MotionResult.FAILURE, -1)
    )


@check("YS02", profiles=DIALECT)
async def _quotes(target: Target) -> CheckFinding:
    for sequence in (1, 4711):
        found = await _ask(
            target, _control(MotionCommand.CHECK_MOTION_READY, sequence=sequence), "a question"
        )
        if (found.robot_id, found.sequence, found.command) != (
            0,
            sequence,
            MotionCommand.CHECK_MOTION_READY,
        ):
            raise RuleBroken(
                f"group 0, sequence {sequence} and the command came back as"
                f" {found.robot_id}, {found.sequence}, {found.command}"
            )
    return PASSED


@check("YS03", profiles=DIALECT)
async def _header(target: Target) -> CheckFinding:
    for message in (
        _control(MotionCommand.CHECK_MOTION_READY),
        _control(_NO_COMMAND),
        _point(sequence=-1),
    ):
        found = await _ask(target, message, "a request")
        if found.comm_type != CommType.REPLY or found.reply_code != ReplyCode.SUCCESS:
            raise RuleBroken(f"comm {found.comm_type}, code {found.reply_code}")
    return PASSED


@check("YS04", profiles=DIALECT)
async def _unknown_type(target: Target) -> CheckFinding:
    wire = await target.motion()
    frame = await wire.ask(raw_frame(wire.codec, 9999, CommType.REQUEST), "an unknown type")
    found = frame.message()
    if not isinstance(found, MotomanMotionReply):
        raise RuleBroken(f"an unknown type was answered by {frame}")
    if found.command != 9999:
        raise RuleBroken(f"the reply quotes command {found.command}, not the type 9999")
    await wire.ask(_control(MotionCommand.CHECK_MOTION_READY), "a question after an unknown type")
    return _expect(found, "an unknown type", (MotionResult.INVALID, Subcode.INVALID_MESSAGE_TYPE))


@check("YS05", profiles=DIALECT)
async def _unknown_command(target: Target) -> CheckFinding:
    wire = await target.motion()
    before = (await wire.ask(_control(MotionCommand.CHECK_MOTION_READY), "a question")).message()
    frame = await wire.ask(_control(_NO_COMMAND), "an unknown command")
    found = frame.message()
    if not isinstance(found, MotomanMotionReply):
        raise RuleBroken(f"an unknown command was answered by {frame}")
    if found == before:
        return deviates("MotoROS: an unknown command repeats the reply before", str(frame))
    return _expect(found, "an unknown command", (MotionResult.INVALID, Subcode.INVALID_COMMAND))


@check("YS06", profiles=DIALECT)
async def _queue(target: Target) -> CheckFinding:
    found = await _ask(target, _control(MotionCommand.CHECK_QUEUE_CNT), "CHECK_QUEUE_CNT")
    if found.result != MotionResult.SUCCESS or found.subcode < 0:
        raise RuleBroken(f"CHECK_QUEUE_CNT: result {found.result}, subcode {found.subcode}")
    bad = await _ask(
        target, _control(MotionCommand.CHECK_QUEUE_CNT, group=9), "CHECK_QUEUE_CNT of group 9"
    )
    if (bad.result, bad.subcode) != (MotionResult.FAILURE, -1):
        raise RuleBroken(f"group 9: result {bad.result}, subcode {bad.subcode}")
    return PASSED


@check("YS07", profiles=DIALECT)
async def _stop(target: Target) -> CheckFinding:
    return _expect(
        await _ask(target, _control(MotionCommand.STOP_MOTION), "STOP_MOTION"),
        "STOP_MOTION",
        (MotionResult.SUCCESS, -1),
    )


@check("YS08", profiles=DIALECT)
async def _no_velocity(target: Target) -> CheckFinding:
    valid = int(ValidField.TIME | ValidField.POSITION)
    return await _refused(
        target,
        _point(valid_fields=valid),
        Subcode.INVALID_INSUFFICIENT_FIELDS,
        "a point without velocity",
    )


@check("YS09", profiles=DIALECT)
async def _bad_group(target: Target) -> CheckFinding:
    return await _refused(target, _point(robot_id=9), Subcode.INVALID_GROUP, "a point for group 9")


@check("YS10", profiles=DIALECT)
async def _negative_sequence(target: Target) -> CheckFinding:
    return await _refused(
        target, _point(sequence=-4), Subcode.INVALID_SEQUENCE, "a point of sequence -4"
    )


@check("YS11", profiles=DIALECT)
async def _far_time(target: Target) -> CheckFinding:
    return await _refused(
        target, _point(time=14_401.0), Subcode.INVALID_TIME, "a point after four hours"
    )


@check("YS12", profiles=DIALECT)
async def _dh(target: Target) -> CheckFinding:
    reply = await (await target.motion()).ask(MotomanGetDhParameters(), "GET_DH_PARAMETERS")
    if reply.msg_type == MotomanMotionReply.PLACE.msg_type:
        return deviates("MotoROS before 1.9: no DH parameters", str(reply))
    if reply.msg_type != 2020 or len(reply.body) != _DH_BYTES:
        raise RuleBroken(f"GET_DH_PARAMETERS was answered by {reply}")
    return PASSED


@check("YS13", profiles=DIALECT)
async def _read_bit(target: Target) -> CheckFinding:
    wire = await target.motion()
    for address, codes in ((80_025, (0,)), (18, (1001,)), (999_999, (1001,))):
        reply = await wire.ask(MotomanReadSingleIo(address), f"bit {address}")
        found = reply.message()
        if not isinstance(found, MotomanReadSingleIoReply) or found.value not in (0, 1):
            raise RuleBroken(f"bit {address} was answered by {reply}")
        if found.result_code not in codes:
            raise RuleBroken(f"bit {address}: code {found.result_code}, expected {codes[0]}")
        if (found.reply_code == ReplyCode.SUCCESS) != (found.result_code == 0):
            raise RuleBroken(f"bit {address}: header {found.reply_code}, code {found.result_code}")
    return PASSED


@check("YS14", profiles=DIALECT)
async def _register(target: Target) -> CheckFinding:
    wire = await target.motion()
    body = wire.encode(MotomanReadSingleIo(5))[16:]
    frame = raw_frame(wire.codec, 2012, CommType.REQUEST, body=body)
    return _expect(
        await _ask(target, frame, "type 2012"),
        "type 2012",
        (MotionResult.INVALID, Subcode.INVALID_MESSAGE_TYPE),
    )


@check("YS15", profiles=DIALECT)
async def _bad_tool(target: Target) -> CheckFinding:
    found = await _ask(target, MotomanSelectTool(0, 64, 3), "tool 64")
    return _expect(found, "tool 64", (MotionResult.INVALID, Subcode.INVALID_TOOL))


@check("YS16", profiles=DIALECT)
async def _version(target: Target) -> CheckFinding:
    found = await _ask(target, GetVersion(), "GET_VERSION")
    return _expect(found, "GET_VERSION", (MotionResult.INVALID, Subcode.INVALID_MESSAGE_TYPE))


@check("YS17", profiles=DIALECT)
async def _state(target: Target) -> CheckFinding:
    taken: Sample = await target.once("the state at rest", sample)
    kinds = {frame.msg_type for frame in taken.frames}
    if not {MsgType.JOINT_FEEDBACK, MsgType.STATUS} <= kinds:
        raise RuleBroken(f"types {sorted(kinds)}; expected 15 and 13")
    found = rate([told.time for told in taken.statuses])
    if not 25 <= found <= 45:
        raise RuleBroken(f"STATUS at {found:.3g} Hz; expected 40")
    return CheckFinding(CheckVerdict.PASSED, f"{found:.3g} Hz")
