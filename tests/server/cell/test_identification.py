import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import FAILURE, SUCCESS, ServerRig, ready

from openpendant.server.cell.robot_cell import PATIENCE_NS
from openpendant.server.events.effects import LogLine, QueryController
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import HeaderOnly, Malformed, Unasked
from openpendant.simplemsg.errors import MessageFault
from openpendant.simplemsg.pendant import Activity, OperatorAction, OperatorEvent
from openpendant.simplemsg.verdicts import VerdictCode as V

STATE, MOTION, STOP = ControllerPath.STATE, ControllerPath.MOTION, ControllerPath.STOP
TYPE = OperatorEvent.PLACE.msg_type


def asked(rig: ServerRig) -> int:
    return sum(
        isinstance(item, QueryController) and item.message == OperatorEvent(OperatorAction.IDENTIFY)
        for _, item in rig.log
    )


def say(rig: ServerRig, code: int, *, again: bool = False) -> list[str]:
    reply = HeaderOnly(TYPE, reply_code=code)
    out = rig.hear(STATE, Unasked(reply) if again else reply)
    return [item.text for item in out if isinstance(item, LogLine)]


def test_it_is_asked_once_on_the_state_connection_and_nowhere_else() -> None:
    rig = ServerRig()
    for path in (MOTION, STOP):
        rig.path(path, True)
    assert asked(rig) == 0
    rig.path(STATE, True)
    assert asked(rig) == 1
    rig.wait(5_000)
    assert asked(rig) == 1


def test_silence_is_a_real_controller() -> None:
    rig = ready()
    rig.wait(5_000)
    assert not rig.core.cell.feedback.says_emulated


@pytest.mark.parametrize(("code", "is_emulated"), [(SUCCESS, True), (FAILURE, False), (7, False)])
def test_only_a_success_says_that_it_is_emulated(code: int, is_emulated: bool) -> None:
    rig = ready()
    assert say(rig, code) == []
    assert rig.core.cell.feedback.says_emulated is is_emulated


def test_an_answer_that_cannot_be_read_is_none() -> None:
    rig = ready()
    rig.hear(STATE, Malformed(TYPE, 3, MessageFault("a bare reply has no body", TYPE, 3, 1)))
    assert not rig.core.cell.feedback.says_emulated
    assert "more than once" in say(rig, SUCCESS)[0]
    assert not rig.core.cell.feedback.says_emulated


def test_the_emulator_says_so_and_each_new_connection_is_asked_anew() -> None:
    cell = EmulatedCell()
    said = [cell.core.cell.feedback.says_emulated]
    cell.disconnect(STATE)
    said.append(cell.core.cell.feedback.says_emulated)
    cell.connect(STATE)
    said.append(cell.core.cell.feedback.says_emulated)
    assert said == [True, False, True]


def test_what_was_said_on_a_lost_connection_is_forgotten() -> None:
    rig = ready()
    say(rig, SUCCESS)
    rig.path(STATE, False)
    assert not rig.core.cell.feedback.says_emulated
    rig.path(STATE, True)
    rig.wait(100)
    assert not rig.core.cell.feedback.says_emulated
    assert asked(rig) == 2


def test_losing_another_connection_takes_nothing_back() -> None:
    rig = ready()
    say(rig, SUCCESS)
    for path in (MOTION, STOP):
        rig.path(path, False)
    assert rig.core.cell.feedback.says_emulated


@pytest.mark.parametrize(("after", "is_emulated"), [(0, True), (1, False)])
def test_an_answer_counts_for_so_long_and_not_a_nanosecond_longer(
    after: int, is_emulated: bool
) -> None:
    rig = ServerRig()
    rig.path(STATE, True)
    rig.now += PATIENCE_NS + after
    lines = say(rig, SUCCESS)
    assert rig.core.cell.feedback.says_emulated is is_emulated
    assert len(lines) == (0 if is_emulated else 1)
    assert is_emulated or "more than 2 s; it is taken for a real one" in lines[0]


@pytest.mark.parametrize(("first", "second"), [(SUCCESS, SUCCESS), (FAILURE, SUCCESS)])
def test_a_second_answer_changes_nothing_and_is_told_once(first: int, second: int) -> None:
    rig = ready()
    say(rig, first)
    lines = [line for _ in range(20) for line in say(rig, second, again=True)]
    assert len(lines) == 1
    assert "more than once" in lines[0]
    assert rig.core.cell.feedback.says_emulated is (first == SUCCESS)


@pytest.mark.parametrize("again", [True, False])
def test_a_controller_that_changes_its_mind_is_a_real_one_and_its_robot_stands(again: bool) -> None:
    rig = ready()
    say(rig, SUCCESS)
    pendant = rig.holder()
    assert pendant.move(0.5, 0.0) is V.ACCEPTED
    rig.wait(100)
    assert rig.activity() is Activity.MOVING
    stops = len(rig.stops)
    # With `again` false it answered before another question of ours, say about signals.
    assert "and then that it is not" in say(rig, FAILURE, again=again)[0]
    assert len(rig.stops) > stops
    assert [code for _, code in pendant.outcomes()] == [V.CONTROLLER_MISMATCH]
    assert not rig.core.cell.feedback.says_emulated
    say(rig, SUCCESS, again=True)
    assert not rig.core.cell.feedback.says_emulated
    rig.wait(1_000)
    assert rig.activity() is Activity.IDLE


def test_one_that_contradicts_itself_at_rest_moves_nothing_and_may_be_moved() -> None:
    rig = ready()
    say(rig, SUCCESS)
    say(rig, FAILURE, again=True)
    rig.wait(100)
    pendant = rig.holder()
    pendant.move(0.1, 0.0)
    assert rig.activity() is Activity.MOVING
