"""A gamepad as it is used: a pipe, `openpendant gamepad`, the server and an emulated robot."""

import asyncio
import signal
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENCE, SCALE
from rigs.data.device_bytes import (
    ENABLING,
    LEFT_KEY,
    LEFT_Y,
    REL,
    RIGHT_X,
    STOP,
    axis,
    button,
    opening,
    report,
)
from rigs.data.device_bytes import KEY as KEYS
from rigs.peers.plugged_device import PluggedDevice

from openpendant.simplemsg.pendant import OperatingMode, State, StopKind
from openpendant.tools.pendants.client import PendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

DEADLINE = 0.15
TICK = 0.01


class Hand:
    """A hand at a gamepad: its thumbs push sticks forward and tremble."""

    def __init__(self, *sticks: int) -> None:
        self.sticks = sticks

    def press(self) -> bytes:
        return button(ENABLING, down=True)

    def push(self, step: int) -> bytes:
        return b"".join(axis(each, -1.0 + 0.001 * (step % 2)) for each in self.sticks)

    def let_go(self) -> bytes:
        centred = (axis(each, 0.0) for each in self.sticks)
        return b"".join((*centred, button(ENABLING, down=False)))


class HandAtCap(Hand):
    """A hand at a SpaceMouse, which pushes its cap down."""

    def press(self) -> bytes:
        return report((KEYS, LEFT_KEY, 1))

    def push(self, step: int) -> bytes:
        return report((REL, 2, 350 - step % 2))

    def let_go(self) -> bytes:
        return report((KEYS, LEFT_KEY, 0))


class GamepadProcess:
    """`openpendant gamepad` at one end of a pipe, and the hand at the other."""

    def __init__(
        self, process: asyncio.subprocess.Process, plug: PluggedDevice, hand: Hand
    ) -> None:
        self.process = process
        self.hand = hand
        self.plug = plug
        self.text = ""

    async def says(self, words: str) -> None:
        """Read its lines until one holds some words."""
        assert self.process.stdout is not None
        async with asyncio.timeout(PATIENCE):
            while True:
                line = (await self.process.stdout.readline()).decode()
                assert line, f"{words!r} was not said: {self.text}"
                self.text += line
                if words in line:
                    return

    async def control(self, observer: PendantClient) -> None:
        """Press the button until that has asked for control, and let it go."""
        async with asyncio.timeout(PATIENCE):
            while observer.state is None or observer.state.holder == 0:
                self.plug.write(self.hand.press())
                await asyncio.sleep(0.1)
                self.plug.write(self.hand.let_go())
                await observer.next_state()
        await asyncio.sleep(0.2)  # until its own state says so

    async def push_until(self, observer: PendantClient, holds: Callable[[State], bool]) -> None:
        """Hold the button and push until the robot is in a state.

        On a busy machine a press can fall silent; then it is pressed anew, as a person would.
        """
        async with asyncio.timeout(PATIENCE):
            while True:
                self.plug.write(self.hand.let_go())
                await asyncio.sleep(0.05)
                self.plug.write(self.hand.press())
                for step in range(50):
                    self.plug.write(self.hand.push(step))
                    if holds(await observer.next_state()):
                        return
                    await asyncio.sleep(0.02)

    async def end(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return await asyncio.wait_for(self.process.wait(), PATIENCE)


@asynccontextmanager
async def gamepad(cell: Any, device: Path, hand: Hand) -> AsyncIterator[GamepadProcess]:
    plug = PluggedDevice(device)
    plug.plug()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools", "gamepad", "--device", str(device)),
        *("--server", f"127.0.0.1:{cell.ports['pendant']}"),
        stdout=asyncio.subprocess.PIPE,
    )
    made = GamepadProcess(process, plug, hand)
    try:
        await made.says("connected to")
        yield made
    finally:
        plug.pull()
        if process.returncode is None:
            process.kill()
            await process.wait()


async def ready(cell: Any) -> PendantClient:
    """Return an observer of the cell, which is in manual mode and in nobody's control."""
    observer: PendantClient = await cell.ready_pendant()
    async with observer.control():
        await observer.reset_stop()
        await observer.set_mode(OperatingMode.MANUAL_REDUCED)
    await observer.wait_until(lambda state: state.holder == 0)
    return observer


def moves(state: State) -> bool:
    return max(map(abs, state.velocities)) > 0.02


async def stands(observer: PendantClient, seconds: float) -> None:
    """See that the robot stands where it is for so long."""
    await observer.next_state()
    before = observer.joints()
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        assert not moves(await observer.next_state())
    assert observer.joints() == pytest.approx(before, abs=1e-6)


async def test_a_gamepad_jogs_in_a_line_until_it_is_unplugged_and_not_again_by_itself(
    shared_cell: Any, tmp_path: Path
) -> None:
    observer = await ready(shared_cell)
    async with gamepad(shared_cell, tmp_path / "js0", Hand(LEFT_Y)) as pad:
        pad.plug.write(opening())
        await pad.control(observer)
        begun = observer.tool_pose()
        x, y, z = begun.position
        await pad.push_until(observer, lambda state: state.tool_position[0] > x + 0.02)
        assert observer.state is not None
        assert observer.tool_pose().position[1:] == pytest.approx((y, z), abs=2e-3)

        pulled = time.monotonic()
        pad.plug.pull()
        await observer.wait_until(lambda state: state.in_motion == 0)
        assert observer.ramp_time is not None
        assert time.monotonic() - pulled < DEADLINE + TICK + observer.ramp_time + 0.5 * SCALE
        await pad.says("unplugged; what it held was released")

        pad.plug.plug()
        await pad.says("reading")
        pad.plug.write(opening(down=frozenset({ENABLING}), a1=-1.0))
        await stands(observer, 0.5)
        pad.plug.write(axis(LEFT_Y, -0.9))
        await stands(observer, 0.3)
        assert await pad.end() == 0


@pytest.mark.conformance
async def test_two_sticks_move_until_the_program_stands_still_or_the_stop_button_is_pressed(
    shared_cell: Any, tmp_path: Path
) -> None:
    observer = await ready(shared_cell)
    async with gamepad(shared_cell, tmp_path / "js0", Hand(LEFT_Y, RIGHT_X)) as pad:
        pad.plug.write(opening())
        await pad.control(observer)
        before = observer.tool_pose()

        def is_moved_and_turned(state: State) -> bool:
            turned = abs(state.tool_orientation[0] - before.orientation[0])
            return state.tool_position[0] > before.position[0] + 0.01 and turned > 0.01

        await pad.push_until(observer, is_moved_and_turned)
        pad.process.send_signal(signal.SIGSTOP)
        try:
            await observer.wait_until(lambda state: state.in_motion == 0)
        finally:
            pad.process.send_signal(signal.SIGCONT)
        pad.plug.write(pad.hand.push(0))
        await stands(observer, 0.3)

        await pad.push_until(observer, moves)
        pad.plug.write(button(STOP, down=True))
        await observer.wait_until(lambda state: state.stop == StopKind.SOFTWARE)
        await observer.wait_until(lambda state: state.in_motion == 0)
        pad.plug.write(axis(LEFT_Y, -0.8) + button(STOP, down=False))
        await stands(observer, 0.3)
        assert await pad.end() == 0


@pytest.mark.conformance
async def test_a_spacemouse_jogs_while_its_cap_is_pushed(shared_cell: Any, tmp_path: Path) -> None:
    observer = await ready(shared_cell)
    async with gamepad(shared_cell, tmp_path / "event7", HandAtCap()) as pad:
        await pad.control(observer)
        z = observer.tool_pose().position[2]
        await pad.push_until(observer, lambda state: state.tool_position[2] < z - 0.01)
        await observer.wait_until(lambda state: state.in_motion == 0)
        assert await pad.end() == 0
