"""Trajectory files as text: CSV to write and read back, and ROS `JointTrajectory` YAML to write.

Owns both layouts. Pure functions from values to text and back: no file is opened here. Numbers are
written with a dot and in as few digits as give the same double again, whatever the locale.

CSV has a header and a row for each sample: the time [s], then the positions of all joints, their
velocities, their accelerations. A column is called `<joint> <quantity> [<unit>]`.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..description.limits import JointLimits
from ..errors import BadArgument, WrongJointCount
from ..pose import Array
from .trajectory import Trajectory

_TIME = "time [s]"
_QUANTITIES = {"position": "", "velocity": "/s", "acceleration": "/s²"}
_NS = 1_000_000_000


def to_csv(trajectory: Trajectory, limits: JointLimits) -> str:
    """Return a trajectory as CSV; `WrongJointCount` if it is of another robot."""
    _check_dof(trajectory, limits)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_header(limits))
    samples = _samples(trajectory)
    writer.writerows([repr(value) for value in row] for row in samples.tolist())
    return text.getvalue()


def from_csv(text: str, limits: JointLimits) -> Trajectory:
    """Read a trajectory that `to_csv` wrote.

    Its waypoint times are those of its start and its end: CSV does not hold the others.

    Args:
        text: the whole file; a byte-order mark and any line ends are accepted.

    Raises:
        BadArgument: a line or column that is not as written; with its number or name, and what
            would be accepted.
    """
    lines = list(csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline="")))
    header = _header(limits)
    if not lines or len(lines) < 3:
        raise BadArgument("CSV", f"{len(lines)} lines", "a header and two samples or more")
    for place, wanted in enumerate(header):
        found = lines[0][place] if place < len(lines[0]) else "missing"
        if found != wanted:
            raise BadArgument(f"CSV column {place + 1}", found, wanted)
    rows = [_numbers(line, number, len(header)) for number, line in enumerate(lines[1:], start=2)]
    samples = np.array(rows)
    if not (np.diff(samples[:, 0]) > 0.0).all():
        number = int(np.argmin(np.diff(samples[:, 0]) > 0.0)) + 3
        raise BadArgument(f"time in CSV line {number}", rows[number - 2][0], "later than before")
    position, velocity, acceleration = np.split(samples[:, 1:], 3, axis=1)
    times = samples[:, 0].copy()
    ends = times[[0, -1]]
    return Trajectory(times, position.copy(), velocity.copy(), acceleration.copy(), ends)


def to_ros_yaml(trajectory: Trajectory, limits: JointLimits) -> str:
    """Return it as YAML of ROS `trajectory_msgs/JointTrajectory`; refused as by `to_csv`."""
    _check_dof(trajectory, limits)
    # A JSON string is a YAML string too, whatever characters the name has.
    names = ", ".join(json.dumps(name) for name in limits.names)
    lines = [f"joint_names: [{names}]", "points:"]
    fields = (trajectory.position, trajectory.velocity, trajectory.acceleration)
    columns = [field.tolist() for field in fields]
    for time, *vectors in zip(trajectory.times.tolist(), *columns, strict=True):
        position, velocity, acceleration = (", ".join(map(_yaml_real, each)) for each in vectors)
        seconds, nanoseconds = divmod(round(time * _NS), _NS)
        lines += [
            f"- positions: [{position}]",
            f"  velocities: [{velocity}]",
            f"  accelerations: [{acceleration}]",
            f"  time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}",
        ]
    return "\n".join(lines) + "\n"


def _check_dof(trajectory: Trajectory, limits: JointLimits) -> None:
    if trajectory.dof != limits.dof:
        raise WrongJointCount(trajectory.dof, limits.dof)


def _header(limits: JointLimits) -> list[str]:
    return [_TIME, *_columns(limits)]


def _columns(limits: JointLimits) -> Iterator[str]:
    for quantity, per in _QUANTITIES.items():
        for index, name in enumerate(limits.names):
            yield f"{name} {quantity} [{limits.unit(index)}{per}]"


def _samples(trajectory: Trajectory) -> Array:
    return np.column_stack(
        (trajectory.times, trajectory.position, trajectory.velocity, trajectory.acceleration)
    )


def _numbers(line: Sequence[str], number: int, count: int) -> list[float]:
    if len(line) != count:
        raise BadArgument(f"CSV line {number}", f"{len(line)} values", f"{count} values")
    values: list[float] = []
    for place, text in enumerate(line, start=1):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise BadArgument(f"CSV line {number}, column {place}", text, "a finite number")
        values.append(value)
    return values


def _yaml_real(value: float) -> str:
    """Return a real as YAML 1.1 reads one: a mantissa with a dot even before an exponent."""
    text = repr(value)
    return text if "." in text or "e" not in text else text.replace("e", ".0e")
