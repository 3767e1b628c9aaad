import pytest
from rigs.cells.admission_desk import account
from rigs.cells.guarded_rig import GuardedRig
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.audit import AuditEvent
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import MotionControlAction, ProgramRun, RunKind
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V

BEGAN, ENDED = AuditEvent.PROGRAM_BEGAN, AuditEvent.PROGRAM_ENDED


@pytest.fixture
def rig() -> GuardedRig:
    return GuardedRig()


@pytest.fixture
def otto(rig: GuardedRig) -> Pendant:
    otto = rig.user("otto")
    assert otto.take() is V.ACCEPTED
    return otto


def keep(rig: GuardedRig, name: str, statements: str, revisions: int = 1) -> None:
    text = f'openpendant-program/1\nprogram "{name}" robot two-joints\n{statements}'
    kind, body = DocumentKind.PROGRAM, program_to_json(parse(text))
    for before in range(revisions):
        rig.store.save(kind, name, body, expected_revision=before, author="test")


def run(otto: Pendant, name: str) -> V | None:
    return otto.code(ProgramRun(otto._next(), RunKind.ALL, 0, 1, 0, 1.0, name))


def noted(rig: GuardedRig) -> list[tuple[AuditEvent, str, object, object]]:
    return [
        (entry.event, entry.who, entry.detail["program"], entry.detail["revision"])
        for entry in rig.desk.log
        if entry.event in (BEGAN, ENDED)
    ]


def test_a_program_is_noted_with_its_revision_begin_and_end(rig: GuardedRig, otto: Pendant) -> None:
    keep(rig, "pick", "wait 0.1 s\n", revisions=7)
    assert run(otto, "pick") is V.ACCEPTED
    assert noted(rig) == [(BEGAN, "otto", "pick", 7)]
    rig.wait(200)
    assert noted(rig) == [(BEGAN, "otto", "pick", 7), (ENDED, "otto", "pick", 7)]
    ended = rig.desk.log[-1]
    assert (ended.detail["code"], ended.detail["text"]) == (V.ACCEPTED, "")


@pytest.mark.parametrize(
    "statements",
    ["call sub\nwait 0.1 s\n", "wait 0.1 s\ncall sub\n", "call sub\n"],
    ids=["at its begin", "at its end", "all the time"],
)
def test_a_program_that_calls_another_is_noted_and_not_the_one_that_it_calls(
    rig: GuardedRig, otto: Pendant, statements: str
) -> None:
    keep(rig, "main", statements)
    keep(rig, "sub", "wait 0.1 s\n", revisions=3)
    run(otto, "main")
    rig.wait(500)
    assert noted(rig) == [(BEGAN, "otto", "main", 1), (ENDED, "otto", "main", 1)]


def test_of_two_programs_between_two_ticks_each_is_noted(rig: GuardedRig, otto: Pendant) -> None:
    keep(rig, "first", "wait 9 s\n")
    keep(rig, "second", "wait 9 s\n", revisions=2)
    for name in ("first", "second"):
        assert run(otto, name) is V.ACCEPTED
        if name == "second":
            rig.wait(50)
        assert otto.control(MotionControlAction.PROGRAM_STOP) is V.ACCEPTED
    first, second = ("otto", "first", 1), ("otto", "second", 2)
    assert noted(rig) == [(BEGAN, *first), (ENDED, *first), (BEGAN, *second), (ENDED, *second)]


def test_the_end_of_a_program_is_noted_with_why(rig: GuardedRig, otto: Pendant) -> None:
    keep(rig, "pick", "wait 9 s\n")
    run(otto, "pick")
    rig.wait(50)
    rig.visitor().stop("a hand in the way")
    (ended,) = [entry for entry in rig.desk.log if entry.event is ENDED]
    assert (ended.who, ended.detail["code"]) == ("otto", V.STOPPED)
    assert "a hand in the way" in str(ended.detail["text"])


def test_a_program_that_ends_with_a_login_is_noted_for_it(rig: GuardedRig, otto: Pendant) -> None:
    keep(rig, "pick", "wait 9 s\n")
    run(otto, "pick")
    rig.wait(50)
    rig.follow(AccountBook([account("otto", Role.OPERATOR, disabled=True)]))
    assert noted(rig)[-1] == (ENDED, "otto", "pick", 1)


def test_a_program_that_is_only_loaded_did_not_begin(rig: GuardedRig, otto: Pendant) -> None:
    assert run(otto, "nothing") is V.NOT_FOUND
    rig.wait(50)
    assert noted(rig) == []
