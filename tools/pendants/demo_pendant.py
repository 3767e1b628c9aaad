"""The pendant application of `openpendant demo`: a short tour of the public protocol.

Takes control, moves single joints, moves the tool along a straight line, runs a path of taught
poses, and shows a live table all the while. It knows the robot only by what the server tells.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import signal
import sys
from collections.abc import AsyncIterator, Awaitable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table

from openpendant.simplemsg.pendant import Activity, Motion, State, StateField
from openpendant.simplemsg.verdicts import VerdictCode

from .attitude import roll_pitch_yaw
from .client import MotionHandle, PendantClient, PendantError, Pose, Refused
from .snapshot import JointFacts

JOINT_STEP = math.radians(12)
LINE_LENGTH = 0.08
CIRCLE_RADIUS = 0.05
TAUGHT_POSES = 8
SPEED = 0.3

_READY_TIMEOUT = 20.0
_MODES = {1: "manual", 2: "automatic"}

_NO_SUCH_LINE = (VerdictCode.UNREACHABLE, VerdictCode.BRANCH_CHANGE)
_NEEDS_A_LINE = "the tour needs a robot that can move its tool along a straight line"


@dataclass
class TourReport:
    """What the tour did.

    Attributes:
        robot: name of the robot.
        motions: name, plan time [s] and motion time [s] of each motion.
        poses: poses of the taught path.
    """

    robot: str = ""
    motions: list[dict[str, Any]] = field(default_factory=list)
    poses: int = 0


def live_table(state: State | None, names: list[str], units: list[str], doing: str) -> Table:
    """Return the table of the newest state: degrees, millimetres, mode and speed."""
    table = Table(title=doing, title_justify="left", min_width=64)
    for heading in ("joint", "position", "velocity"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    if state is None:
        return table
    for index, name in enumerate(names):
        scale, unit = (180 / math.pi, "°") if units[index] == "rad" else (1000.0, " mm")
        table.add_row(
            name,
            f"{state.positions[index] * scale:9.2f}{unit}",
            f"{state.velocities[index] * scale:9.2f}{unit}/s",
        )
    table.add_section()
    x, y, z = (1000 * value for value in state.tool_position)
    table.add_row("tool x, y, z", f"{x:8.1f} {y:8.1f} {z:8.1f} mm", "")
    roll, pitch, yaw = map(math.degrees, roll_pitch_yaw(state.tool_orientation))
    table.add_row(
        "roll, pitch, yaw",
        f"{roll:8.1f} {pitch:8.1f} {yaw:8.1f} °",
        f"{1000 * state.tool_speed:7.1f} mm/s",
    )
    mode = _MODES.get(state.mode, "unknown")
    table.add_row("mode", mode, Activity(state.activity).name.lower())
    return table


class Tour:
    """The moves of the demonstration."""

    def __init__(self, pendant: PendantClient, console: Console) -> None:
        """Make a tour with a connected pendant."""
        self._pendant = pendant
        self._console = console
        self._names: list[str] = []
        self._units: list[str] = []
        self._limits: list[JointFacts] = []
        self._doing = "connecting"
        self.report = TourReport(robot=pendant.hello.robot)

    async def run(self) -> None:
        """Run the whole tour.

        Raises:
            PendantError: a move was refused or aborted, or the connection ended.
        """
        pendant = self._pendant
        snapshot = await pendant.snapshot()
        self._limits = snapshot["joints"]
        self._names = [joint["name"] for joint in self._limits]
        self._units = [joint["unit"] for joint in self._limits]
        await pendant.wait_until(
            lambda state: bool(state.valid_fields & StateField.TOOL) and state.motion_possible == 1,
            within=_READY_TIMEOUT,
        )
        async with self._table(), pendant.control():
            await self._single_joints()
            await self._straight_line()
            await self._taught_path()
        self._doing = "done"

    @contextlib.asynccontextmanager
    async def _table(self) -> AsyncIterator[None]:
        """Show the table live on a terminal, and now and then elsewhere."""
        if self._console.is_terminal:
            with Live(console=self._console, refresh_per_second=10) as live:
                self._pendant.on_state = lambda state: live.update(
                    live_table(state, self._names, self._units, self._doing)
                )
                yield
            return
        printer = asyncio.get_running_loop().create_task(self._print_now_and_then())
        try:
            yield
        finally:
            printer.cancel()

    async def _print_now_and_then(self) -> None:
        while True:
            self._console.print(
                live_table(self._pendant.state, self._names, self._units, self._doing)
            )
            await asyncio.sleep(3.0)

    async def _do(self, name: str, start: Awaitable[MotionHandle]) -> None:
        self._doing = name
        result = await (await start).done()
        self.report.motions.append(
            {"name": name, "plan_time": result.plan_time, "motion_time": result.motion_time}
        )

    async def _single_joints(self) -> None:
        """Move each joint away and back, the way with more room first."""
        home = self._pendant.joints()
        for index, joint in enumerate(self._limits):
            room_above = joint["upper"] - home[index]
            span = JOINT_STEP if joint["unit"] == "rad" else 0.05
            step = min(span, 0.4 * (joint["upper"] - joint["lower"]))
            if room_above < step:
                step = -step
            target = [*home[:index], home[index] + step, *home[index + 1 :]]
            label = f"joint {joint['name']}"
            await self._do(label, self._pendant.move_joints(target, speed=SPEED))
        await self._do("back", self._pendant.move_joints(home, speed=SPEED))

    async def _straight_line(self) -> None:
        """Move the tool along the first straight line that the robot can do, and back."""
        start = self._pendant.tool_pose()
        for axis in ((0, 0, -1), (0, 0, 1), (0, 1, 0), (-1, 0, 0), (1, 0, 0), (0, -1, 0)):
            goal = _shifted(start, *(LINE_LENGTH * part for part in axis))
            try:
                await self._do(
                    "straight line",
                    self._pendant.move_to_pose(goal, motion=Motion.LIN, speed=SPEED),
                )
            except Refused as error:
                if error.code not in _NO_SUCH_LINE:
                    raise
                continue
            await self._do(
                "straight line back",
                self._pendant.move_to_pose(start, motion=Motion.LIN, speed=SPEED),
            )
            return
        raise PendantError(_NEEDS_A_LINE)

    async def _taught_path(self) -> None:
        """Run through poses on a circle round where the tool is, without stopping."""
        centre = self._pendant.tool_pose()
        poses = []
        for number in range(1, TAUGHT_POSES + 1):
            angle = 2 * math.pi * number / TAUGHT_POSES
            poses.append(
                _shifted(
                    centre,
                    0.0,
                    CIRCLE_RADIUS * math.sin(angle),
                    CIRCLE_RADIUS * (math.cos(angle) - 1),
                )
            )
        self.report.poses = len(poses)
        try:
            await self._do(
                f"path of {len(poses)} taught poses",
                self._pendant.follow_poses(poses, speed=SPEED),
            )
        except Refused as error:
            # Some robots can do one line, in the plane of their arm, but not those of the circle.
            if error.code in _NO_SUCH_LINE:
                raise PendantError(_NEEDS_A_LINE) from error
            raise


def _shifted(pose: Pose, x: float, y: float, z: float) -> Pose:
    px, py, pz = pose.position
    return Pose((px + x, py + y, pz + z), pose.orientation, pose.frame)


def _end_on_sigterm() -> None:
    """Unwind the tour on SIGTERM, which gives the terminal its cursor back."""
    task = asyncio.current_task()
    assert task is not None
    with contextlib.suppress(NotImplementedError):  # Windows
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)


async def _run(port: int) -> TourReport:
    _end_on_sigterm()
    console = Console()
    async with await PendantClient.connect(
        "127.0.0.1", port, client="demo pendant", state_rate=50
    ) as pendant:
        tour = Tour(pendant, console)
        await tour.run()
        return tour.report


def main(argv: list[str]) -> int:
    """Run the tour against a server on this machine; return 0 when every move arrived."""
    parser = argparse.ArgumentParser(prog="demo_pendant", description=__doc__)
    parser.add_argument("--port", type=int, required=True, help="the server's pendant port")
    parser.add_argument("--report", type=Path, help="write what was done as JSON")
    arguments = parser.parse_args(argv)
    try:
        report = asyncio.run(_run(arguments.port))
        if arguments.report is not None:
            arguments.report.write_text(json.dumps(asdict(report), indent=1), encoding="utf-8")
    except (PendantError, OSError, TimeoutError) as error:
        print(f"demo pendant: {error or type(error).__name__}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    except asyncio.CancelledError:
        return 128 + signal.SIGTERM
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
