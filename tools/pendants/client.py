"""The asyncio client library of the pendant protocol.

    async with await PendantClient.connect("127.0.0.1", 11010, client="my pendant") as pendant:
        async with pendant.control():
            move = await pendant.move_joints([0.0, -1.2, 1.2, -1.5, -1.5, 0.0], speed=0.2)
            await move.done()

Angles are radians, lengths metres, quaternions x, y, z, w; joints count from 0. It speaks the
public protocol and imports nothing of the server. Every refusal arrives as `Refused`, every aborted
motion as `Aborted`, both with the code of the catalogue, cause, remedy and the numbers; `explained`
of each failure is one line for a person.
`sync_client` has the same calls, blocking.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import (
    AccountRole,
    JogEnd,
    Motion,
    OperatingMode,
    RunKind,
    State,
)
from openpendant.simplemsg.pendant.management.cell import Hold, Snapshot, WayOut

from .admitting import Admitting
from .connection_errors import (
    DEFAULT_PORT,
    Aborted,
    ConnectionLost,
    NotTrusted,
    NotUnderstood,
    PendantError,
    Refused,
    StateSilent,
    Unanswered,
    Unreachable,
    WrongArgument,
)
from .jog import Jog, Jogging
from .managing import Managing, PlaybackHandle
from .motions import JogAccount, MotionHandle, MotionResult, Pose
from .operating import EnablingDevice, Operating

__all__ = [
    "DEFAULT_PORT",
    "Aborted",
    "AccountRole",
    "ConnectionLost",
    "EnablingDevice",
    "Hold",
    "Jog",
    "JogAccount",
    "JogEnd",
    "Motion",
    "MotionHandle",
    "MotionResult",
    "NotTrusted",
    "NotUnderstood",
    "OperatingMode",
    "PendantClient",
    "PendantError",
    "PlaybackHandle",
    "Pose",
    "Refused",
    "RunKind",
    "Snapshot",
    "State",
    "StateSilent",
    "Unanswered",
    "Unreachable",
    "WayOut",
    "WrongArgument",
]


class PendantClient(Operating, Managing, Jogging, Admitting):
    """One connection to a pendant server, with everything that a pendant can ask for.

    `session` has the connection and the callbacks, `observing` the state, `operating` authority,
    modes, stops and the single motions, `jog` the jogs, `admitting` who may come in,
    `managing` programs, recordings, frames, tools, scene, signals, connections and accounts.
    """
