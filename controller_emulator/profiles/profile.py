"""Vendor profile: the values in which one vendor's controller differs from another."""

from __future__ import annotations

from typing import NamedTuple

from openpendant.simplemsg import ByteOrder, MsgType


class ControllerProfile(NamedTuple):
    """One vendor's way of speaking simple message.

    Attributes:
        name: as in the settings.
        motion_port: default TCP port of the motion link.
        state_port: default TCP port of the state link.
        byte_order: order on the state link, where a silent client cannot be asked.
        accepts: requests that the motion link takes; others get a header-only failure.
        state: topics of the state link, in the order in which they are sent.
        status_every: STATUS accompanies every so many joint reports, and every change.
    """

    name: str
    motion_port: int
    state_port: int
    byte_order: ByteOrder
    accepts: frozenset[MsgType]
    state: tuple[MsgType, ...]
    status_every: int
