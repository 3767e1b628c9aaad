"""Vendor profiles: the values in which one vendor's controller differs from another, as data."""

from __future__ import annotations

from typing import NamedTuple

from openpendant.simplemsg import ByteOrder, MsgType


class ControllerProfile(NamedTuple):
    """One vendor's way of speaking simple message.

    Attributes:
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


GENERIC = ControllerProfile(
    name="generic",
    motion_port=12000,
    state_port=12002,
    byte_order=ByteOrder.LITTLE,
    accepts=frozenset(
        {
            MsgType.PING,
            MsgType.GET_VERSION,
            MsgType.JOINT_TRAJ_PT,
            MsgType.JOINT_TRAJ,
            MsgType.JOINT_TRAJ_PT_FULL,
        }
    ),
    state=(MsgType.JOINT_POSITION, MsgType.JOINT_FEEDBACK),
    status_every=10,
)
"""No vendor's, and what the ROS-I documents describe.

Replies are header-only, of the request's type. A full buffer delays the reply. STOP is sequence -4.
"""

PROFILES: dict[str, ControllerProfile] = {profile.name: profile for profile in (GENERIC,)}
