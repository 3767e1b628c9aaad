"""A pendant server with accounts in a file, an audit log and a journal, on real sockets."""

import asyncio
import os
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import pytest
from rigs.processes.judged_server import LoopPlanner, running_emulator

from openpendant.motion.description.robot import serial_robot
from openpendant.server.access import access_backend, admission
from openpendant.server.access.access_backend import ProcessAccess
from openpendant.server.access.accounts import Account, StoredAccounts
from openpendant.server.access.open_access import opened_access
from openpendant.server.access.passwords import (
    NOBODYS_HASH,
    SALT_BYTES,
    PasswordHash,
    ScryptCost,
    Secret,
    hash_password,
)
from openpendant.server.cli import serve
from openpendant.server.settings.server_settings import make_server_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.store.store_client import opened_store
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant.roles import Role
from openpendant.tools.pendants.client import PendantClient

ROBOT = "ur5"
CHEAP = ScryptCost(n=2**14, r=8, p=1)
PASSWORDS = {"ann": "canary-of-ann-7161", "otto": "canary-of-otto-9313"}
_ROLES = {"ann": Role.ADMIN, "otto": Role.OPERATOR}


@dataclass
class GuardedServer:
    """A running server and its files."""

    app: App
    access: ProcessAccess
    port: int
    journal: Path
    audit: Path
    store: Path


@cache
def _kept(password: str, cost: ScryptCost) -> PasswordHash:
    """Return what is kept of a password; servers that are not compared may share its salt."""
    return hash_password(Secret(password), os.urandom(SALT_BYTES), cost)


def add_accounts(file: Path, cost: ScryptCost = CHEAP) -> None:
    """Put the accounts into a store, with hashes that cost little unless said otherwise."""
    store = open_store(file)
    accounts = StoredAccounts(store, "the test")
    for name, password in PASSWORDS.items():
        accounts.add(Account(name=name, role=_ROLES[name], password=_kept(password, cost)))
    store.close()


@contextmanager
def cheap_logins() -> Iterator[None]:
    """Have a new password, and one of a name without an account, cost as little as `CHEAP`.

    For servers of this process whose passwords nobody times.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(access_backend, "hash_password", partial(hash_password, cost=CHEAP))
        nobodys = NOBODYS_HASH.model_copy(update={"cost": CHEAP})
        patch.setattr(admission, "NOBODYS_HASH", nobodys)
        yield


@asynccontextmanager
async def guarded_server(
    folder: Path, *, cost: ScryptCost = CHEAP, has_accounts: bool = True, **tables: object
) -> AsyncIterator[GuardedServer]:
    """Run a server, with two accounts or none; everything that it writes is in a folder."""
    journal, audit, store = (folder / name for name in ("journal", "audit.jsonl", "store.db"))
    if has_accounts:
        add_accounts(store, cost)
    async with running_emulator() as emulator:
        values = {
            "robot": ROBOT,
            "listen": {"pendant_port": 0, "ros_motion_port": "off", "ros_state_port": "off"},
            "controller": {"motion_port": emulator.motion_port, "state_port": emulator.state_port},
            "store": {"path": str(store)},
            "access": {"audit_log": str(audit)},
            **tables,
        }
        settings = make_server_settings(values, "test")
        kept = Journal()
        with opened_access(settings, "test") as access:
            served = [CellParts(settings.cells[0], serial_robot(ROBOT), LoopPlanner())]
            async with opened_store(settings.cells[0].store) as door:
                parts = served, kept, door, access.backend
                secrets = access.gateway_secrets
                app = App(*parts, tls=access.tls, gateway_secrets=secrets)
                with serve.kept_journal(kept, journal, settings):
                    async with app.running() as ports:
                        await asyncio.sleep(0.1)
                        yield GuardedServer(
                            *(app, access.backend, ports.pendant, journal, audit, store)
                        )


@asynccontextmanager
async def served_operator(folder: Path) -> AsyncIterator[tuple[GuardedServer, PendantClient]]:
    """Run such a server; yields it with a pendant at which its operator has logged in."""
    async with (
        guarded_server(folder) as server,
        await PendantClient.connect(
            port=server.port, user="otto", password=PASSWORDS["otto"], state_rate=50
        ) as otto,
    ):
        yield server, otto
