"""Keypad, bridge, server and controller as processes, the keypad on a pseudo-terminal."""

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE, tell_begun_anew
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
MOST_PRESSES = 8
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

    async def hold_until(self, labels: str, holds: Callable[[messages.State], bool]) -> None:
        """Hold keys until something holds; they stay down.

        A machine that stands still for an eighth of a second ends the jog, as it must, and the keys
        are pressed again.
        """
        for _ in range(MOST_PRESSES):
            await self.keypad.down(*labels)
            while not await self._comes(holds):
                if (await self.keypad.lcd())[0] == "LET GO OF ALL KEYS  ":
                    break
            else:
                return
            tell_begun_anew("the jog of a held key had broken off")
            await self.keypad.up()
            await self.keypad.meets(lambda lcd: lcd[0].endswith("* en--"))
        pytest.fail(f"{MOST_PRESSES} presses of {labels} did not do it")

    async def _comes(self, holds: Callable[[messages.State], bool]) -> bool:
        try:
            await self.observer.wait_until(holds, within=1.0)
        except TimeoutError:
            return False
        return True

    async def held_until(
        self, labels: str, holds: Callable[[messages.State], bool]
    ) -> messages.State:
        """Hold keys until something holds, let go, and return the state at rest."""
        await self.hold_until(labels, holds)
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
    async with AsyncExitStack() as stack:
        cell, keypad = await asyncio.gather(
            start_cell(settings=SETTINGS, server=EMULATED, has_store=True),
            stack.enter_async_context(some_keypad),
        )
        serving, observer = await asyncio.gather(
            stack.enter_async_context(bridge(keypad.port, cell.ports["pendant"])),
            cell.ready_pendant(client="observer"),
        )
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


async def test_a_held_key_jogs_its_joint_and_two_keys_jog_both(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
    start = (await bench.stands()).positions
    state = await bench.held_until("1", lambda s: s.positions[0] > start[0] + 0.05)
    assert state.positions[1:6] == pytest.approx(start[1:6], abs=1e-4)
    await keypad.shows("T1 JOINT      * en--", *joint_rows(state.positions))
    first = state.positions
    state = await bench.held_until(
        "1#", lambda s: s.positions[0] > first[0] + 0.04 and s.positions[5] < first[5] - 0.02
    )
    assert state.positions[1:5] == pytest.approx(first[1:5], abs=1e-4)


@pytest.mark.firmware
async def test_the_speed_keys_change_the_override_and_show_it(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
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


async def test_in_the_base_frame_a_key_moves_the_tool_straight_up(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
    await keypad.strike("C")
    await keypad.shows("T1 BASE       * en--")
    low = await bench.stands()
    state = await bench.held_until("3", lambda s: s.tool_position[2] > low.tool_position[2] + 0.01)
    assert state.tool_position[:2] == pytest.approx(low.tool_position[:2], abs=5e-4)
    await keypad.shows("T1 BASE       * en--", *pose_rows(state))


@pytest_asyncio.fixture
async def recorded(bench: Bench) -> tuple[messages.State, messages.State]:
    """A motion that was recorded by the keys: where it began and where it ended."""
    keypad = bench.keypad
    await bench.take_control()
    await keypad.strike("C")
    await keypad.shows("T1 BASE       * en--")
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
    began = await bench.stands()
    ended = await bench.held_until(
        "3", lambda s: s.tool_position[2] > began.tool_position[2] + 0.01
    )
    return began, ended


@pytest.mark.firmware
async def test_what_was_recorded_is_listed_and_played_while_its_key_is_held(
    bench: Bench, recorded: tuple[messages.State, messages.State]
) -> None:
    keypad, (began, ended) = bench.keypad, recorded
    await keypad.strike("C", held=1.0)
    await keypad.meets(lambda lcd: lcd[0].startswith("REC 00:"))
    await keypad.strike("1")
    lcd = await keypad.meets(lambda lcd: lcd[0].startswith(">keypad-1    00:"))
    assert lcd[1:] == [" " * 20, " " * 20, "hold PLAY; REC: new "]
    await keypad.down("2")
    await keypad.meets(
        lambda lcd: (
            lcd[0].startswith("PLAY keypad-1 ")
            and " of 00:" in lcd[1]
            and lcd[2] == "let go: stops       "
        )
    )
    await bench.until(lambda s: s.tool_position[2] < began.tool_position[2] + 0.004)
    await keypad.meets(lambda lcd: lcd[2] == "ended               ")
    await keypad.up()
    state = await bench.stands()
    assert state.positions[:6] == pytest.approx(ended.positions[:6], abs=2e-3)


@pytest.mark.firmware
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


async def test_promise_25_a_pulled_cable_lets_go_and_after_it_a_key_must_have_been_up(
    bench: Bench,
) -> None:
    keypad = bench.keypad
    await bench.take_control()
    start = (await bench.stands()).positions
    await bench.hold_until("1", lambda s: s.positions[0] > start[0] + 0.03)
    await keypad.order("pull")
    stood = await bench.stands()
    assert stood.stop == messages.StopKind.NONE
    await bench.bridge.says("unplugged; what it held was released")
    await keypad.order("plug")
    await keypad.shows("LET GO OF ALL KEYS  ", "then press again    ")
    await asyncio.sleep(0.2)
    state = await bench.stands()
    assert state.positions[:6] == pytest.approx(stood.positions[:6], abs=1e-4)
    await keypad.up()
    await keypad.shows("T1 JOINT      * en--")
    await bench.held_until("1", lambda s: s.positions[0] > stood.positions[0] + 0.03)


async def test_stop_latches_and_mode_resets_it(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.take_control()
    start = (await bench.stands()).positions
    await bench.hold_until("1", lambda s: s.positions[0] > start[0] + 0.02)
    await keypad.down("D")
    await bench.until(lambda s: s.stop == messages.StopKind.SOFTWARE)
    await keypad.up()
    await keypad.shows(
        "STOP keypad         ", "STOP key            ", " " * 20, "MODE 2 s: reset     "
    )
    await keypad.strike("C", held=2.1)
    await bench.until(lambda s: s.stop == messages.StopKind.NONE)
    await bench.stands()
    await keypad.shows("T1 JOINT      * en--")


@pytest.mark.firmware
@emulated_only
async def test_a_refusal_stands_on_the_display_in_its_words(bench: Bench) -> None:
    keypad = bench.keypad
    await bench.observer.take_control()
    await keypad.strike("1")
    await keypad.shows(
        "! HELD_BY_OTHER     ", "Wait until it is    ", "given back.         ", " " * 20
    )
    await bench.observer.release_control()
    await bench.take_control()
