"""Who this connection is, who else is connected, and who has an account."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import access, users

from .calls import call, calls_of


@calls_of("access")
class AccessCalls:
    """The operations on connections."""

    whoami = call(access.WhoAmI)
    logout = call(access.Logout)
    sessions = call(access.ListSessions)


@calls_of("users")
class UserCalls:
    """The operations on accounts."""

    list = call(users.ListUsers)
    remove = call(users.RemoveUser)
    set_role = call(users.SetUserRole)
    disable = call(users.DisableUser)
    enable = call(users.EnableUser)
