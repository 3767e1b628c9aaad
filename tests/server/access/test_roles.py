"""Roles: their order, and the one table of what each may do."""

from __future__ import annotations

from itertools import pairwise

import pytest

from openpendant.server.access.roles import (
    LEAST_ROLE,
    Permission,
    Role,
    role_may,
)


def test_every_permission_has_a_least_role() -> None:
    assert set(LEAST_ROLE) == set(Permission)


def test_roles_rise_from_viewer_to_admin() -> None:
    ordered = [Role.VIEWER, Role.OPERATOR, Role.PROGRAMMER, Role.ADMIN]
    assert sorted(Role) == ordered
    assert Role.ADMIN > Role.PROGRAMMER >= Role.PROGRAMMER


def test_each_role_may_do_more_than_the_one_before() -> None:
    allowed = [{each for each in Permission if role_may(role, each)} for role in Role]
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
    assert role_may(role, may)
    assert may_not is None or not role_may(role, may_not)
