import pickle

import pytest
from rigs.data.program_samples import linked, program

from openpendant.server.programs.language.linking import DEEPEST_CALL, MOST_PROGRAMS, link
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.printer import statement_lines
from openpendant.server.programs.language.program_errors import CallTooDeep
from openpendant.simplemsg.pendant.management.program_values import ProgramError
from openpendant.simplemsg.verdicts import VerdictCode as V


def chain(length: int) -> dict[str, str]:
    """Programs p1 to p<length>, each of which calls the next."""
    return {f"p{n}": f"call p{n + 1}" if n < length else "" for n in range(1, length + 1)}


def test_all_that_is_called_is_found_once() -> None:
    found = linked("call x\ncall y", {"x": "call y", "y": "wait 1 s"})
    assert (found.main, set(found.programs)) == ("main", {"main", "x", "y"})


def test_the_line_of_each_statement_is_known_once_they_are_linked() -> None:
    found = linked("call x\nwait 1 s", {"x": "wait 1 s"})
    assert found.lines == {name: statement_lines(each) for name, each in found.programs.items()}
    assert {name: len(lines) for name, lines in found.lines.items()} == {"main": 2, "x": 1}
    assert pickle.loads(pickle.dumps(found)).lines == found.lines


def test_the_deepest_chain_that_is_taken() -> None:
    linked("call p1", chain(DEEPEST_CALL - 1))
    with pytest.raises(CallTooDeep, match=f"more than {DEEPEST_CALL} programs deep"):
        linked("call p1", chain(DEEPEST_CALL))


@pytest.mark.parametrize("through", ["call p1", "call p12\ncall p1"])
def test_a_chain_is_too_deep_whichever_call_is_followed_first(through: str) -> None:
    with pytest.raises(CallTooDeep):
        linked(through, chain(DEEPEST_CALL + 4))


@pytest.mark.parametrize(
    ("called", "circle"), [("x", "'x' calls 'y' calls 'x'"), ("main", "'main' calls 'main'")]
)
def test_a_circle_is_refused_and_named(called: str, circle: str) -> None:
    with pytest.raises(CallTooDeep, match=f"{circle}: that never ends") as caught:
        linked(f"call {called}", {"x": "call y", "y": "call x"})
    assert caught.value.code is V.CALL_TOO_DEEP


def test_many_calls_of_few_programs_are_followed_once_each() -> None:
    levels = {f"p{n}": f"call p{n + 1}\n" * 500 if n < 12 else "" for n in range(1, 13)}
    assert len(linked("call p1", levels).programs) == 13


def test_a_program_that_is_not_there_is_named_with_the_call() -> None:
    message = "program 'main', line 12, 'call x': there is no program 'x' to call"
    with pytest.raises(ProgramError, match=message) as caught:
        linked("wait 1 s\ncall x")
    assert caught.value.code is V.PROGRAM_UNKNOWN


def test_a_program_of_another_robot_is_not_called() -> None:
    other = parse('openpendant-program/1\nprogram "x" robot puma560')
    with pytest.raises(ProgramError, match="'x' was taught on 'puma560'") as caught:
        link(program("call x"), {"x": other}.get)
    assert caught.value.code is V.PROGRAM_WRONG_ROBOT


def test_there_are_only_so_many_programs_in_one_run() -> None:
    others = {f"p{number}": "" for number in range(MOST_PROGRAMS)}
    with pytest.raises(ProgramError, match=f"accepted: up to {MOST_PROGRAMS}"):
        linked("".join(f"call p{number}\n" for number in range(MOST_PROGRAMS)), others)
