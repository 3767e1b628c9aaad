"""The state of a cell, as every listener gets it at its own rate."""

from enum import IntEnum, IntFlag
from typing import Annotated

from ..codes import ControllerMode, TriState
from ..declaration import Int, Real, Reals, Topic
from .authority import EnablingPosition, OperatingMode, StopKind
from .motion import JogReason, ProgramState
from .places import JOINT_UNIT, from_server


class Activity(IntEnum):
    """What the cell is doing."""

    IDLE = 0
    PLANNING = 1
    MOVING = 2
    STOPPING = 3
    JOGGING = 4
    PAUSED = 5
    PAUSING = 6


class LinkState(IntEnum):
    """The server's connection to the robot controller."""

    DOWN = 0
    UP = 1
    STALE = 2


class StateField(IntFlag):
    """Which values of a `State` are known."""

    POSITION = 2
    VELOCITY = 4
    TOOL = 16


@from_server(65020, "state", "State of the cell, at the rate that the pendant chose.")
class State(Topic):
    """STATE: the newest only; what a slow reader misses is counted in `dropped`.

    A field with an enumeration takes a member. Decoded it is the plain integer, which equals the
    member, or one that has no member yet where the server is newer: give it to the enumeration only
    after looking. To decode into members would take 16 % longer.
    """

    sequence: Annotated[int, Int("counts the cell's state messages; a listener may see gaps")]
    time_s: Annotated[int, Int("the server's monotonic time, whole seconds", "s")]
    time_ns: Annotated[int, Int("the server's monotonic time, rest", "ns")]
    age: Annotated[float, Real("age of the controller's last report, -1 before the first", "s")]
    dropped: Annotated[int, Int("state messages that this connection was too slow for")]
    activity: Annotated[
        Activity | int, Int("what the cell does; 6: about to be paused", values=Activity)
    ]
    request_id: Annotated[int, Int("request that is planned or moving, 0 for none")]
    holder: Annotated[int, Int("session that holds the motion authority, 0 for none")]
    stop: Annotated[
        StopKind | int, Int("latched stop: 0 none, 1 software, 2 protective", values=StopKind)
    ]
    operating_mode: Annotated[
        OperatingMode | int, Int("the server's own mode", values=OperatingMode)
    ]
    enabling: Annotated[
        EnablingPosition | int,
        Int("the authority's enabling device (training)", values=EnablingPosition),
    ]
    override: Annotated[float, Real("speed override, 0 to 1")]
    tool_speed_cap: Annotated[float, Real("cap of tool and elbow, 0 for none", "m/s")]
    jog_scale: Annotated[float, Real("part of the asked jog speed that is driven, 0 to 1")]
    jog_reason: Annotated[JogReason | int, Int("why it is less than 1", values=JogReason)]
    jog_joint: Annotated[int, Int("joint at fault, -1 for none")]
    program_state: Annotated[
        ProgramState | int, Int("what the program is doing", values=ProgramState)
    ]
    program_line: Annotated[int, Int("its current line, 0 for none")]
    link: Annotated[
        LinkState | int, Int("controller connection: 0 down, 1 up, 2 stale", values=LinkState)
    ]
    drives_powered: Annotated[
        TriState | int, Int("the controller's own, -1 unknown", values=TriState)
    ]
    e_stopped: Annotated[TriState | int, Int("the controller's own, -1 unknown", values=TriState)]
    error_code: Annotated[int, Int("the controller's own, 0 for none")]
    in_error: Annotated[TriState | int, Int("the controller's own, -1 unknown", values=TriState)]
    in_motion: Annotated[TriState | int, Int("the controller's own, -1 unknown", values=TriState)]
    mode: Annotated[
        ControllerMode | int,
        Int("the controller's own: -1 unknown, 1 manual, 2 automatic", values=ControllerMode),
    ]
    motion_possible: Annotated[
        TriState | int, Int("the controller's own, -1 unknown", values=TriState)
    ]
    valid_fields: Annotated[
        StateField | int, Int("bits: 2 positions, 4 velocities, 16 tool", values=StateField)
    ]
    tool_speed: Annotated[float, Real("speed of the tool", "m/s")]
    positions: Annotated[tuple[float, ...], Reals("joint positions", JOINT_UNIT)]
    velocities: Annotated[tuple[float, ...], Reals("joint velocities", "rad/s, m/s")]
    tool_position: Annotated[tuple[float, ...], Reals("x, y, z of the tool in base", "m", count=3)]
    tool_orientation: Annotated[
        tuple[float, ...], Reals("quaternion x, y, z, w of the tool in base", count=4)
    ]
