"""Digital inputs and outputs of the emulated controller."""

from __future__ import annotations

import pytest
from rigs.cells.controller_rig import FAILURE, SUCCESS, ControllerRig

from openpendant.controller_emulator.core.signals import DigitalSignals
from openpendant.simplemsg import CommType
from openpendant.simplemsg.pendant import (
    OperatorAction,
    ReadSignals,
    ReadSignalsReply,
    SetInputs,
    WriteOutputs,
)


@pytest.fixture
def rig() -> ControllerRig:
    return ControllerRig(signals=DigitalSignals(20, 16))


def _read(rig: ControllerRig, first: int = 0) -> ReadSignalsReply:
    reply = rig.controller.answer(ReadSignals(first), rig.now)
    assert isinstance(reply, ReadSignalsReply)
    return reply


def test_only_masked_outputs_are_set(rig: ControllerRig) -> None:
    rig.code(WriteOutputs(0, 0b1111, 0b0101))
    assert rig.code(WriteOutputs(0, 0b0011, 0b0010)) == SUCCESS
    assert _read(rig).outputs == 0b0110


def test_inputs_are_set_by_the_operator_and_not_by_writing(rig: ControllerRig) -> None:
    assert rig.code(SetInputs(16, 0b1000, 0b1000)) == SUCCESS
    assert rig.code(WriteOutputs(0, 0b1, 0b1)) == SUCCESS
    assert (_read(rig, 16).inputs, _read(rig).inputs) == (0b1000, 0)


def test_a_reply_says_how_many_there_are(rig: ControllerRig) -> None:
    assert (_read(rig).input_count, _read(rig).output_count) == (20, 16)


@pytest.mark.parametrize(
    "message",
    [
        WriteOutputs(16, 1, 1),
        WriteOutputs(1, 1, 1),
        WriteOutputs(-16, 1, 1),
        SetInputs(16, 0b10000, 0),
        ReadSignals(32),
        ReadSignals(7),
    ],
    ids=repr,
)
def test_signals_that_are_not_there_are_refused(
    rig: ControllerRig, message: WriteOutputs | SetInputs | ReadSignals
) -> None:
    assert rig.code(message) == FAILURE


def test_a_write_beyond_the_end_sets_none(rig: ControllerRig) -> None:
    rig.code(SetInputs(16, 0b11111, 0b11111))
    assert _read(rig, 16).inputs == 0


def test_without_operator_events_nobody_sets_inputs() -> None:
    rig = ControllerRig(signals=DigitalSignals(16, 16), operator_events=False)
    assert rig.code(SetInputs(0, 1, 1)) == FAILURE
    assert rig.code(WriteOutputs(0, 1, 1)) == SUCCESS


def test_an_emergency_stop_leaves_the_outputs_alone(rig: ControllerRig) -> None:
    rig.code(WriteOutputs(0, 1, 1))
    rig.operate(OperatorAction.EMERGENCY_STOP)
    assert _read(rig).outputs == 1


def test_a_topic_is_obeyed_without_an_answer(rig: ControllerRig) -> None:
    assert rig.send(WriteOutputs(0, 1, 1, comm_type=CommType.TOPIC)) == []
    assert _read(rig).outputs == 1
