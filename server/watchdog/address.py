"""Where a controller is reached: the numeric addresses of its name, looked up beside the watch.

Owns the looking up. A name server that does not answer holds up a thread of its own and no STOP:
the addresses that were good last are used meanwhile. An address in digits needs no thread.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from typing import Any

_RETRY = 0.5
_RENEWAL = 5.0

LookUp = Callable[..., list[Any]]
"""`socket.getaddrinfo`, or what stands for it."""


class ControllerAddress:
    """The addresses of one controller, one of which is used until it fails."""

    def __init__(
        self,
        host: str,
        port: int,
        look_up: LookUp = socket.getaddrinfo,
        renewal: float = _RENEWAL,
    ) -> None:
        """Take an address in digits, or begin to look a name up.

        Args:
            host: a name or an address.
            port: TCP port.
            look_up: finds the addresses of a name; may take its time.
            renewal: a name that is known is looked up again no sooner [s].
        """
        self._host = host
        self._port = port
        self._look_up = look_up
        self._renewal = renewal
        self._known: list[tuple[int, Any]] = []
        self._turn = 0
        self._has_failed = threading.Event()
        try:
            self._known = _numeric(host, port)
        except OSError:
            threading.Thread(target=self._follow, name="look-up", daemon=True).start()

    @property
    def current(self) -> tuple[int, Any] | None:
        """Family and address to connect to; None while none is known. Never waits."""
        known = self._known
        return known[self._turn % len(known)] if known else None

    def failed(self) -> None:
        """Take note that nobody was reached: the next address is tried, and the name looked up."""
        self._turn += 1
        self._has_failed.set()

    def _follow(self) -> None:
        rest = threading.Event()  # never set
        while True:
            try:
                found = self._look_up(self._host, self._port, type=socket.SOCK_STREAM)
            except (OSError, UnicodeError):  # the last good ones stay
                found = []
            if found:
                self._known = [(family, address) for family, _, _, _, address in found]
            if not self._known:
                rest.wait(_RETRY)
                continue
            # After a failure, but not after each of them.
            rest.wait(self._renewal)
            self._has_failed.clear()
            self._has_failed.wait()


def _numeric(host: str, port: int) -> list[tuple[int, Any]]:
    flags = socket.AI_NUMERICHOST | socket.AI_NUMERICSERV
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=flags)
    return [(family, address) for family, _, _, _, address in found]
