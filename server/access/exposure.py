"""Exposure of a server to the network: the rules checked before it listens (promise 28).

Owns which addresses are this machine's own, the rule that nobody reaches a server from outside
without credentials, and two of the clear-text ROS-Industrial ports, which know no login: where
accounts exist they are served only if somebody asked for them, and only to named addresses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..settings.cell_settings import CellSettings, Listen, UnaskedPort
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


def served_ports(listen: Listen, *, is_guarded: bool) -> tuple[int | None, int | None]:
    """Return where a cell serves ROS-Industrial: motion and state, each None for nowhere.

    Args:
        is_guarded: whoever would move the robot has to log in.
    """
    motion, state = (
        # As a plain number: the system's own calls take nothing else.
        None if port is None or (is_guarded and isinstance(port, UnaskedPort)) else int(port)
        for port in (listen.ros_motion_port, listen.ros_state_port)
    )
    return motion, state


def ros_port_warnings(cell: CellSettings, *, is_guarded: bool) -> list[str]:
    """Return what is to be said of a cell's ROS-Industrial ports where accounts exist."""
    if not is_guarded:
        return []
    wanted = {
        "ros_motion_port": cell.listen.ros_motion_port,
        "ros_state_port": cell.listen.ros_state_port,
    }
    off = [key for key, port in wanted.items() if isinstance(port, UnaskedPort)]
    warnings: list[str] = []
    if off:
        warnings.append(
            f"{' and '.join(off)} of cell {cell.name!r}: off, because this server wants a login "
            "and the ROS-Industrial ports know none; to have them all the same give them numbers "
            "in [listen]"
        )
    motion, state = served_ports(cell.listen, is_guarded=True)
    from_where = f"from {', '.join(cell.ros_i.allow) or 'nowhere'}"
    if motion is not None:
        warnings.append(
            f"ros_motion_port of cell {cell.name!r}: knows no login; whoever connects {from_where} "
            "moves the robot past the accounts"
        )
    if state is not None:
        who = "this machine" if is_loopback(cell.listen.host) else from_where.removeprefix("from ")
        warnings.append(
            f"ros_state_port of cell {cell.name!r}: knows no login; whoever connects from {who} "
            "sees the robot and may stop it"
        )
    return warnings


def unasked_fault(wanted: int | None, *, is_guarded: bool) -> Refusal | None:
    """Return why a ROS-Industrial port that is being served takes nobody; None where it does."""
    if not (is_guarded and isinstance(wanted, UnaskedPort)):
        return None
    text = "there are accounts, and this port, which knows no login, was not asked for"
    return Refusal(VerdictCode.LOGIN_NEEDED, text)
