"""Opening of a server's access: its settings are checked before it listens."""

from __future__ import annotations

import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..settings.cell_settings import CellSettings
from ..settings.config_file import OFF, ConfigurationError
from ..settings.server_settings import ServerSettings
from ..store.store_client import default_path
from ..store.store_errors import StoreError
from .accounts import AccountBook
from .audit_file import AuditLog
from .exposure import Exposure, ExposureRefused, check_exposure
from .process_backend import ProcessAccess, read_at_start, unreadable_accounts
from .tls import TlsUnusable, server_context


@dataclass(frozen=True, slots=True)
class OpenedAccess:
    """Access of a server that may listen."""

    door: ProcessAccess
    tls: ssl.SSLContext | None
    warnings: tuple[str, ...]


def exposure_of(cell: CellSettings) -> Exposure:
    """Return how a cell's ports can be reached."""
    return Exposure(cell.listen.host, cell.tls.is_on, cell.ros_i.allow)


@contextmanager
def opened_access(settings: ServerSettings, source: str) -> Iterator[OpenedAccess]:
    """Keep accounts and audit log open while the context lasts.

    Raises:
        ConfigurationError: the server may not listen so, or a file that access needs is unusable.
    """
    first = settings.cells[0]
    file = _store_file(first)
    warnings: list[str] = []
    book, single_user = AccountBook(), True
    if file is not None:
        try:
            book, single_user = read_at_start(file)
            warnings += unreadable_accounts(book)
        except StoreError as error:
            # A store that cannot be read may hold accounts: it must not grant the single user.
            single_user = False
            warnings.append(f"the accounts cannot be read, so nobody may move: {error}")
    try:
        tls = server_context(first.tls)
        for cell in settings.cells:
            warnings += check_exposure(exposure_of(cell), book)
    except ExposureRefused as error:
        raise ConfigurationError(source, error.key, error.problem) from None
    except TlsUnusable as error:
        raise ConfigurationError(source, "tls", str(error)) from None
    audit = _audit_log(first.access.audit_log, source)
    door = ProcessAccess(file, book, single_user=single_user, audit=audit)
    try:
        yield OpenedAccess(door, tls, tuple(dict.fromkeys(warnings)))
    finally:
        door.close()


def _store_file(cell: CellSettings) -> Path | None:
    if cell.store.path == OFF:
        return None
    return Path(cell.store.path) if cell.store.path else default_path()


def _audit_log(name: str, source: str) -> AuditLog | None:
    if not name:
        return None
    try:
        return AuditLog(Path(name))
    except OSError as error:
        problem = f"{name}: {error.strerror or error}"
        raise ConfigurationError(source, "access.audit_log", problem) from None
