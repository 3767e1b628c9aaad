"""One input device: opens its path, reads it on the event loop, and says why that is over.

Owns the words for what cannot be opened or is gone. A device that is unplugged, a pipe that ends
and a read that ends within an event are the same: gone, and told so before anything else happens.
"""

from __future__ import annotations

import asyncio
import errno
import os
from collections.abc import Callable
from pathlib import Path

from .device_events import DeviceEvent, EvdevReader, EventCut, EventReader, JoystickReader
from .settings import DeviceKind

_MOST = 64 * 24
"""Bytes of one read: whole events of either form."""

_FOLDER = Path("/dev/input")

UNPLUGGED = "unplugged; what it held was released"


class DeviceUnusable(Exception):
    """The device cannot be opened; the text is for the user."""


class InputDevice:
    """A device that is open until it is gone, or closed."""

    def __init__(
        self,
        path: str,
        kind: DeviceKind,
        take: Callable[[list[DeviceEvent]], None],
        gone: Callable[[str], None],
        clock: Callable[[], int],
    ) -> None:
        """Open it and read it from now on.

        Args:
            take: called with the events of each read.
            gone: called once, with the reason, when there is nothing more to read.
            clock: returns monotonic time [ns].

        Raises:
            DeviceUnusable: it cannot be opened.
        """
        self._reader: EventReader = (
            EvdevReader() if kind is DeviceKind.SPACEMOUSE else JoystickReader()
        )
        self._take, self._gone, self._clock = take, gone, clock
        self._loop = asyncio.get_running_loop()
        self._file: int | None = None
        try:
            file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except (OSError, ValueError) as error:
            raise DeviceUnusable(_unusable(error, path)) from None
        try:
            self._loop.add_reader(file, self._read)
        except OSError:
            # A file or a folder cannot be waited for.
            os.close(file)
            raise DeviceUnusable(f"{path} is no input device") from None
        self._file = file

    def tick(self) -> list[DeviceEvent]:
        """Return what the silence of the device says by now."""
        return self._reader.tick(self._clock())

    def close(self) -> None:
        """Close it; nothing is told any more."""
        if self._file is not None:
            self._loop.remove_reader(self._file)
            os.close(self._file)
            self._file = None

    def _read(self) -> None:
        assert self._file is not None
        try:
            data = os.read(self._file, _MOST)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            why = "" if error.errno == errno.ENODEV else f" ({error.strerror})"
            self._end(f"{UNPLUGGED}{why}")
            return
        events = self._reader.receive(data, self._clock())
        if events:
            self._take(events)
        if not data:
            self._end(UNPLUGGED)
        elif EventCut() in events:
            self._end(f"{UNPLUGGED} (it ended within an event)")

    def _end(self, why: str) -> None:
        self.close()
        self._gone(why)


def _unusable(error: OSError | ValueError, path: str) -> str:
    """Return why a path cannot be opened, and what helps."""
    if not isinstance(error, OSError):
        return f"{path!r} is no legal path"
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return f"no such device {path}; plug it in, or name another with --device ({_seen()})"
    if isinstance(error, PermissionError):
        return (
            f"not allowed to read {path}; add this user to the group that owns it (input) and log"
            " in again"
        )
    if error.errno in (errno.ENODEV, errno.ENXIO):
        return f"no device is behind {path}; plug it in, or name another with --device ({_seen()})"
    return f"{path} cannot be opened: {error.strerror}"


def _seen() -> str:
    """Return which devices there are."""
    try:
        names = sorted(each.name for each in _FOLDER.iterdir())
    except OSError:
        names = []
    paths = [str(_FOLDER / name) for name in names if name.startswith(("js", "event"))]
    return f"seen: {', '.join(paths) or 'none'}"
