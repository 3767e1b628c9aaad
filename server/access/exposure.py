"""Exposure of a server to the network: the rules checked before it listens (promise 28).

Owns which addresses are this machine's own, the rule that nobody reaches a server from outside
without credentials, and the rule that only named addresses use the clear-text ROS-Industrial ports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .accounts import AccountBook
from .lockout import ip_of


def is_loopback(address: str) -> bool:
    """Return True if an address or host name is this machine's own."""
    if address == "localhost":
        return True
    ip = ip_of(address)
    return ip is not None and ip.is_loopback


class ExposureRefused(Exception):
    """A server may not listen as configured."""

    def __init__(self, key: str, problem: str) -> None:
        super().__init__(f"{key}: {problem}")
        self.key, self.problem = key, problem


@dataclass(frozen=True, slots=True)
class Exposure:
    """Network exposure that a server's settings ask for."""

    host: str
    has_tls: bool
    ros_allow: Sequence[str]

    @property
    def is_local(self) -> bool:
        """True if only this machine can reach the server."""
        return is_loopback(self.host)


def check_exposure(exposure: Exposure, book: AccountBook) -> list[str]:
    """Check a server before it listens.

    Returns:
        Warnings, each one sentence for its user.

    Raises:
        ExposureRefused: it may not listen so.
    """
    for address in exposure.ros_allow:
        _check_allowed(address)
    if exposure.is_local:
        return []
    if not book.has_admin:
        problem = (
            f"{exposure.host} can be reached from outside, and nobody could log in as admin; "
            "add an account (openpendant users add NAME --role admin), or listen on 127.0.0.1"
        )
        raise ExposureRefused("listen.host", problem)
    if exposure.has_tls:
        return []
    return [
        f"passwords cross the network in clear text, because {exposure.host} can be reached from "
        "outside and there is no certificate; set [tls]"
    ]


def _check_allowed(address: str) -> None:
    ip = ip_of(address)
    if ip is None or ip.is_unspecified or ip.is_multicast:
        problem = (
            f"{address!r} is no address of one host; the ROS-Industrial ports have no credentials, "
            "so every host that may use them is named by its address"
        )
        raise ExposureRefused("ros_i.allow", problem)


def clear_text_fault(exposure: Exposure, address: str) -> Refusal | None:
    """Return why an address may not use a clear-text ROS-Industrial port; None where it may.

    On loopback every address may connect, and the cell checks its own list of who may move. A port
    that can be reached from outside serves only the addresses of that list.
    """
    if exposure.is_local or ip_of(address) in [ip_of(known) for known in exposure.ros_allow]:
        return None
    text = f"{address} is not among the addresses that may use this port"
    return Refusal(VerdictCode.ADDRESS_NOT_ALLOWED, text)
