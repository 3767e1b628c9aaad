import asyncio
import contextlib
import math
import os
import re
import socket
import sys
import termios
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE, SCALE, tell_begun_anew

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import PendantClient, Refused

pytestmark = pytest.mark.realtime

CTRL_Q = "\x11"
STEP = math.radians(0.5)
MOST_STRIKES = 60

_WITHOUT_SIZE = {name: os.environ[name] for name in os.environ if name not in ("COLUMNS", "LINES")}
"""Whoever runs the tests may have said how large a terminal is, and of another than this one."""

_ESCAPES = re.compile(r"\x1b(\[[0-9;?>$]*[a-zA-Z]|\][^\x07]*\x07|[=>])")


class Terminal:
    def __init__(self, process: asyncio.subprocess.Process, end: int) -> None:
        self.process = process
        self._end = end
        self._is_closed = False
        self._output = b""
        self._grown = asyncio.Event()

    def read(self) -> None:
        with contextlib.suppress(OSError):  # the other end has closed
            self._output += os.read(self._end, 65_536)
        self._grown.set()

    def hang_up(self) -> None:
        if not self._is_closed:
            self._is_closed = True
            asyncio.get_running_loop().remove_reader(self._end)
            os.close(self._end)

    def strike(self, keys: str) -> None:
        os.write(self._end, keys.encode())

    @property
    def text(self) -> str:
        return _ESCAPES.sub("", self._output.decode("utf-8", "replace"))

    async def shows(self, text: str) -> None:
        try:
            async with asyncio.timeout(PATIENCE):
                while text not in self.text:
                    self._grown.clear()
                    await self._grown.wait()
        except TimeoutError:
            pytest.fail(f"{text!r} was not shown, exit code {self.process.returncode}: {self.text}")


@asynccontextmanager
async def terminal(port: int) -> AsyncIterator[Terminal]:
    ours, theirs = os.openpty()
    termios.tcsetwinsize(theirs, (45, 130))
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools", "pendant", f"127.0.0.1:{port}"),
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**_WITHOUT_SIZE, "TERM": "xterm-256color"},
        start_new_session=True,
    )
    os.close(theirs)
    made = Terminal(process, ours)
    asyncio.get_running_loop().add_reader(ours, made.read)
    try:
        yield made
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
        made.hang_up()


@asynccontextmanager
async def nobody() -> AsyncIterator[int]:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield taken.getsockname()[1]


async def until(pendant: PendantClient, holds: Callable[[Any], bool]) -> None:
    await pendant.wait_until(holds, within=PATIENCE)


def stamp(state: messages.State) -> int:
    """Return when the server sent a state, by the machine's monotonic clock [ns]."""
    return state.time_s * 1_000_000_000 + state.time_ns


async def enable(shown: Terminal, observer: PendantClient) -> None:
    assert observer.state is not None
    if observer.state.enabling != messages.EnablingPosition.HELD:
        shown.strike("v")
        await until(observer, lambda s: s.enabling == messages.EnablingPosition.HELD)


async def jog_until_moved(shown: Terminal, observer: PendantClient, by: float) -> int:
    """Strike the key of joint 1 as a held key does, until the joint has moved so far [rad].

    Returns:
        When the key was struck last, by the clock of the server's stamps [ns].
    """
    start, struck = observer.joints()[0], 0
    for _ in range(MOST_STRIKES):
        await enable(shown, observer)
        shown.strike("q")
        struck = time.monotonic_ns()
        await asyncio.sleep(0.033)
        if observer.joints()[0] >= start + by:
            return struck
    raise AssertionError(f"{MOST_STRIKES} strikes moved joint 1 by {observer.joints()[0] - start}")


async def step_two_joints(shown: Terminal, observer: PendantClient) -> None:
    """Step joint 1 up and joint 2 down."""
    start = observer.joints()
    await enable(shown, observer)
    shown.strike("qs")
    await until(observer, lambda s: abs(s.positions[0] - start[0]) > STEP / 2)
    await until(observer, lambda s: s.activity == messages.Activity.IDLE and s.in_motion == 0)


@pytest_asyncio.fixture
async def attended(
    start_cell: Any, tmp_path: Path
) -> AsyncIterator[tuple[Terminal, PendantClient]]:
    """A terminal pendant that is connected, and an observer of its cell."""
    cell = await start_cell(server=("--store", str(tmp_path / "store.db")))
    observer = await cell.ready_pendant(client="observer")
    async with terminal(cell.ports["pendant"]) as shown:
        await shown.shows("pendant–server: up")
        yield shown, observer
    assert (await cell.end())["violations"] == 0


async def test_it_jogs_records_stops_and_is_left(
    attended: tuple[Terminal, PendantClient],
) -> None:
    shown, observer = attended
    before = observer.joints()
    shown.strike("cm1")
    await until(observer, lambda s: s.operating_mode == messages.OperatingMode.MANUAL_REDUCED)
    assert observer.state is not None
    assert observer.state.holder != 0
    await step_two_joints(shown, observer)
    first, second, *others = observer.joints()
    assert before[0] < first <= before[0] + STEP + 1e-4
    assert before[1] > second >= before[1] - STEP - 1e-4
    assert others == pytest.approx(before[2:], abs=1e-4)

    shown.strike("npick\r")
    await shown.shows("Create pick?")
    shown.strike("1")
    await shown.shows("pick, revision 1")
    shown.strike("1")
    await shown.shows("pick, revision 2")
    program = await observer.manage({"op": "programs.load", "name": "pick"})
    assert "move PTP P1" in program["body"]

    shown.strike(" ")
    await until(observer, lambda s: s.stop == messages.StopKind.SOFTWARE)
    await shown.shows("software stop by terminal: space bar")
    await until(observer, lambda s: s.enabling == messages.EnablingPosition.RELEASED)

    shown.strike(CTRL_Q)
    assert await asyncio.wait_for(shown.process.wait(), PATIENCE) == 0
    await until(observer, lambda s: s.holder == 0)


DOWN, ENTER = "\x1b[B", "\r"


async def until_it_stands(observer: PendantClient) -> None:
    await until(observer, lambda s: s.activity == messages.Activity.IDLE and s.in_motion == 0)


async def test_a_position_is_taught_left_and_gone_back_to_by_a_plan_as_it_was_shown(
    attended: tuple[Terminal, PendantClient],
) -> None:
    shown, observer = attended
    shown.strike("M8")
    await shown.shows("new: type its name")
    shown.strike(f"{ENTER}here{ENTER}")
    await shown.shows("position here is where the robot stands")
    taught = observer.joints()
    shown.strike("c")
    await until(observer, lambda s: s.holder != 0)
    shown.strike(f"=1=5{ENTER}")
    await until(observer, lambda s: s.positions[0] > taught[0] + math.radians(4.9))
    await until_it_stands(observer)

    shown.strike("M8")
    await shown.shows("   here ")
    rows = [each["name"] for each in (await observer.positions.list())["positions"]]
    shown.strike(DOWN * (1 + rows.index("here")) + ENTER)
    await shown.shows("2 plan")
    shown.strike("2")
    await shown.shows("plan 1 to here: ")
    shown.strike(ENTER + ENTER)
    await shown.shows("Execute plan 1?")
    shown.strike("1")
    await shown.shows("plan 1 ended")
    assert observer.joints() == pytest.approx(taught, abs=1e-3)


async def test_a_held_key_moves_and_silence_ends_it_within_the_deadline(start_cell: Any) -> None:
    cell = await start_cell(server=("--store", "off"))
    observer = await cell.ready_pendant(client="observer")
    async with terminal(cell.ports["pendant"]) as shown:
        await shown.shows("pendant–server: up")
        shown.strike("cm1")
        await until(observer, lambda s: s.operating_mode == messages.OperatingMode.MANUAL_REDUCED)
        shown.strike("/")
        seen: list[messages.State] = []
        observer.on_state = seen.append
        struck = await jog_until_moved(shown, observer, 0.1)
        await until(observer, lambda s: stamp(s) > struck and s.activity == messages.Activity.IDLE)
        began = next(stamp(state) for state in seen if state.activity != messages.Activity.IDLE)
        idle = [stamp(state) for state in seen if state.activity == messages.Activity.IDLE]
        if any(began < each < struck for each in idle):
            tell_begun_anew("the jog of a held key had broken off")
        # The deadline of 0.25 s, the ramp, and what a busy machine adds to both.
        assert next(each for each in idle if each > struck) - struck < 1.0e9 * SCALE
        with pytest.raises(Refused) as refused:
            await observer.take_control()
        assert refused.value.code == V.HELD_BY_OTHER
    assert (await cell.end())["violations"] == 0


async def test_a_terminal_that_is_gone_ends_the_pendant_which_gives_its_control_back(
    start_cell: Any,
) -> None:
    """The terminal is not its controlling one, so that no SIGHUP comes from the kernel."""
    cell = await start_cell(server=("--store", "off"))
    observer = await cell.ready_pendant(client="observer")
    async with terminal(cell.ports["pendant"]) as shown:
        await shown.shows("pendant–server: up")
        shown.strike("c")
        await until(observer, lambda s: s.holder != 0)
        told: list[messages.AuthorityChanged] = []
        observer.on_authority = told.append
        shown.hang_up()
        await asyncio.wait_for(shown.process.wait(), 5.0 * SCALE)
        await until(observer, lambda s: bool(told) and s.holder == 0)
        # By its end, and not because its beats were missed for three seconds.
        (change,) = told
        assert change.reason in (
            messages.AuthorityReason.RELEASED,
            messages.AuthorityReason.CONNECTION_LOST,
        )
        await observer.take_control()
    assert (await cell.end())["violations"] == 0


async def test_leaving_with_a_stop_that_nobody_heard_says_what_to_do() -> None:
    async with nobody() as port, terminal(port) as shown:
        await shown.shows("nobody listens")
        shown.strike(" ")
        await shown.shows("STOP NOT CONFIRMED")
        shown.strike(CTRL_Q)
        assert await asyncio.wait_for(shown.process.wait(), PATIENCE) != 0
        await shown.shows("left before its stop was confirmed: use the robot's own hardware stop")
