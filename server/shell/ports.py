"""The ports of a server, as they are once bound: for all pendants, and for ROS-I of each cell.

Owns what is listened on where, and what is said where a port cannot be had. Must not know who
connects; how connections are taken is `listening`'s business.
"""

from __future__ import annotations

import asyncio
import os
import ssl
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from ..events.events import Port
from ..settings.cell_settings import CellSettings
from .listening import Listening

Connect = Callable[[Port, int | None], asyncio.Protocol]
"""Makes the protocol of a connection to a port of a cell; None for the port of all cells."""


@dataclass(frozen=True, slots=True)
class RosPorts:
    """Where one cell listens for ROS-Industrial; None for nowhere.

    Attributes:
        motion: motion connections.
        state: state connections.
    """

    motion: int | None
    state: int | None


@dataclass(frozen=True, slots=True)
class Ports:
    """The ports that the server listens on.

    Attributes:
        pendant: pendant protocol, for all cells.
        ros: ROS-Industrial, by the name of the cell.
    """

    pendant: int
    ros: dict[str, RosPorts]


class ListenFailed(Exception):
    """A port cannot be listened on.

    Attributes:
        host: the address.
        port: the TCP port.
        reason: why, in the words of the system.
    """

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"cannot listen on {host} port {port}: {reason}")
        self.host = host
        self.port = port
        self.reason = reason


async def listen_for(
    cells: Sequence[CellSettings],
    listening: Listening,
    connect: Connect,
    tls: ssl.SSLContext | None,
) -> Ports:
    """Listen for the pendants of all cells, and for each cell's ROS-Industrial clients.

    Args:
        cells: the cells; the pendant port is that of the first.
        listening: takes the connections.
        connect: makes their protocols.
        tls: encrypts the pendant port; None for clear text.

    Raises:
        ListenFailed: a port cannot be bound; the others may be.
    """
    host, number = cells[0].listen.host, cells[0].listen.pendant_port
    pendant = await _bind(listening, host, number, partial(connect, Port.PENDANT, None), tls)
    ros = {}
    for cell, settings in enumerate(cells):
        bound = [
            None
            if wanted is None
            else await _bind(listening, host, wanted, partial(connect, port, cell))
            for port, wanted in (
                (Port.ROS_MOTION, settings.listen.ros_motion_port),
                (Port.ROS_STATE, settings.listen.ros_state_port),
            )
        ]
        ros[settings.name] = RosPorts(*bound)
    return Ports(pendant, ros)


async def _bind(
    listening: Listening,
    host: str,
    number: int,
    connect: Callable[[], asyncio.Protocol],
    tls: ssl.SSLContext | None = None,
) -> int:
    try:
        return await listening.listen(host, number, connect, tls)
    except OSError as error:
        number_of_error = error.errno or 0
        reason = os.strerror(number_of_error) if number_of_error > 0 else str(error)
        raise ListenFailed(host, number, reason) from None
