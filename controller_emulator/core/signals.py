"""Digital inputs and outputs of the emulated controller.

Owns their values and which messages about them are refused. Signals move nothing: an emergency stop
leaves them as they are. Knows no motion and no sockets.
"""

from __future__ import annotations

from openpendant.simplemsg import CommType, Message, ReplyCode, accepted, refused
from openpendant.simplemsg.pendant import ReadSignals, ReadSignalsReply, SetInputs, WriteOutputs

BANK = 16
"""Signals of one message."""


class DigitalSignals:
    """All inputs and outputs, off at first.

    Attributes:
        inputs: their values, by number from 0.
        outputs: likewise.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        """Make so many of each."""
        self.inputs = [False] * inputs
        self.outputs = [False] * outputs

    def answer(self, message: ReadSignals | WriteOutputs | SetInputs) -> Message | None:
        """Do what a message asks for; return the reply, None where it wants none."""
        match message:
            case ReadSignals():
                return self._read(message) if message.comm_type == CommType.REQUEST else None
            case WriteOutputs():
                done = _set(self.outputs, message)
            case SetInputs():
                done = _set(self.inputs, message)
        if message.comm_type != CommType.REQUEST:
            return None
        return accepted(message) if done else refused(message)

    def _read(self, message: ReadSignals) -> Message:
        first = message.first
        if not _is_bank(first) or first >= max(len(self.inputs), len(self.outputs)):
            return refused(message)
        return ReadSignalsReply(
            first=first,
            inputs=_bits(self.inputs, first),
            outputs=_bits(self.outputs, first),
            input_count=len(self.inputs),
            output_count=len(self.outputs),
            reply_code=ReplyCode.SUCCESS,
        )


def _is_bank(first: int) -> bool:
    return first >= 0 and first % BANK == 0


def _bits(values: list[bool], first: int) -> int:
    return sum(1 << bit for bit, value in enumerate(values[first : first + BANK]) if value)


def _set(signals: list[bool], message: WriteOutputs | SetInputs) -> bool:
    """Set all masked signals, or none where one of them is not there."""
    masked = [bit for bit in range(BANK) if message.mask >> bit & 1]
    if not _is_bank(message.first) or any(message.first + bit >= len(signals) for bit in masked):
        return False
    for bit in masked:
        signals[message.first + bit] = bool(message.values >> bit & 1)
    return True
