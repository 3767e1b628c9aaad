"""What pendants are told of the controller, and what its dialect cannot carry out."""

from dataclasses import replace
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import only
from rigs.cells.server_rig import ServerRig, ready
from rigs.peers.server_clients import Pendant

from openpendant.server import uplinks
from openpendant.server.cell.execution.point_stream import START_TOLERANCE
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.server.uplinks.declaration import Feeding, JogSupport, PauseSupport
from openpendant.server.uplinks.generic import GENERIC, generic_declaration
from openpendant.simplemsg import HeaderOnly, ReplyCode, joint_array
from openpendant.simplemsg.pendant import (
    Capability,
    ControllerChanged,
    HelloReply,
    JogSpace,
    JogStart,
    JogStep,
    JogUndo,
    MotionControlAction,
    OperatorEvent,
    Prepare,
    PrepareAction,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

IDENTITY = OperatorEvent.PLACE.msg_type


def says(rig: ServerRig, code: ReplyCode) -> None:
    rig.hear(ControllerPath.STATE, HeaderOnly(IDENTITY, reply_code=code))


def described(pendant: Pendant) -> dict[str, Any]:
    return pendant.ask("controller.describe")


# Known to be emulated.


@pytest.mark.parametrize(
    ("is_in_file", "answer", "is_known"),
    [
        (True, ReplyCode.SUCCESS, True),
        (False, ReplyCode.SUCCESS, False),
        (True, ReplyCode.FAILURE, False),
        (True, None, False),
        (False, None, False),
    ],
)
def test_a_controller_is_known_to_be_emulated_where_it_and_the_file_say_so(
    is_in_file: bool, answer: ReplyCode | None, is_known: bool
) -> None:
    rig = ready(controller={"emulated": is_in_file})
    if answer is not None:
        says(rig, answer)
    assert rig.core.cell.is_known_emulated is is_known
    told = described(rig.pendant())
    assert (told["emulated"], told["says_emulated"]) == (is_known, answer is ReplyCode.SUCCESS)


def test_a_new_connection_knows_nothing_until_it_has_answered() -> None:
    rig = ready(controller={"emulated": True})
    says(rig, ReplyCode.SUCCESS)
    rig.path(ControllerPath.STATE, False)
    assert not rig.core.cell.is_known_emulated
    rig.path(ControllerPath.STATE, True)
    assert not rig.core.cell.is_known_emulated
    says(rig, ReplyCode.SUCCESS)
    assert rig.core.cell.is_known_emulated


def test_our_emulator_is_known_where_the_file_says_so() -> None:
    cell = EmulatedCell(controller={"emulated": True})
    cell.wait(50)
    assert cell.core.cell.is_known_emulated


def test_each_change_is_told_to_every_connection_of_version_3() -> None:
    rig = ready(controller={"emulated": True})
    newer, other, older = rig.pendant(), rig.pendant(), rig.stranger()
    older.hello(version=2)
    says(rig, ReplyCode.SUCCESS)
    for pendant in (newer, other):
        told = only(ControllerChanged, pendant.all(ControllerChanged))
        found = (told.prepared, told.identity, told.is_emulated, told.declaration)
        assert found == (2, 0, 1, 2)
    assert described(newer)["declaration"] == 2
    rig.path(ControllerPath.STATE, False)
    assert [each.is_emulated for each in newer.all(ControllerChanged)] == [1, 0]
    assert described(newer)["declaration"] == 3
    rig.path(ControllerPath.STATE, True)
    assert len(newer.all(ControllerChanged)) == 2
    assert not older.all(ControllerChanged)


def test_what_the_file_does_not_say_is_no_change() -> None:
    rig = ready()
    pendant = rig.pendant()
    says(rig, ReplyCode.SUCCESS)
    assert not pendant.all(ControllerChanged)


# The declaration.


def test_the_generic_controller_declares_itself() -> None:
    told = described(ready(controller={"lead": 0.2, "reply_deadline": 0.4}).pendant())
    assert told["dialect"] == "generic"
    assert (told["feeding"], told["jog"], told["pause"], told["override"]) == (
        *("stream", "continuous", "path", "live"),
    )
    assert (told["points"], told["in_flight"], told["lead"]) == (14, 1, 0.2)
    assert (told["residual_motion"], told["blind_motion"]) == (0.5, 0.7)
    assert (told["second_stop"], told["freeze_protection"]) == (True, "second connection")
    assert told["reply_deadlines"] == {"point": 0.4, "stop": 2.0, "motion": 0.4}
    assert (told["state_period"], told["fresh_age"], told["abort_age"]) == (0.01, 0.1, 0.25)
    assert (told["following"], told["following_tolerance"]) == ("due", 0.02)
    assert (told["lag"], told["noise"]) == (0.08, 0.001)
    assert (told["prepare"], told["prepared"], told["identity"]) == (
        *([], "not needed", "unverified"),
    )
    assert told["ramp_time"] == pytest.approx(0.77)


def test_without_a_second_connection_nothing_protects_and_the_lead_is_short() -> None:
    told = described(ready(controller={"stop_connection": False}).pendant())
    assert (told["second_stop"], told["freeze_protection"]) == (False, "none")
    assert (told["lead"], told["blind_motion"]) == (0.1, 0.6)


def test_simple_points_are_told() -> None:
    link = ControllerLink(points="simple", points_in_flight=4, signals="openpendant")
    declared = generic_declaration(link)
    assert (declared.points, declared.in_flight, declared.signals) == (11, 4, "openpendant")


def test_a_motion_may_begin_as_far_away_as_is_declared() -> None:
    assert generic_declaration(ControllerLink()).start_tolerance == START_TOLERANCE


@pytest.mark.parametrize(
    "change",
    [
        {"feeding": Feeding.DOWNLOAD},
        {"second_stop": False},
        {"reply_deadlines": {"point": 0.0}},
    ],
)
def test_a_declaration_that_contradicts_itself_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"jog|connection|deadline"):
        replace(generic_declaration(ControllerLink()), **change)


# What a dialect cannot.


def toy(monkeypatch: pytest.MonkeyPatch, **declared: Any) -> ServerRig:
    """Return a cell whose dialect declares something else than the generic one."""
    other = replace(GENERIC, declared=lambda link: replace(generic_declaration(link), **declared))
    monkeypatch.setitem(uplinks.DIALECTS, "generic", other)
    return ready()


def offered(rig: ServerRig, version: int) -> Capability:
    pendant = rig.stranger()
    return Capability(only(HelloReply, pendant.hello(version=version)).capabilities)


@pytest.mark.parametrize("version", [2, 3])
def test_hello_offers_what_the_controller_can(
    monkeypatch: pytest.MonkeyPatch, version: int
) -> None:
    both = Capability.JOG | Capability.PAUSE
    assert offered(ready(), version) & both == both
    assert offered(toy(monkeypatch, jog=JogSupport.INCREMENTS), version) & both == both
    assert offered(toy(monkeypatch, jog=JogSupport.NONE), version) & both == Capability.PAUSE
    assert offered(toy(monkeypatch, pause=PauseSupport.NONE), version) & both == Capability.JOG
    assert not offered(ready(), version) & Capability.PREPARE


JOGS: dict[str, Any] = {
    "start": JogStart(3, 1, 0, 0.15, JogSpace.JOINTS, "", 2, joint_array((0.5, 0.0))),
    "step": JogStep(3, 0.5, JogSpace.JOINTS, "", 2, joint_array((0.01, 0.0))),
    "undo": JogUndo(3, 0.5),
}


@pytest.mark.parametrize(
    ("jog", "refused"),
    [
        (JogSupport.CONTINUOUS, set()),
        (JogSupport.INCREMENTS, {"start"}),
        (JogSupport.NONE, {"start", "step", "undo"}),
    ],
)
def test_a_jog_is_refused_that_the_controller_does_not_take(
    monkeypatch: pytest.MonkeyPatch, jog: JogSupport, refused: set[str]
) -> None:
    for name, message in JOGS.items():
        rig = toy(monkeypatch, jog=jog)
        found = rig.pendant().code(message)
        assert (found is V.JOG_INCREMENTS_ONLY) is (name in refused), name


def test_version_2_is_told_of_increments_as_of_a_mode_that_forbids(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    older = toy(monkeypatch, jog=JogSupport.INCREMENTS).stranger()
    older.hello(version=2)
    assert older.code(JOGS["start"]) is V.MODE_FORBIDS


def test_a_pause_is_refused_that_the_controller_cannot(monkeypatch: pytest.MonkeyPatch) -> None:
    holder = toy(monkeypatch, pause=PauseSupport.NONE).holder()
    assert holder.control(MotionControlAction.PAUSE) is V.CANNOT_PAUSE
    assert holder.speed(0.0) is V.CANNOT_PAUSE
    assert holder.speed(0.5) is V.ACCEPTED
    assert holder.control(MotionControlAction.PROGRAM_STOP) is V.NOTHING_TO_CONTROL


@pytest.mark.parametrize("action", [*PrepareAction, 0, 9])
def test_the_generic_controller_has_nothing_to_prepare(action: int) -> None:
    rig = ready()
    assert rig.pendant().code(Prepare(1, action, 0)) is V.NOT_IN_CONTROL
    assert rig.holder().code(Prepare(2, action, 0)) is V.BAD_ARGUMENT


def test_version_2_is_answered_prepare_like_an_unknown_message() -> None:
    older = ready().stranger()
    older.hello(version=2)
    (told,) = older.send(Prepare(1, 1, 0))
    assert isinstance(told, HeaderOnly)
    assert told.reply_code == ReplyCode.FAILURE
