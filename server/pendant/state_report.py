"""What the server says of a cell: the pendants' state message and the ROS-I topics.

Owns the filling of these messages from the cell; knows nothing of who listens or how often.
"""

from __future__ import annotations

from openpendant.simplemsg import JointPosition, Status, TriState, joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    EnablingPosition,
    JogReason,
    ProgramState,
    State,
    StateField,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..robot_cell import RobotCell
from ..robot_view import RobotView
from .replies import stop_kind

_NO_JOINTS = joint_array(())
_NO_REASON = JogReason.NONE
_NO_PROGRAM = ProgramState.NONE
_WITH_POSITION = StateField.POSITION | StateField.TOOL
_WITH_VELOCITY = _WITH_POSITION | StateField.VELOCITY
_UNKNOWN_STATUS = Status(
    drives_powered=TriState.UNKNOWN,
    e_stopped=TriState.UNKNOWN,
    error_code=0,
    in_error=TriState.UNKNOWN,
    in_motion=TriState.UNKNOWN,
    mode=-1,
    motion_possible=TriState.UNKNOWN,
)


def state_message(cell: RobotCell, tool: RobotView, sequence: int, now: int) -> State:
    """Return the state of a cell; `dropped` is left at 0.

    Args:
        cell: the cell.
        tool: where its tool is.
        sequence: number of the message.
        now: monotonic time, ns.
    """
    feedback, modes = cell.feedback, cell.modes
    status = feedback.status or _UNKNOWN_STATUS
    holder = cell.authority.holder
    request = cell.request
    program = cell.program
    controller_mode = feedback.mode
    seconds, nanoseconds = divmod(now, 1_000_000_000)
    age = feedback.age(now)
    state = State(
        sequence=sequence,
        time_s=seconds,
        time_ns=nanoseconds,
        age=-1.0 if age is None else age / 1e9,
        dropped=0,
        activity=cell.activity,
        request_id=0 if request is None else request.request_id,
        holder=0 if holder is None else holder.session,
        stop=stop_kind(cell.stop),
        operating_mode=modes.mode(controller_mode),
        enabling=EnablingPosition.RELEASED
        if holder is None
        else modes.enabling(holder.session, now),
        override=modes.override,
        tool_speed_cap=modes.tool_speed_cap(controller_mode) or 0.0,
        jog_scale=1.0,
        jog_reason=_NO_REASON,
        jog_joint=-1,
        program_state=_NO_PROGRAM if program is None else program.state,
        program_line=0 if program is None else program.line,
        link=cell.link_state(now),
        drives_powered=status.drives_powered,
        e_stopped=status.e_stopped,
        error_code=status.error_code,
        in_error=status.in_error,
        in_motion=status.in_motion,
        mode=status.mode,
        motion_possible=status.motion_possible,
        valid_fields=0,
        tool_speed=0.0,
        positions=_NO_JOINTS,
        velocities=_NO_JOINTS,
        tool_position=(0.0, 0.0, 0.0),
        tool_orientation=(0.0, 0.0, 0.0, 1.0),
    )
    jog = cell.motions.driven_jog
    step = None if jog is None else jog.step
    if step is not None:
        state.jog_scale = step.scale
        if step.cause is not None:
            state.jog_reason = JogReason[step.cause.reason.name]
            state.jog_joint = step.cause.joint
    position = feedback.position
    if position is not None:
        state.positions = joint_array(position)
        state.valid_fields = _WITH_POSITION
        if feedback.velocity_known:
            state.velocities = joint_array(feedback.velocity)
            state.valid_fields = _WITH_VELOCITY
        state.tool_position, state.tool_orientation, state.tool_speed = tool.tool_motion(
            position, feedback.velocity
        )
    return state


def joint_position_message(cell: RobotCell, now: int) -> JointPosition | None:
    """Return the joint positions for the ROS-I state port.

    The message has no age, so an old position must not be repeated: None unless one is fresh.
    """
    position = cell.feedback.position
    if position is None or not cell.feedback.is_fresh(now):
        return None
    return JointPosition(sequence=0, joints=joint_array(position))


def status_message(cell: RobotCell, refused: VerdictCode | None, now: int) -> Status:
    """Return the status for the ROS-I state port: the controller's, narrowed by our own.

    Args:
        cell: the cell.
        refused: why the last trajectory of this face was refused; None where it was not.
        now: monotonic time, ns.

    Returns:
        Our own obstacles make `motion_possible` false; a refusal is shown as an error, because
        the real client does not look at failure replies.
    """
    status = cell.feedback.status or _UNKNOWN_STATUS
    obstacle = cell.obstacle(now)
    busy = obstacle is not None and obstacle.code in (VerdictCode.MOVING, VerdictCode.PLANNING)
    moving = cell.activity is not Activity.IDLE or status.in_motion == TriState.TRUE
    error_code, in_error = status.error_code, status.in_error
    if in_error != TriState.TRUE and refused is not None:
        error_code, in_error = refused, TriState.TRUE
    if in_error != TriState.TRUE and obstacle is not None and not busy:
        error_code, in_error = obstacle.code, TriState.TRUE
    return Status(
        drives_powered=status.drives_powered,
        e_stopped=status.e_stopped,
        error_code=error_code,
        in_error=in_error,
        in_motion=TriState.TRUE if moving else status.in_motion,
        mode=status.mode,
        motion_possible=TriState.TRUE if obstacle is None or busy else TriState.FALSE,
    )
