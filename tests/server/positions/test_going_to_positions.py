"""HOME by name, on a cell with an emulated robot, for pendants of both versions."""

from collections.abc import Callable

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import only
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.robot import serial_robot
from openpendant.server.positions.position_document import positions_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSIONS,
    Activity,
    AuthorityBeat,
    Capability,
    HelloReply,
    Home,
    Outcome,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = serial_robot("ur5").home_position
PARK = (0.1, *HOME[1:])
OF_RAIL = serial_robot("rail_kr5_arc").home_position


def in_control(cell: EmulatedCell, version: int) -> Pendant:
    pendant = cell.stranger()
    pendant.hello(version=version)
    assert pendant.take() is V.ACCEPTED
    return pendant


def asked(cell: EmulatedCell, pendant: Pendant, target: str) -> Verdict:
    """Ask for HOME and return its verdict."""
    request = pendant._next()
    answers = pendant.send(Home(request, 1.0, target))
    (told,) = [each for each in answers if isinstance(each, Verdict)]
    assert told.request_id == request
    return told


def let_finish(cell: EmulatedCell, pendant: Pendant) -> None:
    for _ in range(100):
        pendant.send(AuthorityBeat())
        cell.wait(100)
        if cell.core.cell.activity is Activity.IDLE:
            return
    raise AssertionError("the motion does not end")


@pytest.fixture
def cell() -> EmulatedCell:
    return EmulatedCell(has_surroundings=True)


@pytest.mark.parametrize("version", PROTOCOL_VERSIONS)
def test_home_at_home_completes_in_the_same_turn(cell: EmulatedCell, version: int) -> None:
    pendant = in_control(cell, version)
    answers = pendant.send(Home(pendant._next(), 0.5, "home"))
    assert [type(each) for each in answers] == [Verdict, Outcome]
    verdict, outcome = answers
    assert isinstance(verdict, Verdict)
    assert isinstance(outcome, Outcome)
    assert verdict.code == V.ACCEPTED
    assert (outcome.code, outcome.motion_time, outcome.plan_time) == (0, 0.0, 0.0)
    assert cell.core.cell.activity is Activity.IDLE
    assert asked(cell, pendant, "home").code == V.ACCEPTED


def beside(joint: int, by: float, home: tuple[float, ...]) -> Callable[..., tuple[float, ...]]:
    def reported(position: object, now: int) -> tuple[float, ...]:
        return tuple(at + by * (index == joint) for index, at in enumerate(home))

    return reported


@pytest.mark.parametrize(
    ("robot", "joint", "by", "is_there"),
    [
        ("ur5", 3, 0.9e-4, True),
        ("ur5", 3, -0.9e-4, True),
        ("ur5", 3, 1.1e-4, False),
        ("rail_kr5_arc", 0, 0.9e-5, True),
        ("rail_kr5_arc", 0, 1.1e-5, False),
        ("rail_kr5_arc", 1, 0.9e-4, True),
    ],
)
def test_within_a_tenth_of_a_milliradian_or_a_hundredth_of_a_millimetre_it_is_there(
    robot: str, joint: int, by: float, is_there: bool
) -> None:
    cell = EmulatedCell(robot)
    pendant = cell.holder()
    cell.reported = beside(joint, by, serial_robot(robot).home_position)
    cell.wait(300)
    pendant.send(AuthorityBeat())
    answers = pendant.send(Home(pendant._next(), 1.0, "home"))
    verdict = next(each for each in answers if isinstance(each, Verdict))
    assert verdict.code == V.ACCEPTED
    assert any(isinstance(each, Outcome) for each in answers) is is_there


def test_home_at_home_needs_the_authority_all_the_same(cell: EmulatedCell) -> None:
    onlooker = cell.pendant()
    assert asked(cell, onlooker, "home").code == V.NOT_IN_CONTROL


@pytest.mark.parametrize("version", PROTOCOL_VERSIONS)
def test_the_robot_goes_to_a_position_by_the_name_it_was_saved_under(
    cell: EmulatedCell, version: int
) -> None:
    teacher = cell.pendant()
    saved = {"name": "park", "joints": list(PARK), "expected_revision": 0}
    teacher.ask("positions.save", **saved)
    cell.wait(50)
    pendant = in_control(cell, version)
    assert asked(cell, pendant, "park").code == V.ACCEPTED
    let_finish(cell, pendant)
    assert cell.position == pytest.approx(PARK, abs=1e-3)


@pytest.mark.parametrize(("version", "code"), [(2, V.BAD_ARGUMENT), (3, V.UNKNOWN_POSITION)])
def test_an_unknown_position_is_refused_with_the_nearest_spelling(
    cell: EmulatedCell, version: int, code: V
) -> None:
    pendant = in_control(cell, version)
    asked(cell, pendant, "hmoe")  # to a pendant of version 2 the store is not read before
    told = asked(cell, pendant, "hmoe")
    assert (told.code, told.text) == (code, "no position is called 'hmoe'; the nearest is 'home'")


def test_before_anybody_knows_of_positions_the_first_who_names_one_has_them_read(
    cell: EmulatedCell,
) -> None:
    body = positions_to_json({"park": PARK})
    cell.store.save(DocumentKind.POSITIONS, "cell", body, expected_revision=0, author="ann")
    pendant = in_control(cell, 2)
    assert asked(cell, pendant, "home").code == V.ACCEPTED
    assert asked(cell, pendant, "park").code == V.STORE_BUSY
    assert asked(cell, pendant, "park").code == V.ACCEPTED


def test_the_vrms_home_is_a_position_and_where_it_is_missing_an_unknown_name() -> None:
    irb = EmulatedCell("abb_irb2400")
    assert asked(irb, irb.holder(), "vrm").code == V.ACCEPTED
    ur5 = EmulatedCell("ur5")
    assert asked(ur5, ur5.holder(), "vrm").code == V.UNKNOWN_POSITION


def test_positions_are_offered_where_they_can_be_kept(cell: EmulatedCell) -> None:
    reply = only(HelloReply, cell.stranger().hello())
    assert reply.capabilities & Capability.POSITIONS
    older = only(HelloReply, cell.stranger().hello(version=2))
    assert not older.capabilities & Capability.POSITIONS
    bare = only(HelloReply, EmulatedCell("ur5").stranger().hello())
    assert not bare.capabilities & Capability.POSITIONS
