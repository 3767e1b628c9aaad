"""Consent: the rule which packets may act on a cell, and the question asked before one is sent.

Owns the rule: to act is to move the robot, or to switch an output or register on which other
machines may hang. What cannot be read counts as able to, since a real controller may read it
otherwise than we do. STOP is never asked about.
"""

from __future__ import annotations

import argparse
import sys

from openpendant.simplemsg import MsgType, SpecialSequence
from openpendant.simplemsg.framing import HEADER_SIZE, Frame, Mode, Splitter

from ..console import PacketToolError
from .answers import COMMAND_AT

ACTING_TYPES = frozenset(
    {MsgType.JOINT_TRAJ_PT, MsgType.JOINT_TRAJ, MsgType.JOINT_TRAJ_PT_FULL, MsgType.WRITE_OUTPUT}
    | {2001, 2005, 2009, 2013, 2016}
    | {65010, 65011, 65012, 65013}
)
"""Requests that move a robot, or that switch outputs and registers."""

_MOTION_CONTROL = 2001
_HARMLESS_COMMANDS = frozenset({200101, 200102, 200111})
"""Motoman motion control: asks whether ready, asks the queue's length, stops."""

_SEQUENCE_AT = {
    int(MsgType.JOINT_TRAJ_PT): HEADER_SIZE,
    int(MsgType.JOINT_TRAJ_PT_FULL): HEADER_SIZE + 4,
}


def may_act(data: bytes) -> bool:
    """Return True if bytes may move a robot or switch an output."""
    splitter = Splitter(Mode.ONLOOKER)
    pieces = [*splitter.feed(data), *splitter.finish()]
    return any(not piece.is_frame or _frame_may_act(piece.data) for piece in pieces)


def _frame_may_act(frame: bytes) -> bool:
    header = Frame(frame)
    if header.msg_type not in ACTING_TYPES:
        return False
    if header.msg_type == _MOTION_CONTROL:
        return Frame(frame).integer_at(COMMAND_AT) not in _HARMLESS_COMMANDS
    place = _SEQUENCE_AT.get(header.msg_type)
    return place is None or Frame(frame).integer_at(place) != SpecialSequence.STOP


def add_consent(command: argparse.ArgumentParser) -> None:
    """Add `--yes-it-may-move`."""
    command.add_argument(
        "--yes-it-may-move",
        action="store_true",
        help="send what may move a robot, or switch its outputs, without asking",
    )


def require_consent(given: bool, peer: str) -> None:
    """Ask the user at a terminal unless consent is given; raise PacketToolError without it."""
    if given:
        return
    if all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr)):
        question = f"This may move or switch what is behind {peer}. Send it? [y/N] "
        print(question, end="", file=sys.stderr, flush=True)
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return
    raise PacketToolError(
        f"not sent: it may move or switch what is behind {peer}; --yes-it-may-move sends it"
    )
