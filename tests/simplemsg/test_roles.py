"""Roles: their order, and the one table of what each may do."""

from __future__ import annotations

from itertools import pairwise

import pytest

from openpendant.simplemsg.pendant.roles import LEAST_ROLE, PERMISSIONS_OF, Permission, Role


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
