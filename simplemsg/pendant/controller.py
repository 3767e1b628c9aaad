"""Our additions between server and controller: signals, and what only an emulated one has."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Reply
from .places import from_controller, to_controller


class OperatorAction(IntEnum):
    """What a person does at an emulated controller (training only), and a question to it."""

    EMERGENCY_STOP = 1
    RESET = 2
    IDENTIFY = 3


@to_controller(
    65100,
    "operator_event",
    "TRAINING: what a person does at an emulated controller; a real one refuses it. Action 3"
    " does nothing: a success says that the controller is emulated. The server asks that once"
    " at each connect, on the state connection only.",
    reply="operator_event, header only",
)
class OperatorEvent(Message):
    """OPERATOR_EVENT: an emergency stop or a reset at the emulated controller, or whether it is."""

    action: Annotated[int, Int("1 emergency stop, 2 reset, 3 identify", values=OperatorAction)]


@to_controller(
    65110,
    "read_signals",
    "Asks for sixteen digital inputs and outputs; on the motion or the state connection.",
    reply="read_signals",
)
class ReadSignals(Message):
    """READ_SIGNALS request."""

    first: Annotated[int, Int("number of the first signal: 0, 16, 32, …")]


@from_controller(
    65110, "read_signals", "Sixteen digital inputs and outputs, and how many of each there are."
)
class ReadSignalsReply(Reply):
    """READ_SIGNALS reply; bit 0 is the signal `first`."""

    first: Annotated[int, Int("number of the first signal, as asked")]
    inputs: Annotated[int, Int("bits: the inputs", mask=0xFFFF)]
    outputs: Annotated[int, Int("bits: the outputs", mask=0xFFFF)]
    input_count: Annotated[int, Int("inputs in all")]
    output_count: Annotated[int, Int("outputs in all")]


@to_controller(
    65111,
    "write_outputs",
    "Sets some of sixteen digital outputs; refused where there is no such output.",
    reply="write_outputs, header only",
)
class WriteOutputs(Message):
    """WRITE_OUTPUTS: all of the masked outputs, or none."""

    first: Annotated[int, Int("number of the first signal: 0, 16, 32, …")]
    mask: Annotated[int, Int("bits: the outputs that are set", mask=0xFFFF)]
    values: Annotated[int, Int("bits: their values", mask=0xFFFF)]


@to_controller(
    65112,
    "set_inputs",
    "TRAINING: sets inputs of an emulated controller, as its cabling would.",
    reply="set_inputs, header only",
)
class SetInputs(Message):
    """SET_INPUTS: all of the masked inputs, or none."""

    first: Annotated[int, Int("number of the first signal: 0, 16, 32, …")]
    mask: Annotated[int, Int("bits: the inputs that are set", mask=0xFFFF)]
    values: Annotated[int, Int("bits: their values", mask=0xFFFF)]
