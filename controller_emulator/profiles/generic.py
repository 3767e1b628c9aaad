"""The generic profile: no vendor's, and what the ROS-I documents describe.

Replies are header-only, of the request's type. A full buffer delays the reply. STOP is sequence -4.
"""

from __future__ import annotations

from openpendant.simplemsg import ByteOrder, MsgType

from .profile import ControllerProfile

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
