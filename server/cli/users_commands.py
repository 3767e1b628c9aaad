"""The command `openpendant users`: the accounts in the store.

Owns arguments, typing a password, output and exit codes, nothing else. All of it is safe while a
server runs. A password is never an argument, where every user of the machine could read it.

Exit codes: 0 done, 2 a bad argument, name or password, 3 refused, or the store cannot do it,
130 interrupted.
"""

from __future__ import annotations

import contextlib
import getpass
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from openpendant.simplemsg.pendant.roles import Role
from openpendant.tools.console import ExitCode, command, emit_json, one_line, run

from ..access.accounts import Account, AccountBook, AccountRefused, StoredAccounts, name_fault
from ..access.passwords import MOST_CHARACTERS, SALT_BYTES, Secret, hash_password, password_fault
from ..refusal import Refusal
from ..store.sqlite_store import open_for_reading, open_store
from ..store.store_client import default_path
from ..store.store_errors import StoreError
from .options import StoreFile, command_author

Name = Annotated[str, typer.Argument(help="Name of the account.")]
FromStdin = Annotated[
    bool,
    typer.Option("--password-stdin", help="Read the password from the first line of the input."),
]

_FIRST_ACCOUNT = (
    "there are accounts now: a server of this store closes its ROS-Industrial ports within "
    "seconds, because they know no login; ports that its file names in [listen] stay open, and "
    "whoever may connect there moves the robot without an account"
)

app = command(
    "List, add, change and remove the accounts of a server. `openpendant users pair` asks a running"
    " one for the pairing code of a class.",
    "0 done, 2 bad argument, name or password, 3 refused",
)


class _Unusable(Exception):
    """A name or password that cannot be used; its text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant users` and return its exit code."""
    faults = {
        _Unusable: ExitCode.USAGE,
        AccountRefused: ExitCode.REFUSED,
        StoreError: ExitCode.REFUSED,
    }
    return run(app, "users", argv, faults)


@app.command("list")
def list_accounts(
    store: StoreFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON line.")] = False,
) -> None:
    """List the accounts: names, roles, who is disabled, and what cannot be read."""
    book = _read_book(store)
    accounts = sorted(book, key=lambda account: account.key)
    if as_json:
        fields = {"name", "role", "disabled"}
        listed = [account.model_dump(mode="json", include=fields) for account in accounts]
        listed += [{"name": key, "unreadable": why} for key, why in book.unreadable.items()]
        emit_json(listed)
        return
    for account in accounts:
        disabled = "  disabled" if account.disabled else ""
        print(f"{account.name:<32}  {account.role.value}{disabled}")
    for key, why in book.unreadable.items():
        print(one_line(f"{key:<32}  unreadable: {why}"))
    if book.is_empty:
        where = one_line(str(store or default_path()))
        print(f"no accounts in {where}: whoever uses this machine is admin", file=sys.stderr)


@app.command()
def add(
    name: Name,
    role: Annotated[Role, typer.Option(help="What the account may do.")],
    password_stdin: FromStdin = False,
    store: StoreFile = None,
) -> None:
    """Add an account; asks for its password. The first one has to be admin."""
    _check(name_fault(name))
    password = _new_password(name, password_stdin)
    # Opened last: nobody waits for a writer while somebody thinks of a password.
    with _accounts(store) as accounts:
        is_first = accounts.book().is_empty
        accounts.add(
            Account(name=name, role=role, password=hash_password(password, os.urandom(SALT_BYTES)))
        )
    if is_first:
        print(_FIRST_ACCOUNT, file=sys.stderr)


@app.command()
def remove(name: Name, store: StoreFile = None) -> None:
    """Remove an account, readable or not; without any, whoever uses this machine is admin again."""
    with _accounts(store) as accounts:
        accounts.remove(name)


@app.command("set-role")
def set_role(
    name: Name,
    role: Annotated[Role, typer.Argument(help="What the account may do.")],
    store: StoreFile = None,
) -> None:
    """Give an account another role."""
    with _accounts(store) as accounts:
        accounts.set_role(name, role)


@app.command("set-password")
def set_password(name: Name, password_stdin: FromStdin = False, store: StoreFile = None) -> None:
    """Give an account another password; asks for it."""
    password = _new_password(name, password_stdin)
    with _accounts(store) as accounts:
        accounts.set_password(name, hash_password(password, os.urandom(SALT_BYTES)))


@app.command()
def disable(name: Name, store: StoreFile = None) -> None:
    """Keep an account, but let nobody log in with it."""
    with _accounts(store) as accounts:
        accounts.set_disabled(name, True)


@app.command()
def enable(name: Name, store: StoreFile = None) -> None:
    """Let an account log in again."""
    with _accounts(store) as accounts:
        accounts.set_disabled(name, False)


@contextlib.contextmanager
def _accounts(file: Path | None) -> Iterator[StoredAccounts]:
    with contextlib.closing(open_store(file or default_path())) as store:
        yield StoredAccounts(store, command_author("users"))


def _read_book(file: Path | None) -> AccountBook:
    path = file or default_path()
    if not path.exists():
        return AccountBook()
    with contextlib.closing(open_for_reading(path)) as store:
        return StoredAccounts(store, command_author("users")).book()


def _new_password(name: str, from_stdin: bool) -> Secret:
    if from_stdin:
        # A line longer than any password is refused by the rules, whatever follows.
        password = Secret(sys.stdin.readline(4 * MOST_CHARACTERS).rstrip("\r\n"))
    elif not sys.stdin.isatty():
        raise _Unusable("there is no terminal to type a password at; use --password-stdin")
    else:
        password = Secret(getpass.getpass(f"New password of {name}: "))
        if getpass.getpass("Once more: ") != password.reveal():
            raise _Unusable("the two passwords differ; nothing was changed")
    _check(password_fault(password, name))
    return password


def _check(refusal: Refusal | None) -> None:
    if refusal is not None:
        raise _Unusable(refusal.sentence)
