"""DECLARE: what a connection of version 3 says beyond its hello."""

import math

import pytest
from rigs.cells.expectations import only
from rigs.cells.server_rig import IDENTITY, LIMITS, NoTool, ServerRig, ready
from rigs.cells.two_hands import two_hands
from rigs.motion.jog_pad import JogPad
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.admission import Admission
from openpendant.server.access.audit import AuditEntry
from openpendant.server.core.cell_core import CellCore
from openpendant.server.endpoints.pendant.access_requests import CoreAccess
from openpendant.simplemsg.pendant import Declare, EnablingPosition, Notices, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

THE_CELLS = 0.15


def declare(pendant: Pendant, deadline: float, notices: int = Notices.UNWANTED) -> Verdict:
    return only(Verdict, pendant.send(Declare(pendant._next(), deadline, notices, "en")))


def deadline_of(rig: ServerRig, pendant: Pendant) -> float:
    """Return what is told of a connection: by `access.sessions`, and by `why` to itself."""
    sessions = pendant.ask("access.sessions")["sessions"]
    (told,) = [each for each in sessions if each["session"] == pendant.session]
    assert pendant.ask("why", whose="mine")["enabling_deadline"] == told["enabling_deadline"]
    found: float = told["enabling_deadline"]
    return found


@pytest.mark.parametrize(
    ("deadline", "code"),
    [
        (0.0, V.ACCEPTED),
        (0.05, V.ACCEPTED),
        (0.25, V.ACCEPTED),
        (0.0499, V.BAD_ARGUMENT),
        (0.2501, V.BAD_ARGUMENT),
        (-0.1, V.BAD_ARGUMENT),
        (math.nan, V.NOT_FINITE),
        (math.inf, V.NOT_FINITE),
    ],
)
def test_a_deadline_is_50_to_250_ms_or_the_cells(deadline: float, code: V) -> None:
    rig = ready()
    pendant = rig.pendant()
    told = declare(pendant, deadline)
    assert V(told.code) is code
    is_set = code is V.ACCEPTED and deadline
    assert deadline_of(rig, pendant) == pytest.approx(deadline if is_set else THE_CELLS)
    if code is V.ACCEPTED:
        assert told.value == pytest.approx(rig.core.cell.hold_to_run.ramp_time)
    elif code is V.BAD_ARGUMENT:
        assert told.value == pytest.approx(deadline)
        assert told.limit == 0.25


def test_a_deadline_is_that_of_its_own_connection_and_ends_with_it() -> None:
    rig = ready()
    one, other = rig.pendant(), rig.pendant()
    assert declare(one, 0.25).code == V.ACCEPTED
    assert (deadline_of(rig, one), deadline_of(rig, other)) == (0.25, THE_CELLS)
    assert declare(one, 0.0).code == V.ACCEPTED
    assert deadline_of(rig, one) == THE_CELLS
    declare(one, 0.25)
    one.close()
    assert rig.core.cell.modes.enabling_deadline(one.session) == THE_CELLS


def test_why_tells_an_onlooker_the_deadline_of_who_is_in_control() -> None:
    rig = ready()
    holder, onlooker = rig.holder(), rig.pendant()
    declare(holder, 0.25)
    assert onlooker.ask("why")["enabling_deadline"] == 0.25


def test_a_declared_deadline_rules_how_long_a_device_may_be_silent() -> None:
    rig = ready(modes={"initial": "manual_reduced"})
    pendant = rig.holder()
    declare(pendant, 0.25)
    pendant.enable(EnablingPosition.HELD)
    for milliseconds, code in ((160, V.ACCEPTED), (80, V.ACCEPTED), (10, V.ENABLING_LOST)):
        if milliseconds == 160:
            assert pendant.move(1.5, 0.0) is code
        rig.wait(milliseconds)
        assert (rig.stops == []) == (code is V.ACCEPTED)


@pytest.mark.parametrize("begin", ["a jog", "its ramp", "a motion", "a motion being planned"])
def test_nothing_is_declared_while_the_connection_moves_the_robot(begin: str) -> None:
    hands = two_hands("manual_high")
    if begin in ("a jog", "its ramp"):
        hands.jog(0.25)
        if begin == "its ramp":
            hands.key_up()
    else:
        hands.device(EnablingPosition.HELD)
        hands.rig.plans_at_once = begin == "a motion"
        hands.move()
        if begin == "a motion being planned":
            hands.pendant.path((0.5, 0.0))
    assert hands.declare(0.1) is V.MOVING
    assert declare(hands.rig.pendant(), 0.1).code == V.ACCEPTED  # another one may
    hands.pendant.stop()
    hands.rig.wait(800)
    assert hands.declare(0.1) is V.ACCEPTED


PRESSES = [
    ("manual_reduced", 3, 0.25, 0.15, V.BAD_ARGUMENT),
    ("manual_high", 3, 0.16, 0.15, V.BAD_ARGUMENT),
    ("recovery", 3, 0.25, 0.2, V.BAD_ARGUMENT),
    ("manual_reduced", 3, 0.15, 0.15, V.ACCEPTED),
    ("manual_reduced", 3, 0.05, 0.05, V.ACCEPTED),
    ("manual_reduced", 2, 0.25, 0.15, V.ACCEPTED),
    ("automatic", 3, 0.25, 0.15, V.MODE_FORBIDS),
]


@pytest.mark.parametrize(("mode", "version", "press", "silence", "code"), PRESSES)
def test_no_press_is_declared_silent_later_than_its_enabling_device(
    mode: str, version: int, press: float, silence: float, code: V
) -> None:
    hands = two_hands(mode, version=version, silence=silence)
    hands.device(EnablingPosition.HELD)
    assert hands.press(1.0, 0.0, deadline=press) is code
    if code is V.BAD_ARGUMENT:
        told = hands.pendant.all(Verdict)[-1]
        assert told.value == pytest.approx(press)
        assert told.limit == pytest.approx(silence)


def test_times_that_were_rounded_to_4_bytes_are_equal() -> None:
    """0.15 s in 4 bytes is 6 ns more than the 0.15 s of the cell's file."""
    pad = JogPad(ready(modes={"initial": "manual_reduced"}), silence=0.0)
    pad.squeeze()
    assert pad.press(1.0, 0.0, deadline=0.15000000596046448) is V.ACCEPTED


def test_what_is_declared_is_noted_with_the_language() -> None:
    noted: list[AuditEntry] = []
    rig = ServerRig()
    rig.core = _recorded(rig, noted)
    rig.connect_controller()
    pendant = rig.pendant()
    pendant.send(Declare(1, 0.2, Notices.WANTED, "de"))
    (entry,) = [each for each in noted if each.event.value == "declared"]
    assert dict(entry.detail) == {"language": "de", "enabling_deadline": 0.2, "notices": 1}
    assert entry.session == pendant.session


def _recorded(rig: ServerRig, noted: list[AuditEntry]) -> CellCore:
    login = Admission(AccountBook(), single_user_host=True, record=noted.append)
    access = CoreAccess(login=login, record=noted.append)
    return CellCore(rig.settings, LIMITS, IDENTITY, NoTool(), access=access)
