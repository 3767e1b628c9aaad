"""The pendant application of `openpendant demo`: a short tour of the public protocol.

Takes control, runs the tour of `demo_tour`, and shows a live table all the while. It knows the
robot only by what the server tells.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import signal
import sys
from collections.abc import AsyncIterator, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from openpendant.simplemsg.pendant import Activity, State, StateField
from openpendant.simplemsg.pendant.management.cell import JointFacts

from ..console import cells
from .client import PendantClient, PendantError
from .demo_tour import Tour, TourReport
from .motions import roll_pitch_yaw

_READY_TIMEOUT = 20.0
_MODES = {1: "manual", 2: "automatic"}


def live_table(state: State | None, joints: Sequence[JointFacts], doing: str) -> Table:
    """Return the table of the newest state: degrees, millimetres, mode and speed."""
    table = Table(title=Text(doing), title_justify="left", min_width=64)
    for heading in ("joint", "position", "velocity"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    if state is None:
        return table
    for index, joint in enumerate(joints):
        scale, unit = (180 / math.pi, "°") if joint["unit"] == "rad" else (1000.0, " mm")
        table.add_row(
            *cells(joint.get("display_name") or joint["name"]),
            f"{state.positions[index] * scale:z9.2f}{unit}",
            f"{state.velocities[index] * scale:z9.2f}{unit}/s",
        )
    table.add_section()
    x, y, z = (1000 * value for value in state.tool_position)
    table.add_row("tool x, y, z", f"{x:z8.1f} {y:z8.1f} {z:z8.1f} mm", "")
    roll, pitch, yaw = map(math.degrees, roll_pitch_yaw(state.tool_orientation))
    table.add_row(
        "roll, pitch, yaw",
        f"{roll:z8.1f} {pitch:z8.1f} {yaw:z8.1f} °",
        f"{1000 * state.tool_speed:7.1f} mm/s",
    )
    mode = _MODES.get(state.mode, "unknown")
    # The server may be newer than this pendant: an activity without a name must not end the tour.
    activity = state.activity
    activity_name = Activity(activity).name.lower() if activity in set(Activity) else "unknown"
    table.add_row("mode", mode, activity_name)
    return table


class LiveTour:
    """A tour with a table of the robot's state beside it."""

    def __init__(self, pendant: PendantClient, console: Console) -> None:
        self._pendant = pendant
        self._console = console
        self._tour: Tour | None = None
        self._joints: list[JointFacts] = []

    async def run(self) -> TourReport:
        """Run the whole tour.

        Raises:
            PendantError: a move was refused or aborted, or the connection ended.
        """
        pendant = self._pendant
        self._joints = (await pendant.snapshot())["joints"]
        self._tour = tour = Tour(pendant, self._joints, pendant.hello.robot)
        await pendant.wait_until(
            lambda state: bool(state.valid_fields & StateField.TOOL) and state.motion_possible == 1,
            within=_READY_TIMEOUT,
        )
        async with self._shown(), pendant.control():
            await tour.run()
        for what in tour.report.left_out:
            self._console.print(*cells(f"left out: {what}"))
        return tour.report

    @contextlib.asynccontextmanager
    async def _shown(self) -> AsyncIterator[None]:
        """Show the table live on a terminal, and now and then elsewhere."""
        if self._console.is_terminal:
            with Live(console=self._console, refresh_per_second=10) as live:
                self._pendant.on_state = lambda state: live.update(self._table(state))
                yield
            return
        printer = asyncio.get_running_loop().create_task(self._print_now_and_then())
        try:
            yield
        finally:
            printer.cancel()

    async def _print_now_and_then(self) -> None:
        while True:
            self._console.print(self._table(self._pendant.state))
            await asyncio.sleep(3.0)

    def _table(self, state: State | None) -> Table:
        return live_table(state, self._joints, self._tour.doing if self._tour else "")


@contextlib.contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Unwind the tour on SIGTERM, which gives the terminal its cursor back; ignore any more."""
    task = asyncio.current_task()
    assert task is not None
    with contextlib.suppress(NotImplementedError):  # Windows
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    try:
        yield
    finally:
        # A loop that closes takes its handlers back only after it closed what they write to.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


async def _run(port: int) -> TourReport:
    console = Console()
    with _ended_by_sigterm():
        async with await PendantClient.connect(
            "127.0.0.1", port, client="demo pendant", state_rate=50
        ) as pendant:
            return await LiveTour(pendant, console).run()


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
