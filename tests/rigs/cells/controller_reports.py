"""What a controller reports, where a test says little of it: joints, and a status."""

from collections.abc import Sequence

from openpendant.simplemsg import JointFeedback, Status, ValidField, joint_array


def joint_report(
    position: Sequence[float], velocity: Sequence[float] | None = None
) -> JointFeedback:
    """Return places [rad or m], and speeds [1/s] where they are given."""
    fields = ValidField.POSITION | (0 if velocity is None else ValidField.VELOCITY)
    speeds = joint_array(velocity or ())
    return JointFeedback(0, fields, 0.0, joint_array(position), speeds, joint_array(()))


def status(
    *, powered: int = 1, e_stopped: int = 0, error: int = 0, moving: int = 0, possible: int = 1
) -> Status:
    """Return the status of a controller in automatic mode; it is in error where it has one."""
    return Status(powered, e_stopped, error, int(error != 0), moving, 2, possible)
