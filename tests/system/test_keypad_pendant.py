"""Keypad, bridge, server and controller as processes, the keypad on a pseudo-terminal."""

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE
from rigs.firmware.firmware_process import firmware_keypad
from rigs.firmware.simulated_board import Firmware, compiled_board, skip_without_tools
from rigs.processes.keypad_processes import (
    BridgeProcess,
    KeypadProcess,
    bridge,
    emulated_keypad,
)

from openpendant.simplemsg import pendant as messages
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.motions import roll_pitch_yaw

pytestmark = pytest.mark.realtime

SETTINGS = 'modes.initial = "manual_reduced"\njog.lead = 0.1\ncontroller.lead = 0.25\n'
EMULATED = ("--signals", "openpendant", "--emulated")


emulated_only = pytest.mark.parametrize("some_keypad", ["emulated"], indirect=True)


@dataclass
class Bench:
    """A keypad that is ready, in front of a cell, and somebody who looks on."""

    keypad: KeypadProcess
    bridge: BridgeProcess
    observer: PendantClient
    cell: Any

    async def until(self, holds: Callable[[messages.State], bool]) -> messages.State:
        return await self.observer.wait_until(holds, within=PATIENCE)

    async def stands(self) -> messages.State:
        return await self.until(lambda s: s.activity == messages.Activity.IDLE and s.in_motion == 0)

    async def take_control(self) -> None:
        await self.keypad.down("1")
        await self.keypad.shows("CONTROL: YOURS      ")
        await self.keypad.up()
        await self.keypad.shows("T1 JOINT      * en--")

    async def held_until(
        self, labels: str, holds: Callable[[messages.State], bool]
    ) -> messages.State:
        """Hold keys until something holds, let go, and return the state at rest."""
        await self.keypad.down(*labels)
        await self.until(holds)
        await self.keypad.up()
        await self.until(lambda s: s.enabling == messages.EnablingPosition.RELEASED)
        return await self.stands()


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Firmware]:
    """The simulated board and the firmware."""
    skip_without_tools()
    folder = tmp_path_factory.mktemp("firmware")
    return compiled_board(folder), Firmware.compiled(folder / "build")


@pytest.fixture(params=["emulated", pytest.param("firmware", marks=pytest.mark.firmware)])
def some_keypad(
    request: pytest.FixtureRequest, tmp_path: Path
) -> AbstractAsyncContextManager[KeypadProcess]:
    """An emulated keypad, or the compiled firmware on a simulated board."""
    if request.param == "emulated":
        return emulated_keypad(link=tmp_path / "keypad")
    board, firmware = request.getfixturevalue("compiled")
    return firmware_keypad(board, firmware, tmp_path / "keypad")


@pytest_asyncio.fixture
async def bench(
    start_cell: Any, some_keypad: AbstractAsyncContextManager[KeypadProcess]
) -> AsyncIterator[Bench]:
    cell = await start_cell(settings=SETTINGS, server=EMULATED, has_store=True)
    observer = await cell.ready_pendant(client="observer")
    async with (
        some_keypad as keypad,
        bridge(keypad.port, cell.ports["pendant"]) as serving,
    ):
        await serving.says("keypad: ready (firmware 1.0)")
        await keypad.shows("T1 JOINT      o en--")
        yield Bench(keypad, serving, observer, cell)
    await cell.end()


def joint_rows(positions: tuple[float, ...]) -> list[str]:
    """Return the rows of six joints, worked out apart from the product."""
    texts = [f"{i + 1}:{math.degrees(q):z7.2f} " for i, q in enumerate(positions[:6])]
    return [texts[i] + texts[i + 1] for i in (0, 2, 4)]


def pose_rows(state: messages.State) -> list[str]:
    angles = [math.degrees(each) for each in roll_pitch_yaw(state.tool_orientation)]
    return [
        f"{name}{1000 * at:z8.1f} {turn}{angle:z8.1f} "
        for name, at, turn, angle in zip("XYZ", state.tool_position, "ABC", angles, strict=True)
    ]


async def test_it_jogs_changes_speed_and_frame_records_and_plays_by_what_its_display_says(
    bench: Bench,
) -> None:
    keypad = bench.keypad
    await bench.take_control()

    # One joint, then two at once.
    start = (await bench.stands()).positions
    state = await bench.held_until("1", lambda s: s.positions[0] > start[0] + 0.05)
    assert state.positions[1:6] == pytest.approx(start[1:6], abs=1e-4)
    await keypad.shows("T1 JOINT      * en--", *joint_rows(state.positions))
    first = state.positions
    state = await bench.held_until(
        "1#", lambda s: s.positions[0] > first[0] + 0.04 and s.positions[5] < first[5] - 0.02
    )
    assert state.positions[1:5] == pytest.approx(first[1:5], abs=1e-4)

    # Speed.
    before = (await bench.stands()).override
    await keypad.strike("B")
    state = await bench.until(lambda s: s.override < before)
    await keypad.shows(
        "T1 JOINT      * en--",
        f"Override{100 * state.override:>10.0f} %",
        "Tool cap    250 mm/s",
        "Tool now      0 mm/s",
    )
    await keypad.strike("A")
    await bench.until(lambda s: s.override == pytest.approx(before))

    # Cartesian: straight up, and nothing else.
    await keypad.strike("C")
    await keypad.shows("T1 BASE       * en--")
    low = await bench.stands()
    state = await bench.held_until("3", lambda s: s.tool_position[2] > low.tool_position[2] + 0.01)
    assert state.tool_position[:2] == pytest.approx(low.tool_position[:2], abs=5e-4)
    await keypad.shows("T1 BASE       * en--", *pose_rows(state))

    # A recording.
    await keypad.strike("C", held=1.0)
    await keypad.shows(
        "REC    PLAY   UP    ",
        "TEACH  UNDO   DOWN  ",
        "HOME   RUN    PAGE  ",
        "CTRL   PAUSE  T1/T2 ",
    )
    await keypad.strike("1")
    await keypad.shows("no recordings       ", " " * 20, " " * 20, "REC: new            ")
    await keypad.strike("1")
    await keypad.meets(
        lambda lcd: (
            lcd[0].startswith("REC 00:")
            and lcd[0].endswith(" pts")
            and lcd[1:] == ["keypad-1            ", "MODE: jog on        ", "REC: end and keep   "]
        )
    )
    await keypad.strike("C")
    await keypad.shows("T1 BASE     R * en--")
    recorded = await bench.stands()
    moved = await bench.held_until(
        "3", lambda s: s.tool_position[2] > recorded.tool_position[2] + 0.01
    )
    await keypad.strike("C", held=1.0)
    await keypad.meets(lambda lcd: lcd[0].startswith("REC 00:"))
    await keypad.strike("1")
    lcd = await keypad.meets(lambda lcd: lcd[0].startswith(">keypad-1    00:"))
    assert lcd[1:] == [" " * 20, " " * 20, "hold PLAY; REC: new "]

    # It is played while its key is held, from where it began to where it ended.
    await keypad.down("2")
    await keypad.meets(
        lambda lcd: (
            lcd[0].startswith("PLAY keypad-1 ")
            and " of 00:" in lcd[1]
            and lcd[2] == "let go: stops       "
        )
    )
    await bench.until(lambda s: s.tool_position[2] < recorded.tool_position[2] + 0.004)
    await keypad.meets(lambda lcd: lcd[2] == "ended               ")
    await keypad.up()
    state = await bench.stands()
    assert state.positions[:6] == pytest.approx(moved.positions[:6], abs=2e-3)


@emulated_only
async def test_a_played_motion_ends_where_its_key_is_let_go(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
    home = (await bench.stands()).positions
    await bench.held_until("1", lambda s: s.positions[0] > home[0] + 0.3)
    await keypad.strike("C", held=1.0)
    await keypad.down("7")
    await keypad.shows("HOME           100 %", "let go: stops       ")
    await bench.until(lambda s: s.activity == messages.Activity.MOVING)
    await keypad.up()
    state = await bench.stands()
    assert state.positions[0] > home[0] + 0.02
    assert state.stop == messages.StopKind.NONE


async def test_a_pulled_cable_lets_go_and_after_it_a_key_must_have_been_up(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
    start = (await bench.stands()).positions
    await keypad.down("1")
    await bench.until(lambda s: s.positions[0] > start[0] + 0.03)
    await keypad.order("pull")
    stood = await bench.stands()
    assert stood.stop == messages.StopKind.NONE
    await bench.bridge.says("unplugged; what it held was released")
    await bench.bridge.says("no such port")
    await keypad.order("plug")
    await keypad.shows("LET GO OF ALL KEYS  ", "then press again    ")
    await asyncio.sleep(0.5)
    state = await bench.stands()
    assert state.positions[:6] == pytest.approx(stood.positions[:6], abs=1e-4)
    await keypad.up()
    await keypad.shows("T1 JOINT      * en--")
    await bench.held_until("1", lambda s: s.positions[0] > stood.positions[0] + 0.03)


async def test_stop_latches_and_mode_resets_it(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
    start = (await bench.stands()).positions
    await keypad.down("1")
    await bench.until(lambda s: s.positions[0] > start[0] + 0.02)
    await keypad.down("D")
    await bench.until(lambda s: s.stop == messages.StopKind.SOFTWARE)
    await keypad.up()
    await keypad.shows(
        "STOP keypad         ", "STOP key            ", " " * 20, "MODE 2 s: reset     "
    )
    await bench.stands()
    await keypad.strike("C", held=2.3)
    await bench.until(lambda s: s.stop == messages.StopKind.NONE)
    await keypad.shows("T1 JOINT      * en--")


@emulated_only
async def test_a_refusal_stands_on_the_display_in_its_words(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.observer.take_control()
    await keypad.strike("1")
    await keypad.shows(
        "! HELD_BY_OTHER     ", "Wait until it is    ", "given back.         ", " " * 20
    )
    await bench.observer.release_control()
    await keypad.shows("T1 JOINT      o en--")
    await bench.take_control()
