"""What the modules of the pendant messages declare: messages, management operations and roles."""

import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, field
from enum import Enum
from itertools import pairwise

import pytest

from openpendant.simplemsg import pendant
from openpendant.simplemsg.declaration import Message, Record
from openpendant.simplemsg.pendant import roles
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import Done, Request, body_of, operation
from openpendant.simplemsg.pendant.management.programs import ProgramSaved, SaveProgram
from openpendant.simplemsg.pendant.roles import LEAST_ROLE, PERMISSIONS_OF, Permission, Role


def declared() -> Iterator[type]:
    for found in pkgutil.iter_modules(pendant.__path__, f"{pendant.__name__}."):
        module = importlib.import_module(found.name)
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__:
                yield value


def test_every_message_that_a_module_declares_is_in_the_list_once() -> None:
    messages = [each for each in declared() if issubclass(each, Message)]
    assert len(messages) == len(pendant.PENDANT_MESSAGES)
    assert set(messages) == set(pendant.PENDANT_MESSAGES)


def test_every_message_record_and_closed_set_is_imported_from_the_package() -> None:
    # Who may do what is told by no message, but by the operations and the server's tables.
    found = [each for each in declared() if each.__module__ != roles.__name__]
    names = {each.__name__ for each in found if issubclass(each, Record | Enum)}
    assert names <= set(pendant.__all__)
    assert all(getattr(pendant, name).__module__.startswith(pendant.__name__) for name in names)


# Management operations.


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


# Roles.


def test_every_permission_has_a_least_role() -> None:
    assert set(LEAST_ROLE) == set(Permission)


def test_roles_rise_from_viewer_to_admin() -> None:
    assert sorted(Role) == [Role.VIEWER, Role.OPERATOR, Role.PROGRAMMER, Role.ADMIN]
    assert Role.ADMIN > Role.PROGRAMMER >= Role.PROGRAMMER


def test_each_role_may_do_more_than_the_one_before() -> None:
    allowed = [PERMISSIONS_OF[role] for role in Role]
    assert all(less < more for less, more in pairwise(allowed))
    assert allowed[-1] == set(Permission)


@pytest.mark.parametrize(
    ("role", "may", "may_not"),
    [
        (Role.VIEWER, Permission.STOP, Permission.MOVE),
        (Role.OPERATOR, Permission.MOVE, Permission.EDIT_PROGRAM),
        (Role.PROGRAMMER, Permission.CHANGE_FRAMES, Permission.FORCE_AUTHORITY),
        (Role.ADMIN, Permission.MANAGE_USERS, None),
    ],
)
def test_a_role_ends_where_the_next_begins(
    role: Role, may: Permission, may_not: Permission | None
) -> None:
    assert may in PERMISSIONS_OF[role]
    assert may_not is None or may_not not in PERMISSIONS_OF[role]
