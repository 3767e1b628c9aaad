"""Opening of a server's access: its settings are checked before it listens, TLS included.

Owns the context made of the table `[tls]` (promise 28): versions, client certificates and what is
said of a file that cannot be used. TLS 1.3 and nothing older: its records are numbered and
authenticated, so one that is replayed, reordered, altered or pasted from another connection ends
the connection before a message is seen.

Owns how the secrets of gateways are read (promise 41).
"""

from __future__ import annotations

import os
import re
import ssl
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from openpendant.motion.bounded_file import beginning_of

from ..settings.cell_settings import CellSettings, GatewaySettings, TlsSettings
from ..settings.config_file import OFF, ConfigurationError
from ..settings.server_settings import ServerSettings
from ..store.store_client import default_path
from ..store.store_errors import StoreError
from .access_backend import ProcessAccess, read_at_start, unreadable_accounts
from .accounts import AccountBook
from .audit_file import AuditLog
from .exposure import (
    Exposure,
    ExposureRefused,
    check_exposure,
    is_loopback,
    ros_port_warnings,
)
from .handshake_cost import cost_warnings
from .passwords import Secret

_MOST_BYTES = 1_048_576

_SECRET = re.compile(rb"\s{0,8}[0-9A-Fa-f]{64}\s{0,8}")
_MOST_SECRET = 80

_CERTIFICATE = b"-----BEGIN CERTIFICATE-----"
_KEY = b"PRIVATE KEY-----"
_ENCRYPTED = (b"BEGIN ENCRYPTED PRIVATE KEY", b"Proc-Type: 4,ENCRYPTED")


class TlsUnusable(Exception):
    """A certificate, key or authority that cannot be used."""

    def __init__(self, file: str, problem: str) -> None:
        super().__init__(f"{file}: {problem}")
        self.file, self.problem = file, problem


def server_context(settings: TlsSettings) -> ssl.SSLContext | None:
    """Return the context of the pendant port; None where TLS is off.

    Raises:
        TlsUnusable: a file cannot be used.
    """
    if not settings.is_on:
        return None
    if _CERTIFICATE not in _content(settings.certificate):
        raise TlsUnusable(settings.certificate, "holds no certificate in PEM form")
    _check_key(settings.key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    context.num_tickets = 0  # no resumption: a grant ends with its connection, so the session does
    try:
        context.load_cert_chain(settings.certificate, settings.key)
    except ssl.SSLError as error:
        raise _of_pair(settings, error) from None
    if settings.ca:
        _ask_for_certificates(context, settings.ca)
    return context


def _content(file: str) -> bytes:
    try:
        content = beginning_of(Path(file), _MOST_BYTES + 1)
    except OSError as error:
        raise TlsUnusable(file, f"cannot be read: {error.strerror}") from None
    if len(content) > _MOST_BYTES:
        raise TlsUnusable(file, f"is larger than {_MOST_BYTES} bytes")
    return content


def _check_key(file: str) -> None:
    content = _content(file)
    if any(sign in content for sign in _ENCRYPTED):
        # OpenSSL would ask for its password on the terminal and wait.
        problem = "is encrypted; write it without a password: openssl pkey -in FILE -out NEW"
        raise TlsUnusable(file, problem)
    if _KEY not in content:
        raise TlsUnusable(file, "holds no private key in PEM form")
    mode = stat.S_IMODE(Path(file).stat().st_mode)
    if os.name == "posix" and mode & stat.S_IRWXO:
        problem = f"is open to every user of this machine (mode {mode:03o}); chmod 600"
        raise TlsUnusable(file, problem)


def _of_pair(settings: TlsSettings, error: ssl.SSLError) -> TlsUnusable:
    if error.reason == "KEY_VALUES_MISMATCH":
        problem = f"does not belong to the certificate in {settings.certificate}"
        return TlsUnusable(settings.key, problem)
    if error.reason in ("EE_KEY_TOO_SMALL", "CA_KEY_TOO_SMALL", "CA_MD_TOO_WEAK"):
        problem = f"is too weak ({_words(error)}); use an EC key or RSA of 2048 bits or more"
        return TlsUnusable(settings.certificate, problem)
    problem = f"or the key in {settings.key} is damaged ({_words(error)})"
    return TlsUnusable(settings.certificate, problem)


def _ask_for_certificates(context: ssl.SSLContext, ca: str) -> None:
    if _CERTIFICATE not in _content(ca):
        raise TlsUnusable(ca, "holds no certificate in PEM form")
    try:
        context.load_verify_locations(ca)
    except ssl.SSLError as error:
        raise TlsUnusable(ca, f"is damaged ({_words(error)})") from None
    context.verify_mode = ssl.CERT_REQUIRED


def _words(error: ssl.SSLError) -> str:
    return (error.reason or "unknown reason").replace("_", " ").lower()


@dataclass(frozen=True, slots=True)
class OpenedAccess:
    """Access of a server that may listen.

    Attributes:
        gateway_secrets: by the names of the gateways.
    """

    backend: ProcessAccess
    tls: ssl.SSLContext | None
    warnings: tuple[str, ...]
    gateway_secrets: Mapping[str, Secret]


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
        if tls is not None:
            warnings += cost_warnings(tls, first.tls.certificate)
        for cell in settings.cells:
            warnings += check_exposure(exposure_of(cell), book)
            is_guarded = not (book.is_empty and single_user)
            warnings += ros_port_warnings(cell, is_guarded=is_guarded)
    except ExposureRefused as error:
        raise ConfigurationError(source, error.key, error.problem) from None
    except TlsUnusable as error:
        raise ConfigurationError(source, "tls", str(error)) from None
    secrets = {each.name: _gateway_secret(each, first.tls, source) for each in first.gateways}
    audit = _audit_log(first.access.audit_log, source)
    backend = ProcessAccess(file, book, single_user=single_user, audit=audit)
    try:
        yield OpenedAccess(backend, tls, tuple(dict.fromkeys(warnings)), secrets)
    finally:
        backend.close()


def _gateway_secret(gateway: GatewaySettings, tls: TlsSettings, source: str) -> Secret:
    """Return the secret of a gateway.

    Raises:
        ConfigurationError: its file cannot be used, or the secret would cross the network in clear
            text.
    """
    if not is_loopback(gateway.address) and not tls.is_on:
        problem = f"{gateway.address} is another machine's, so the secret needs TLS; set [tls]"
        raise ConfigurationError(source, f"address of gateway {gateway.name!r}", problem)
    problem = ""
    try:
        mode = stat.S_IMODE(Path(gateway.secret_file).stat().st_mode)
        content = beginning_of(Path(gateway.secret_file), _MOST_SECRET + 1)
    except OSError as error:
        problem = f"cannot be read: {error.strerror}"
    else:
        if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
            problem = f"is open to other users of this machine (mode {mode:03o}); chmod 600"
        elif not _SECRET.fullmatch(content):
            problem = "does not hold 32 bytes in hexadecimal; write it with: openssl rand -hex 32"
    if problem:
        key = f"secret_file of gateway {gateway.name!r}"
        raise ConfigurationError(source, key, f"{gateway.secret_file} {problem}")
    return Secret(content.decode().strip())


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
