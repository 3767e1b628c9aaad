"""Report of the demonstration: planned against executed motion, as numbers and a plot.

Reads the files of the processes: the server's kept motions, the emulator's motion log and referee
report, the pendant's tour report. Knows nothing of the processes.
"""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

QUANTITIES = ("position", "velocity", "acceleration")

_LONGEST_DELAY = 0.1
_DELAY_STEP = 2.5e-4


@dataclass(frozen=True, slots=True)
class Samples:
    """A motion over time.

    Attributes:
        times: (m,) monotonic time [s].
        position: (m, n) [rad or m].
        velocity: (m, n).
        acceleration: (m, n).
    """

    times: Array
    position: Array
    velocity: Array
    acceleration: Array

    def at(self, times: Array) -> Array:
        """Return the position at times, (k, n): cubic between samples, resting outside."""
        left = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        step = (self.times[left + 1] - self.times[left])[:, np.newaxis]
        u = np.clip((times - self.times[left])[:, np.newaxis] / step, 0.0, 1.0)
        w = 1.0 - u
        start, end = self.position[left], self.position[left + 1]
        v_start, v_end = self.velocity[left], self.velocity[left + 1]
        moved: Array = w * w * ((1 + 2 * u) * start + u * step * v_start) + u * u * (
            (1 + 2 * w) * end - w * step * v_end
        )
        return moved


@dataclass(frozen=True, slots=True)
class TourMotion:
    """One motion of the tour.

    Attributes:
        plan_time: time that planning took [s].
        limit_ratio: the greatest share of a velocity or acceleration limit that it used.
        delay: from the server's first set-point to the controller's start [s].
        error: the greatest distance of an executed joint position from the plan [rad or m].
    """

    name: str
    planned: Samples
    plan_time: float
    limit_ratio: float
    delay: float
    error: float

    @property
    def duration(self) -> float:
        """Planned duration [s]."""
        return float(self.planned.times[-1] - self.planned.times[0])


@dataclass(frozen=True, slots=True)
class DemoResult:
    """Results of the demonstration."""

    robot: str
    joints: tuple[str, ...]
    motions: tuple[TourMotion, ...]
    executed: Samples
    violations: int
    taught_poses: int

    def text(self) -> str:
        """Return the summary that is printed."""
        plan_times = [1000 * motion.plan_time for motion in self.motions]
        error = max(motion.error for motion in self.motions)
        lines = [
            f"{len(self.motions)} motions of {self.robot}, "
            f"one of them through {self.taught_poses} taught poses",
            f"plan time:            {sum(plan_times):.1f} ms, {max(plan_times):.1f} ms worst",
            f"motion time:          {sum(motion.duration for motion in self.motions):.2f} s",
            f"start delay:          {1000 * max(m.delay for m in self.motions):.1f} ms worst",
            f"worst tracking error: {error:.1e} rad or m, start delay taken out",
            f"worst limit ratio:    {max(motion.limit_ratio for motion in self.motions):.6f}",
            f"referee:              {self.violations} violations",
        ]
        return "\n".join(lines)


def summarise(
    robot: str, tour: Path, plans: Path, record: Path, referee: Path, origin: float
) -> DemoResult:
    """Read the processes' files and compare plan and execution; the log begins at `origin` [s]."""
    about = json.loads(tour.read_text(encoding="utf-8"))
    joints, executed = _read_log(record, origin)
    names = [motion["name"] for motion in about["motions"]]
    kept = [_read_kept(path) for path in sorted(plans.glob("*.json"))]
    ends = [started for _, started in kept[1:]] + [float("inf")]
    motions = [
        _compare(path, name, executed, until)
        for (path, _), name, until in zip(kept, names, ends, strict=True)
    ]
    return DemoResult(
        robot=about["robot"] or robot,
        joints=joints,
        motions=tuple(motions),
        executed=executed,
        violations=int(json.loads(referee.read_text(encoding="utf-8"))["violations"]),
        taught_poses=int(about["poses"]),
    )


def _read_log(record: Path, origin: float) -> tuple[tuple[str, ...], Samples]:
    with record.open(encoding="ascii", newline="") as stream:
        rows = csv.reader(stream)
        header = next(rows)
        table = np.array([[float(value) for value in row] for row in rows])
    joints = tuple(name.rpartition(".")[0] for name in header[1::3])
    return joints, Samples(table[:, 0] + origin, table[:, 1::3], table[:, 2::3], table[:, 3::3])


def _read_kept(path: Path) -> tuple[Path, float]:
    return path, json.loads(path.read_text(encoding="utf-8"))["started_ns"] / 1e9


def _compare(path: Path, name: str, executed: Samples, until: float) -> TourMotion:
    """Compare a kept motion with what was executed before the next one began."""
    about: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    started = about["started_ns"] / 1e9
    with np.load(path.with_suffix(".npz")) as stored:
        planned = Samples(stored["times"] + started, *(stored[quantity] for quantity in QUANTITIES))
    delay, error = tracking(planned, executed, until)
    certificate = about["certificate"]
    ratio = max(certificate["velocity"]["ratio"], certificate["acceleration"]["ratio"])
    return TourMotion(name, planned, about["plan_time"], ratio, delay, error)


def tracking(planned: Samples, executed: Samples, until: float) -> tuple[float, float]:
    """Find when the controller began a motion, and how well it followed it.

    A controller starts a little after the first set-point was sent. The delay is the one for which
    the greatest error is least; the error is what remains.

    Args:
        planned: the plan, on the clock of the execution.
        executed: what the controller did.
        until: where the next motion begins [s]; nothing after it is compared.

    Returns:
        Delay [s] and greatest error of any joint [rad or m].
    """
    begin, end = planned.times[0], min(planned.times[-1] + _LONGEST_DELAY, until)
    during = (executed.times >= begin) & (executed.times <= end)
    times, position = executed.times[during], executed.position[during]
    best = (0.0, float("inf"))
    for delay in np.arange(0.0, _LONGEST_DELAY, _DELAY_STEP):
        error = float(np.abs(planned.at(times - delay) - position).max())
        if error < best[1]:
            best = (float(delay), error)
    # Between two steps of the search the error falls and rises linearly with the delay.
    low, high = best[0] - _DELAY_STEP, best[0] + _DELAY_STEP
    for _ in range(40):
        thirds = low + (high - low) / 3, high - (high - low) / 3
        errors = [float(np.abs(planned.at(times - d) - position).max()) for d in thirds]
        low, high = (low, thirds[1]) if errors[0] < errors[1] else (thirds[0], high)
    delay = (low + high) / 2
    return delay, float(np.abs(planned.at(times - delay) - position).max())


def write_csv(result: DemoResult, path: Path) -> Path:
    """Write planned and executed motion as one table and return its path.

    Each row is one planned or executed sample; times are seconds from the first set-point.
    """
    origin = result.motions[0].planned.times[0]
    header = ["kind", "motion", "time"]
    header += [f"{joint}.{quantity}" for quantity in QUANTITIES for joint in result.joints]
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        for motion in result.motions:
            _write_rows(writer, "planned", motion.name, motion.planned, origin - motion.delay)
        _write_rows(writer, "executed", "", result.executed, origin)
    return path


def _write_rows(writer: Any, kind: str, motion: str, samples: Samples, origin: float) -> None:
    table = np.hstack([samples.position, samples.velocity, samples.acceleration])
    for time, row in zip(samples.times - origin, table, strict=True):
        writer.writerow([kind, motion, f"{time:.6f}", *(f"{value:.9g}" for value in row)])


def write_plot(result: DemoResult, path: Path) -> Path:
    """Plot position, velocity and acceleration of every joint over time and return the path."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(3, 1, sharex=True, figsize=(13, 10), layout="constrained")
    origin = result.motions[0].planned.times[0]
    units = {"position": "rad, m", "velocity": "rad/s, m/s", "acceleration": "rad/s², m/s²"}
    colours = pyplot.rcParams["axes.prop_cycle"].by_key()["color"]
    for axis, quantity in zip(axes, QUANTITIES, strict=True):
        values = getattr(result.executed, quantity)
        for joint, name in enumerate(result.joints):
            colour = colours[joint % len(colours)]
            axis.plot(result.executed.times - origin, values[:, joint], color=colour, label=name)
            for motion in result.motions:
                axis.plot(
                    motion.planned.times - origin + motion.delay,
                    getattr(motion.planned, quantity)[:, joint],
                    color="black",
                    linewidth=0.7,
                    linestyle=(0, (4, 4)),
                )
        axis.set_ylabel(f"{quantity} [{units[quantity]}]")
        axis.grid(alpha=0.3)
    for motion in result.motions:
        axes[0].axvline(motion.planned.times[0] - origin, color="grey", linewidth=0.4)
    axes[-1].set_xlabel("time [s]")
    axes[0].set_title(
        f"{result.robot}: executed (colour) and planned (dashed); worst tracking error"
        f" {max(motion.error for motion in result.motions):.1e} rad"
    )
    axes[0].legend(loc="upper right", fontsize="small", ncols=2)
    last = max(motion.planned.times[-1] for motion in result.motions) - origin
    axes[-1].set_xlim(-0.2, last + 0.5)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return path
