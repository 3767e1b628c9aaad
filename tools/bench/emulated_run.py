"""A trajectory as the emulated controller runs it, on a clock that nobody waits for.

Owns the sending: each sample a point of type 14 through the codec, so that the controller sees
4-byte reals, a fixed time ahead as the server does. Judges nothing but that every point is taken.
"""

from __future__ import annotations

import numpy as np

from openpendant.controller_emulator.assembly import build_controller
from openpendant.controller_emulator.controller import Controller
from openpendant.controller_emulator.settings import EmulatorSettings
from openpendant.motion.trajectory import Array, Trajectory
from openpendant.server.settings import ControllerLink
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.simplemsg import Message, ReplyCode, codec_for

SAMPLE = 1_000_000
"""Time between two looks at the joints [ns]."""

_LINK = 1
_LATENCY = 200_000_000  # ns; longer than the controller takes to begin and to come to rest


def emulated_run(robot: str, trajectory: Trajectory, phase: int = 0) -> Array:
    """Return where the joints are every millisecond, (m, n), from before the start until rest.

    Args:
        robot: name of the robot.
        trajectory: what is sent; its first and last samples are at rest.
        phase: how long after each tick of the sender the joints are looked at [ns].

    Raises:
        RuntimeError: the controller refused a point or broke the motion off.
    """
    start = tuple(trajectory.position[0].tolist())
    settings = EmulatorSettings.model_validate({"robot": robot, "start": start})
    controller = build_controller(settings, 0)
    points = _points(trajectory)
    lead = round(ControllerLink().lead * 1e9)
    due = [round(time * 1e9) - lead for time in trajectory.times.tolist()]
    sent, run = 0, []
    for tick in range(0, round(trajectory.duration * 1e9) + _LATENCY, SAMPLE):
        while sent < len(points) and due[sent] <= tick:
            _send(controller, points[sent], tick)
            sent += 1
        controller.advance(tick + phase)
        run.append(controller.motion(tick + phase)[0])
    if controller.referee.total or controller.status(tick + phase).in_error:
        raise RuntimeError(str(controller.referee))
    return np.array(run)


def _points(trajectory: Trajectory) -> list[Message]:
    """Return the set-points as they arrive."""
    uplink = GenericUplink(ControllerLink(), np.abs(trajectory.velocity).max(axis=0).tolist())
    codec = codec_for()
    points = []
    for index in range(len(trajectory)):
        point = uplink.point(index, trajectory.row(index), 0.0, 0)
        points.append(codec.decode(codec.encode(point)))
    return points


def _send(controller: Controller, point: Message, now: int) -> None:
    replies = [reply for _, reply in controller.handle(_LINK, point, now)]
    if [reply.reply_code for reply in replies] != [ReplyCode.SUCCESS]:
        raise RuntimeError(f"a point was refused: {controller.referee}")
