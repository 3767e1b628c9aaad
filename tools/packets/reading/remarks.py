"""Remarks on messages, one sentence each: verdicts, and addresses of Motoman's.

Owns which messages have a remark. The texts are the catalogue's, loaded only when one is needed.
"""

from __future__ import annotations

from openpendant.simplemsg import Message
from openpendant.simplemsg import motoman as m

_IO_REPLIES = (
    m.MotomanReadSingleIoReply,
    m.MotomanWriteSingleIoReply,
    m.MotomanReadGroupIoReply,
    m.MotomanWriteGroupIoReply,
    m.MotomanReadMregisterReply,
    m.MotomanWriteMregisterReply,
)


def remark_on(message: Message) -> str:
    """Return meaning and remedy of a verdict that is no success, or what an I/O address names.

    Returns:
        A line; empty where there is nothing to say.
    """
    match message:
        case m.MotomanMotionReply() if message.result:
            return _motion_verdict(message)
        case _ if isinstance(message, _IO_REPLIES) and message.result_code:
            return _io_verdict(message.result_code)
        case m.MotomanReadSingleIo() | m.MotomanWriteSingleIo():
            return _areas(message.address)
        case m.MotomanReadGroupIo() | m.MotomanWriteGroupIo():
            return _areas(10 * message.address)
    return ""


def is_failed_verdict(message: Message) -> bool:
    """Return True if the body says that a request failed, whatever the header says."""
    if isinstance(message, m.MotomanMotionReply):
        return message.result != 0
    return isinstance(message, _IO_REPLIES) and message.result_code != 0


def _motion_verdict(reply: m.MotomanMotionReply) -> str:
    from openpendant.simplemsg.motoman_catalogue import explain  # most packets need no such text

    told = explain(reply.command, reply.result, reply.subcode)
    return f"{told.name}: {told.meaning} {told.remedy}"


def _io_verdict(number: int) -> str:
    from openpendant.simplemsg.motoman_catalogue import IO_RESULTS  # as above

    for result, entry in IO_RESULTS.items():
        if result == number:
            return f"{result.name}: {entry.cause} {entry.remedy}"
    return f"result {number}: This result is unknown."


def _areas(bit: int) -> str:
    """Return the purpose of a bit address in words; the models of the controller differ."""
    from openpendant.simplemsg.motoman_addresses import ControllerModel, area_of  # as above

    models: dict[str, list[str]] = {}
    for controller in ControllerModel:
        area = area_of(controller, bit)
        what = "nothing" if area is None else area.name
        if area is not None and area.writable:
            what += " (can be written)"
        models.setdefault(what, []).append(controller.value)
    if len(models) == 1:
        (what,) = models
        return f"bit {bit}: {what}"
    return f"bit {bit}: " + "; ".join(f"{what} on {', '.join(on)}" for what, on in models.items())
