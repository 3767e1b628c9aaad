"""Ports of the keypad: a serial device, a pty or `socket://HOST:PORT`, and why one does not open.

Owns the one use of pyserial-asyncio, and the words for a port that cannot be opened. A device is
opened for this program alone, as far as others ask for that, too.
"""

from __future__ import annotations

import asyncio
import errno
import importlib
import os
from collections.abc import Callable
from typing import Any, cast
from urllib.parse import urlsplit

SOCKET = "socket://"

_CONNECT_WITHIN = 5.0
"""Time for a connection to a port on a socket [s]."""

_LOCKED = frozenset({errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES, errno.EBUSY})


class KeypadPortUnusable(Exception):
    """A port that cannot be opened; the text is one line for the user."""


class KeypadPortMisnamed(KeypadPortUnusable):
    """A port that can never be opened, whatever is plugged in."""


async def open_port(
    port: str, baud: int, protocol: Callable[[], asyncio.Protocol]
) -> asyncio.Transport:
    """Open a port and hand what comes to a protocol.

    Raises:
        KeypadPortUnusable: it cannot be opened now.
        KeypadPortMisnamed: it is no port.
    """
    if port.startswith(SOCKET):
        return await _open_socket(port, protocol)
    return await _open_device(port, baud, protocol)


def check_port(port: str) -> None:
    """Look at the name of a port, and that what opens it is installed.

    Raises:
        KeypadPortMisnamed: it names nothing.
        ModuleNotFoundError: pyserial-asyncio is not installed.
    """
    if port.startswith(SOCKET):
        _address(port)
    elif "://" in port or not port:
        text = f"{port!r} is no port; accepted: a device such as /dev/ttyACM0, or {SOCKET}HOST:PORT"
        raise KeypadPortMisnamed(text)
    else:
        _library()


def seen_ports() -> tuple[str, ...]:
    """Return the serial devices of this machine."""
    from serial.tools import list_ports

    return tuple(sorted(str(each.device) for each in list_ports.comports()))


def _library() -> Any:
    import serial_asyncio  # here: a line on a socket does without it

    return serial_asyncio


def _address(port: str) -> tuple[str, int]:
    try:
        parts = urlsplit(port)
        host, number = parts.hostname, parts.port
    except ValueError:
        host = number = None
    if not host or not number or parts.path.strip("/"):
        raise KeypadPortMisnamed(
            f"{port!r} is no port; accepted: {SOCKET}HOST:PORT, PORT 1 to 65535"
        )
    return host, number


async def _open_socket(port: str, protocol: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
    host, number = _address(port)
    try:
        async with asyncio.timeout(_CONNECT_WITHIN):
            transport, _ = await asyncio.get_running_loop().create_connection(
                protocol, host, number
            )
    except TimeoutError:
        raise KeypadPortUnusable(f"nobody answers at {port} within {_CONNECT_WITHIN:g} s") from None
    except OSError as error:
        raise KeypadPortUnusable(f"nobody listens at {port} ({_reason(error)})") from None
    return transport


async def _open_device(
    port: str, baud: int, protocol: Callable[[], asyncio.Protocol]
) -> asyncio.Transport:
    library = _library()
    opening = library.create_serial_connection(
        asyncio.get_running_loop(), protocol, port, baudrate=baud, exclusive=True
    )
    try:
        transport, _ = await opening
    except (OSError, ValueError) as error:  # pyserial's own errors are an OSError
        raise _unusable(port, error) from None
    return cast(asyncio.Transport, transport)


def _unusable(port: str, error: Exception) -> KeypadPortUnusable:
    text = str(error)
    number = getattr(error, "errno", None)
    if "exclusively lock" in text and number in _LOCKED:
        return KeypadPortUnusable(f"{port} is held by another program; only one bridge may have it")
    if number == errno.ENOENT:
        seen = ", ".join(seen_ports()) or "none"
        plug = f"no such port {port}; plug it in, or name another with --port (seen: {seen})"
        return KeypadPortUnusable(f"{plug}. Trying every 0.5 to 5 s")
    if number in (errno.EACCES, errno.EPERM):
        group = f"add this user to the group that owns it ({_group(port)}) and log in again"
        return KeypadPortUnusable(f"not allowed to open {port}; {group}")
    if isinstance(error, ValueError) or "configure port" in text or number == errno.ENOTTY:
        return KeypadPortUnusable(f"{port} is no serial port ({_configuring(text)})")
    return KeypadPortUnusable(f"{port} cannot be opened ({_reason(error)})")


def _configuring(text: str) -> str:
    """Return the reason within pyserial's text, as `Inappropriate ioctl for device`."""
    for number in (errno.ENOTTY, errno.EINVAL, errno.EIO):
        if os.strerror(number) in text:
            return os.strerror(number)
    return text.rpartition(": ")[2]


def _group(port: str) -> str:
    try:
        grp = importlib.import_module("grp")
        return str(grp.getgrgid(os.stat(port).st_gid).gr_name)
    except (ImportError, KeyError, OSError):
        return "dialout"


def _reason(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if isinstance(number, int) and number > 0 else str(error)
