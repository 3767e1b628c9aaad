"""Which packets may move a robot, and the question that is asked before one is sent.

Owns the rule; what cannot be read counts as able to move, since a real controller may read it
otherwise than we do. STOP is never asked about.
"""

from __future__ import annotations

import argparse
import struct
import sys

from openpendant.simplemsg import MsgType, SpecialSequence
from openpendant.simplemsg.layout import HEADER_SIZE

from ..console import PacketToolError
from ..faulty.frame_surgery import header_of
from ..frames import FrameSplitter

MOVING_TYPES = frozenset(
    {MsgType.JOINT_TRAJ_PT, MsgType.JOINT_TRAJ, MsgType.JOINT_TRAJ_PT_FULL}
    | {2001, 2016}
    | {65010, 65011, 65012, 65013}
)
"""Requests that a robot may answer with motion."""

_MOTION_CONTROL = 2001
_COMMAND_AT = HEADER_SIZE + 8
_HARMLESS_COMMANDS = frozenset({200101, 200102, 200111})
"""Motoman motion control: asks whether ready, asks the queue's length, stops."""

_SEQUENCE_AT = {
    int(MsgType.JOINT_TRAJ_PT): HEADER_SIZE,
    int(MsgType.JOINT_TRAJ_PT_FULL): HEADER_SIZE + 4,
}


def may_move(data: bytes) -> bool:
    """Tell whether bytes may make a robot move.

    Args:
        data: what is to be sent, any number of frames.
    """
    splitter = FrameSplitter()
    pieces = [*splitter.feed(data), *splitter.finish()]
    return any(not piece.is_frame or _frame_may_move(piece.data) for piece in pieces)


def _frame_may_move(frame: bytes) -> bool:
    header = header_of(frame)
    if header.msg_type not in MOVING_TYPES:
        return False
    if header.msg_type == _MOTION_CONTROL:
        return _integer(frame, _COMMAND_AT, header.order.value) not in _HARMLESS_COMMANDS
    place = _SEQUENCE_AT.get(header.msg_type)
    return place is None or _integer(frame, place, header.order.value) != SpecialSequence.STOP


def _integer(frame: bytes, place: int, order: str) -> int | None:
    if len(frame) < place + 4:
        return None
    value: int = struct.unpack_from(f"{order}i", frame, place)[0]
    return value


def add_consent(command: argparse.ArgumentParser) -> None:
    """Add `--yes-it-may-move`."""
    command.add_argument(
        "--yes-it-may-move",
        action="store_true",
        help="send what may move a robot without asking",
    )


def require_consent(given: bool, peer: str) -> None:
    """Ask the user at a terminal, or refuse.

    Args:
        given: consent came with the arguments.
        peer: who would get the packets.

    Raises:
        PacketToolError: there is no consent.
    """
    if given:
        return
    if sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty():
        print(f"This may move the robot behind {peer}. Send it? [y/N] ", end="", file=sys.stderr)
        sys.stderr.flush()
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return
    raise PacketToolError(
        f"not sent: it may move the robot behind {peer}; --yes-it-may-move sends it"
    )
