"""Plot of a motion: position, velocity and acceleration of every joint over time.

Owns the layout of the PNG. Besides the demo's report the only module that draws with matplotlib,
which it imports when called.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..description.limits import JointLimits
from ..trajectory.trajectory import Trajectory

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
