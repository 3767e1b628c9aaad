"""Section Y: the Motoman dialect, MotoROS for ROS 1; only with `--dialect motoman`.

Nothing here starts trajectory mode or switches power, so nothing moves: what is asked are
questions, stops, and requests that must be refused.
"""

from __future__ import annotations

from functools import partial

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

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, deviates, passed
from .answers import full_point
from .checks import DIALECT, check, check_on
from .monitor import rate
from .recordings import Sample, at_rest
from .target import Target
from .wire import Wire, raw_frame

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
    point = full_point(1, _EMPTY, 1.0)
    for name, value in changed.items():
        setattr(point, name, value)
    return point


def _expect(found: MotomanMotionReply, what: str, *accepted: tuple[int, int]) -> CheckFinding:
    """Judge result and subcode; -1 as a subcode accepts any."""
    for result, subcode in accepted:
        if found.result == result and subcode in (-1, found.subcode):
            return passed(f"result {result}, subcode {found.subcode}")
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
async def _quotes(target: Target) -> None:
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


@check("YS03", profiles=DIALECT)
async def _header(target: Target) -> None:
    for message in (
        _control(MotionCommand.CHECK_MOTION_READY),
        _control(_NO_COMMAND),
        _point(sequence=-1),
    ):
        found = await _ask(target, message, "a request")
        if found.comm_type != CommType.REPLY or found.reply_code != ReplyCode.SUCCESS:
            raise RuleBroken(f"comm {found.comm_type}, code {found.reply_code}")


@check_on(Target.motion, "YS04", profiles=DIALECT)
async def _unknown_type(wire: Wire) -> CheckFinding:
    frame = await wire.ask(raw_frame(wire.codec, 9999, CommType.REQUEST), "an unknown type")
    found = frame.message()
    if not isinstance(found, MotomanMotionReply):
        raise RuleBroken(f"an unknown type was answered by {frame}")
    if found.command != 9999:
        raise RuleBroken(f"the reply quotes command {found.command}, not the type 9999")
    await wire.ask(_control(MotionCommand.CHECK_MOTION_READY), "a question after an unknown type")
    return _expect(found, "an unknown type", (MotionResult.INVALID, Subcode.INVALID_MESSAGE_TYPE))


@check_on(Target.motion, "YS05", profiles=DIALECT)
async def _unknown_command(wire: Wire) -> CheckFinding:
    before = (await wire.ask(_control(MotionCommand.CHECK_MOTION_READY), "a question")).message()
    frame = await wire.ask(_control(_NO_COMMAND), "an unknown command")
    found = frame.message()
    if not isinstance(found, MotomanMotionReply):
        raise RuleBroken(f"an unknown command was answered by {frame}")
    if found == before:
        return deviates("MotoROS: an unknown command repeats the reply before", str(frame))
    return _expect(found, "an unknown command", (MotionResult.INVALID, Subcode.INVALID_COMMAND))


@check("YS06", profiles=DIALECT)
async def _queue(target: Target) -> None:
    found = await _ask(target, _control(MotionCommand.CHECK_QUEUE_CNT), "CHECK_QUEUE_CNT")
    if found.result != MotionResult.SUCCESS or found.subcode < 0:
        raise RuleBroken(f"CHECK_QUEUE_CNT: result {found.result}, subcode {found.subcode}")
    bad = await _ask(
        target, _control(MotionCommand.CHECK_QUEUE_CNT, group=9), "CHECK_QUEUE_CNT of group 9"
    )
    if (bad.result, bad.subcode) != (MotionResult.FAILURE, -1):
        raise RuleBroken(f"group 9: result {bad.result}, subcode {bad.subcode}")


async def _answered(
    target: Target, message: Message, what: str, accepted: tuple[int, int]
) -> CheckFinding:
    return _expect(await _ask(target, message, what), what, accepted)


_UNKNOWN_TOOL = (MotionResult.INVALID, Subcode.INVALID_TOOL)
_UNKNOWN_TYPE = (MotionResult.INVALID, Subcode.INVALID_MESSAGE_TYPE)

_QUESTIONS: tuple[tuple[str, str, Message, tuple[int, int]], ...] = (
    ("YS07", "STOP_MOTION", _control(MotionCommand.STOP_MOTION), (MotionResult.SUCCESS, -1)),
    ("YS15", "tool 64", MotomanSelectTool(0, 64, 3), _UNKNOWN_TOOL),
    ("YS16", "GET_VERSION", GetVersion(), _UNKNOWN_TYPE),
)
for _number, _what, _question, _answer in _QUESTIONS:
    check(_number, profiles=DIALECT)(
        partial(_answered, message=_question, what=_what, accepted=_answer)
    )

_NO_VELOCITY = {"valid_fields": int(ValidField.TIME | ValidField.POSITION)}

for _number, _what, _changed, _subcode in (
    ("YS08", "a point without velocity", _NO_VELOCITY, Subcode.INVALID_INSUFFICIENT_FIELDS),
    ("YS09", "a point for group 9", {"robot_id": 9}, Subcode.INVALID_GROUP),
    ("YS10", "a point of sequence -4", {"sequence": -4}, Subcode.INVALID_SEQUENCE),
    ("YS11", "a point after four hours", {"time": 14_401.0}, Subcode.INVALID_TIME),
):
    check(_number, profiles=DIALECT)(
        partial(_refused, point=_point(**_changed), subcode=_subcode, what=_what)
    )


@check("YS12", profiles=DIALECT)
async def _dh(target: Target) -> CheckFinding:
    reply = await (await target.motion()).ask(MotomanGetDhParameters(), "GET_DH_PARAMETERS")
    if reply.msg_type == MotomanMotionReply.PLACE.msg_type:
        return deviates("MotoROS before 1.9: no DH parameters", str(reply))
    if reply.msg_type != 2020 or len(reply.body) != _DH_BYTES:
        raise RuleBroken(f"GET_DH_PARAMETERS was answered by {reply}")
    return PASSED


@check_on(Target.motion, "YS13", profiles=DIALECT)
async def _read_bit(wire: Wire) -> None:
    for address, codes in ((80_025, (0,)), (18, (1001,)), (999_999, (1001,))):
        reply = await wire.ask(MotomanReadSingleIo(address), f"bit {address}")
        found = reply.message()
        if not isinstance(found, MotomanReadSingleIoReply) or found.value not in (0, 1):
            raise RuleBroken(f"bit {address} was answered by {reply}")
        if found.result_code not in codes:
            raise RuleBroken(f"bit {address}: code {found.result_code}, expected {codes[0]}")
        if (found.reply_code == ReplyCode.SUCCESS) != (found.result_code == 0):
            raise RuleBroken(f"bit {address}: header {found.reply_code}, code {found.result_code}")


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


@check_on(at_rest, "YS17", profiles=DIALECT)
async def _state(taken: Sample) -> CheckFinding:
    kinds = {frame.msg_type for frame in taken.frames}
    if not {MsgType.JOINT_FEEDBACK, MsgType.STATUS} <= kinds:
        raise RuleBroken(f"types {sorted(kinds)}; expected 15 and 13")
    found = rate([told.time for told in taken.statuses])
    if not 25 <= found <= 45:
        raise RuleBroken(f"STATUS at {found:.3g} Hz; expected 40")
    return passed(f"{found:.3g} Hz")
