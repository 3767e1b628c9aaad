"""Command line of a pendant with a panel: the options of its cell, its user and its login.

Owns what these options are called and say, that a secret is asked for once and used again with each
new connection, and which refusals mean that an argument must change.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import PendantClient, PendantError, Refused, SecretUnprotected, WrongArgument
from ..credentials import (
    PASSWORD_VARIABLE,
    STRICT,
    guest_name,
    pairing_code,
    password_of,
    tls_context,
)
from ..session import LONGEST_SILENCE
from .wording import connection_refused

CellName = Annotated[str, typer.Option(help="Name of the cell; not needed for the only one.")]
PendantName = Annotated[str, typer.Option(help="Name of this pendant, shown to others.")]
UserName = Annotated[
    str,
    typer.Option(
        help=f"Account; its password is asked for, or in {PASSWORD_VARIABLE}."
        " With --pairing: your name in the class."
    ),
]
ByPairing = Annotated[
    bool,
    typer.Option(
        "--pairing",
        help="Ask for the code of a class, and for your name unless --user or --name says it.",
    ),
]
Certificate = Annotated[
    Path | None, typer.Option(help="Certificate of the server; encrypts the connection.")
]
Strict = Annotated[bool, typer.Option("--strict", help=f"{STRICT[0].upper()}{STRICT[1:]}.")]

_STATE_RATE = 25.0


class ConnectionFailed(Exception):
    """The server does not take us, or a stop is in doubt; the text is for the user."""


class Unusable(Exception):
    """Arguments or a place that the command cannot run with; the text is for the user."""


@dataclass(frozen=True, slots=True)
class PanelLogin:
    """Who comes in.

    Attributes:
        user: account, or name in the class; empty for nobody.
        secret: password or pairing code; None without a login.
    """

    user: str
    secret: str | None
    by_pairing: bool

    @classmethod
    def asked(cls, user: str, *, by_pairing: bool, name: str, usual_name: str) -> PanelLogin:
        """Ask for what is not given yet.

        Args:
            name: of the pendant, which stands for its user in a class unless it is the usual one.

        Raises:
            WrongArgument: standard input ended before it was typed.
        """
        secret = pairing_code() if by_pairing else password_of(user)
        if by_pairing and not user:
            user = guest_name(name) if name == usual_name else name
        return cls(user, secret, by_pairing)

    async def enter(self, client: PendantClient) -> None:
        """Log in, where there is a login."""
        if self.by_pairing:
            await client.login(self.user, pairing=self.secret)
        elif self.secret is not None:
            await client.login(self.user, password=self.secret)


class Connector:
    """The server and the cell that a pendant is connected to, anew after each loss."""

    def __init__(
        self,
        address: tuple[str, int],
        *,
        name: str,
        cell: str,
        ca: Path | None,
        strict: bool,
        enabling_deadline: float = LONGEST_SILENCE,
    ) -> None:
        """Connect to nothing yet.

        Args:
            enabling_deadline: declared longest silence of the enabling device [s].

        Raises:
            WrongArgument: the certificate cannot be used.
        """
        self.host, self.port = address
        self._name, self._cell, self._strict = name, cell, strict
        self._tls = tls_context(ca)
        self._enabling_deadline = enabling_deadline

    async def connect(self) -> PendantClient:
        """Connect."""
        return await PendantClient.connect(
            *(self.host, self.port),
            client=self._name,
            cell=self._cell,
            state_rate=_STATE_RATE,
            tls=self._tls,
            strict=self._strict,
            enabling_deadline=self._enabling_deadline,
        )


def must_change(error: PendantError) -> bool:
    """Return True if an argument must change."""
    if isinstance(error, Refused):
        return error.code == VerdictCode.UNKNOWN_CELL
    return isinstance(error, SecretUnprotected | WrongArgument)


def words_of(error: PendantError) -> str:
    """Return why a connection did not come about."""
    return connection_refused(error) if isinstance(error, Refused) else str(error)


def give_up(error: PendantError) -> NoReturn:
    """Raise `Unusable` where an argument must change, else `ConnectionFailed`."""
    raise (Unusable if must_change(error) else ConnectionFailed)(words_of(error))
