"""State reports of a cell: the pendants' state message and the ROS-I topics.

Owns the filling of these messages from the cell; knows nothing of who listens or how often.
"""

from __future__ import annotations

from typing import Protocol

from openpendant.simplemsg import (
    CommType,
    JointPosition,
    ReplyCode,
    Status,
    TriState,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    Activity,
    EnablingPosition,
    JogReason,
    ProgramState,
    State,
    StateField,
    StopKind,
)
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET, VerdictCode

from ..events.replies import stop_kind
from .execution.feedback import Feedback
from .execution.setpoint_sources import JogRows
from .interlocks import PASSING
from .robot_cell import RobotCell
from .robot_model import RobotModel

# A member of an enumeration takes longer to look up than most fields take to fill in.
_TOPIC, _UNUSED = CommType.TOPIC, ReplyCode.UNUSED
_NO_STOP = StopKind.NONE
_NO_REASON = JogReason.NONE
_NO_PROGRAM = ProgramState.NONE
_RELEASED = EnablingPosition.RELEASED
_NO_JOINTS = joint_array(())
_NO_PLACE = (0.0, 0.0, 0.0)
_NO_TURN = (0.0, 0.0, 0.0, 1.0)
_WITH_POSITION = StateField.POSITION | StateField.TOOL
_WITH_VELOCITY = _WITH_POSITION | StateField.VELOCITY
_REASONS = {reason.name.lower().replace("_", "-"): reason for reason in JogReason}
"""The reasons on the wire by those of the jogger, which are words."""

_UNKNOWN_STATUS = Status(
    drives_powered=TriState.UNKNOWN,
    e_stopped=TriState.UNKNOWN,
    error_code=0,
    in_error=TriState.UNKNOWN,
    in_motion=TriState.UNKNOWN,
    mode=-1,
    motion_possible=TriState.UNKNOWN,
)


def state_message(cell: RobotCell, tool: RobotModel, sequence: int, now: int) -> State:
    """Return the state of a cell; `dropped` is left at 0."""
    # Field by field: to call the class with forty names takes six times as long, each tick.
    state = State.__new__(State)
    state.comm_type, state.reply_code = _TOPIC, _UNUSED
    state.sequence, state.dropped = sequence, 0
    state.time_s, state.time_ns = divmod(now, 1_000_000_000)
    work = cell.driving.work
    state.request_id = 0 if work is None else work.request.request_id
    _tell_cell(state, cell, now)
    _tell_jog(state, None if work is None else work.jog)
    status = cell.feedback.status or _UNKNOWN_STATUS
    state.drives_powered, state.e_stopped = status.drives_powered, status.e_stopped
    state.error_code, state.in_error = status.error_code, status.in_error
    state.in_motion, state.motion_possible = status.in_motion, status.motion_possible
    state.mode = status.mode
    _tell_motion(state, cell.feedback, tool, now)
    return state


def _tell_cell(state: State, cell: RobotCell, now: int) -> None:
    """Fill in what the cell does, who is in control of it, and what rules its motions."""
    modes, controller_mode = cell.modes, cell.feedback.mode
    holder, program, stop = cell.authority.holder, cell.program, cell.stop
    state.activity = cell.activity
    state.stop = _NO_STOP if stop is None else stop_kind(stop)
    state.operating_mode = modes.mode(controller_mode)
    if holder is None:
        state.holder, state.enabling = 0, _RELEASED
    else:
        state.holder, state.enabling = holder.session, modes.enabling(holder.session, now)
    state.override = modes.override
    state.tool_speed_cap = modes.tool_speed_cap(controller_mode) or 0.0
    if program is None:
        state.program_state, state.program_line = _NO_PROGRAM, 0
    else:
        state.program_state, state.program_line = program.state, program.line
    state.link = cell.link_state(now)


def _tell_jog(state: State, jog: JogRows | None) -> None:
    """Fill in how much of the jog that is asked for is driven, and why no more."""
    step = None if jog is None else jog.step
    cause = None if step is None else step.cause
    state.jog_scale = 1.0 if step is None else step.scale
    if cause is None:
        state.jog_reason, state.jog_joint = _NO_REASON, -1
    else:
        state.jog_reason, state.jog_joint = _REASONS[cause.reason], cause.joint


def _tell_motion(state: State, feedback: Feedback, tool: RobotModel, now: int) -> None:
    """Fill in where the robot is and how it moves, as far as anyone knows."""
    position, velocity = feedback.position, feedback.velocity
    if position is None:
        state.age, state.valid_fields, state.tool_speed = -1.0, 0, 0.0
        state.positions = state.velocities = _NO_JOINTS
        state.tool_position, state.tool_orientation = _NO_PLACE, _NO_TURN
        return
    state.age = (now - feedback.received) / 1e9
    state.positions = joint_array(position)
    if feedback.velocity_known:
        state.velocities, state.valid_fields = joint_array(velocity), _WITH_VELOCITY
    else:
        state.velocities, state.valid_fields = _NO_JOINTS, _WITH_POSITION
    place, turn, speed = tool.tool_motion(position, velocity)
    state.tool_position, state.tool_orientation, state.tool_speed = place, turn, speed


def joint_position_message(cell: RobotCell, now: int) -> JointPosition | None:
    """Return the joint positions for the ROS-I state port.

    The message has no age, so an old position must not be repeated: None unless one is fresh.
    """
    position = cell.feedback.position
    if position is None or not cell.feedback.is_fresh(now):
        return None
    return JointPosition(sequence=0, joints=joint_array(position))


class Reason(Protocol):
    """The reason why the last trajectory of a ROS-I client did not come to its end."""

    def beside(self, standing: VerdictCode | None) -> VerdictCode:
        """Return the newer of it and of the condition that is broken now; None for none."""


def status_message(cell: RobotCell, newest: Reason | None, now: int) -> Status:
    """Return the status for the ROS-I state port: the controller's, narrowed by our own.

    Args:
        newest: why the last trajectory of this endpoint did not come to its end; None where it did.

    Returns:
        Our own obstacles make `motion_possible` false; they and a refusal are shown as an error,
        because the real client does not look at failure replies. An error of the controller's own
        comes before them.
    """
    status = cell.feedback.status or _UNKNOWN_STATUS
    obstacle = cell.obstacle(now)
    busy = obstacle is not None and obstacle.code in PASSING
    moving = cell.activity is not Activity.IDLE or status.in_motion == TriState.TRUE
    error_code, in_error = status.error_code, status.in_error
    standing = None if obstacle is None or busy else obstacle.code
    verdict = standing if newest is None else newest.beside(standing)
    if in_error != TriState.TRUE and verdict is not None:
        error_code, in_error = STATUS_ERROR_OFFSET + verdict, TriState.TRUE
    return Status(
        drives_powered=status.drives_powered,
        e_stopped=status.e_stopped,
        error_code=error_code,
        in_error=in_error,
        in_motion=TriState.TRUE if moving else status.in_motion,
        mode=status.mode,
        motion_possible=TriState.TRUE if obstacle is None or busy else TriState.FALSE,
    )
