"""The asyncio client library of the pendant protocol.

    async with await PendantClient.connect("127.0.0.1", 11010, client="my pendant") as pendant:
        async with pendant.control():
            move = await pendant.move_joints([0.0, -1.2, 1.2, -1.5, -1.5, 0.0], speed=0.2)
            await move.done()

Angles are radians, lengths metres, quaternions x, y, z, w; joints count from 0. It speaks the
public protocol and imports nothing of the server. Every refusal arrives as `Refused`, every aborted
motion as `Aborted`, both with the code of the catalogue, cause, remedy and the numbers; `explained`
of each failure is one line for a person.
`sync_client` has the same calls, blocking.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import (
    AccountRole,
    JogEnd,
    Motion,
    OperatingMode,
    Pairing,
    PairingAction,
    PairingReply,
    RunKind,
    SetAccount,
    State,
)
from openpendant.simplemsg.pendant.management.cell import Hold, Snapshot, WayOut

from .connection_errors import (
    DEFAULT_PORT,
    Aborted,
    ConnectionLost,
    MeshDamaged,
    NotTrusted,
    NotUnderstood,
    PendantError,
    Refused,
    SecretUnprotected,
    SecretUnprotectedWarning,
    StateSilent,
    Unanswered,
    Unreachable,
    WrongArgument,
)
from .jog import FedJog, Jog, Jogging
from .managing import Managing, PlaybackHandle
from .motions import JogAccount, MotionHandle, MotionResult, Pose
from .operating import EnablingDevice, FedEnabling, Operating
from .session import PendantSession

__all__ = [
    "DEFAULT_PORT",
    "Aborted",
    "AccountRole",
    "ConnectionLost",
    "EnablingDevice",
    "FedEnabling",
    "FedJog",
    "Hold",
    "Jog",
    "JogAccount",
    "JogEnd",
    "MeshDamaged",
    "Motion",
    "MotionHandle",
    "MotionResult",
    "NotTrusted",
    "NotUnderstood",
    "OperatingMode",
    "PendantClient",
    "PendantError",
    "PlaybackHandle",
    "Pose",
    "Refused",
    "RunKind",
    "SecretUnprotected",
    "SecretUnprotectedWarning",
    "Snapshot",
    "State",
    "StateSilent",
    "Unanswered",
    "Unreachable",
    "WayOut",
    "WrongArgument",
]


class Admitting(PendantSession):
    """Calls that admit users to the cell; the server refuses them to everybody but an admin."""

    async def issue_pairing_code(self) -> str:
        """Return a code that makes whoever types it an operator of this cell.

        It is shown to a class, and ends after a quarter of an hour or as the server's settings say.

        Raises:
            Refused: this connection is no admin's.
            ConnectionLost: the connection ended.
        """
        reply = await self._ask(
            lambda request_id: Pairing(request_id=request_id, action=PairingAction.ISSUE)
        )
        if not isinstance(reply, PairingReply):
            raise ConnectionLost(f"the server answered with {reply}")
        return reply.code

    async def end_pairing(self) -> None:
        """End the cell's code and what its guests may do.

        From the same machine they may go on looking on; from another one they are sent away: what
        waits for a state there raises `Refused`, and they can still stop.

        Raises:
            Refused: this connection is no admin's.
            ConnectionLost: the connection ended.
        """
        await self._ask(
            lambda request_id: Pairing(request_id=request_id, action=PairingAction.WITHDRAW)
        )

    async def add_account(self, name: str, role: AccountRole | str, password: str) -> None:
        """Add an account; returns when it is kept.

        Args:
            name: of the account.
            role: what it may do, or the word for it: viewer, operator, programmer, admin.
            password: of the account.

        Raises:
            Refused: name or password is not taken, or this connection is no admin's.
            WrongArgument: name or password is too long, or there is no such role.
            SecretUnprotected: others could read the password, and the connection is `strict`.
            ConnectionLost: the connection ended.
        """
        meant = _role(role)
        self._guard_secret("a password")
        await self._ask(
            lambda request_id: SetAccount(
                request_id=request_id, role=meant, name=name, secret=password
            )
        )

    async def set_password(self, name: str, password: str) -> None:
        """Give an account another password, which logs out whoever uses it; raises as above."""
        await self.add_account(name, AccountRole.AS_IT_IS, password)


def _role(role: AccountRole | str) -> AccountRole:
    roles: list[AccountRole] = list(AccountRole)
    for each in roles:
        if role == each or (isinstance(role, str) and role.lower() == each.name.lower()):
            return each
    words = ", ".join(each.name.lower() for each in roles if each != AccountRole.AS_IT_IS)
    raise WrongArgument(f"no role {role!r}; accepted: {words}, or an AccountRole")


class PendantClient(Operating, Managing, Jogging, Admitting):
    """One connection to a pendant server, with everything that a pendant can ask for.

    `session` has the connection and the callbacks, `observing` the state, `operating` authority,
    modes, stops and the single motions, `jog` the jogs, `Admitting` who may come in,
    `managing` programs, recordings, frames, tools, scene, signals, connections and accounts.
    """
