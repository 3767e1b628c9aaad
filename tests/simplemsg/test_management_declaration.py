"""Declarations of management operations: what they become, and what they refuse to be."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import FrozenInstanceError, field

import pytest

from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import Done, Request, body_of, operation
from openpendant.simplemsg.pendant.management.programs import ProgramSaved, SaveProgram
from openpendant.simplemsg.pendant.roles import Permission


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = dict(OPERATIONS)
    yield
    OPERATIONS.clear()
    OPERATIONS.update(before)


def test_a_declared_request_is_frozen_and_has_its_name_reply_and_permission() -> None:
    @operation("toy.wind", needs=Permission.MOVE, in_order=True)
    class Wind(Request[Done]):
        """Wind it up."""

        turns: int

    asked = Wind(3)
    assert (asked.op, asked.turns) == ("toy.wind", 3)
    assert OPERATIONS["toy.wind"] is Wind
    assert (Wind.NEEDS, Wind.IN_ORDER, Wind.OVERTAKEN) == (Permission.MOVE, True, None)
    assert Wind.reply() is Done
    with pytest.raises(FrozenInstanceError):
        asked.turns = 4  # type: ignore[misc]


def test_a_body_has_the_needed_fields_first_and_then_those_that_have_a_default() -> None:
    @operation("toy.wind", needs=None)
    class Wind(Request[Done]):
        """Wind it up."""

        slowly: bool = field(default=False, kw_only=True)
        turns: int

    assert list(body_of(Wind(3)).items()) == [("op", "toy.wind"), ("turns", 3), ("slowly", False)]


def test_an_operation_is_declared_once() -> None:
    with pytest.raises(ValueError, match=r"programs\.save is declared twice"):

        @operation("programs.save", needs=None)
        class Another(Request[ProgramSaved]):
            """Save it again."""

    assert OPERATIONS["programs.save"] is SaveProgram


def test_an_operation_says_what_it_needs() -> None:
    with pytest.raises(TypeError, match="needs"):
        operation("toy.wind")  # type: ignore[call-arg]
