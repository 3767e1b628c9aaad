"""Output of `openpendant plan`: its table, its JSON, and the plot of a motion's joints over time.

Owns these layouts; CSV and ROS YAML are `trajectory_files`'. In JSON angles are controller-side
[rad or m, s]; degrees and millimetres appear in the table only. Matplotlib is imported when called.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..description.limits import JointLimits
from ..trajectory.certificate import Certificate
from ..trajectory.trajectory import Trajectory
from .table_layout import print_table


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """Plan with the data of its making.

    Attributes:
        plan_seconds: for goals, planning and timing [s].
        goals: joint positions reached in sequence.
    """

    robot: str
    planner: str
    seed: int
    plan_seconds: float
    goals: tuple[tuple[float, ...], ...]
    trajectory: Trajectory
    certificate: Certificate
    limits: JointLimits

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as plain data for JSON."""
        motion = self.trajectory
        return {
            "robot": self.robot,
            "planner": self.planner,
            "seed": self.seed,
            "plan_seconds": self.plan_seconds,
            "duration": motion.duration,
            "angles": "controller",
            "joint_names": self.limits.names,
            "goals": self.goals,
            "certificate": self.certificate.as_dict(),
            "waypoint_times": motion.waypoint_times.tolist(),
            "times": motion.times.tolist(),
            "position": motion.position.tolist(),
            "velocity": motion.velocity.tolist(),
            "acceleration": motion.acceleration.tolist(),
        }


def json_text(plan: PlannedMotion) -> str:
    """Return the plan as one line of JSON."""
    return json.dumps(plan.as_dict(), separators=(",", ":"), allow_nan=False) + "\n"


def print_plan(
    plan: PlannedMotion,
    rows: int,
    called: Mapping[str, str],
    console: Console | None = None,
) -> None:
    """Print joint angles and velocities at evenly spread times, and the figures of the plan.

    Args:
        called: what each joint is called, by its name in the robot file.
    """
    console = console or Console()
    limits, motion = plan.limits, plan.trajectory
    table = Table(title=f"{plan.robot}: position (velocity), controller-side")
    # As text, because rich would read `[s]` or `[mm]` as its own markup and leave it out.
    table.add_column(Text("time [s]"), justify="right")
    for index, name in enumerate(limits.names):
        unit = "mm" if limits.prismatic[index] else "°"
        table.add_column(Text(f"{called[name]} [{unit}]"), justify="right")
    scale = [1e3 if prismatic else math.degrees(1.0) for prismatic in limits.prismatic]
    for sample in np.unique(np.linspace(0, len(motion) - 1, rows).round().astype(int)).tolist():
        row = motion.row(sample)
        cells = (
            f"{q * factor:z.2f} ({v * factor:z.1f})"
            for q, v, factor in zip(row.position, row.velocity, scale, strict=True)
        )
        table.add_row(f"{row.time:.2f}", *cells)
    print_table(table, console)
    found = plan.certificate
    console.print(f"planner {plan.planner}, seed {plan.seed}, planned in {plan.plan_seconds:.3f} s")
    console.print(f"duration {motion.duration:.2f} s, {len(motion)} samples")
    console.print(
        f"largest share of a limit: velocity {found.velocity.ratio:.1%}"
        f" ({called[found.velocity.joint]}), acceleration {found.acceleration.ratio:.1%}"
        f" ({called[found.acceleration.joint]})"
    )
    console.print("certificate: valid, every sample keeps position, velocity and acceleration")


_SIZE = (9.0, 9.0)  # inches
_RESOLUTION = 120  # dots per inch


def plot_trajectory(
    trajectory: Trajectory, limits: JointLimits, title: str, path: str | Path
) -> None:
    """Write a PNG; angles in degrees, lengths in mm.

    Raises:
        OSError: the file cannot be written.
        ModuleNotFoundError: matplotlib is not installed.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE, layout="constrained")
    FigureCanvasAgg(figure)
    scale = np.where(limits.prismatic, 1e3, np.degrees(1.0))
    unit = "° or mm" if any(limits.prismatic) else "°"
    axes = figure.subplots(3, 1, sharex=True)
    fields = (trajectory.position, trajectory.velocity, trajectory.acceleration)
    names = (f"position [{unit}]", f"velocity [{unit}/s]", f"acceleration [{unit}/s²]")
    for plot, field, name in zip(axes, fields, names, strict=True):
        plot.plot(trajectory.times, field * scale)
        for time in trajectory.waypoint_times[1:-1].tolist():
            plot.axvline(time, color="0.8", linewidth=0.8, zorder=0)
        plot.set_ylabel(name)
        plot.grid(alpha=0.3)
    axes[0].legend(limits.names, fontsize="small", loc="best")
    axes[0].set_title(title)
    axes[-1].set_xlabel("time [s]")
    figure.savefig(path, format="png", dpi=_RESOLUTION)
