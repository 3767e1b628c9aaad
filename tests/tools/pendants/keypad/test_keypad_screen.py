"""The keypad on screen: what mouse and keys of a terminal do to its keys."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from rigs.clock.busy_machine import SCALE
from textual import events
from textual.pilot import Pilot
from textual.widgets import Static

from openpendant.tools.pendants.keypad import keypad_screen
from openpendant.tools.pendants.keypad.emulated_keypad import EmulatedKeypad
from openpendant.tools.pendants.keypad.emulator_line import EmulatedLine, SocketLine
from openpendant.tools.pendants.keypad.keypad_screen import KeypadApp
from openpendant.tools.pendants.keypad.keys import KEYS, LABELS, STOP, printed_on

pytestmark = pytest.mark.realtime


@pytest.fixture(autouse=True)
def rare_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look at the line less often: the pilot waits until an app has nothing to do."""
    monkeypatch.setattr(keypad_screen, "PERIOD", 0.05)


class NotedKeypad(EmulatedKeypad):
    """A keypad that remembers what was pressed."""

    def __init__(self) -> None:
        super().__init__()
        self.struck: list[int] = []

    def press(self, key: int) -> None:
        self.struck.append(key)
        super().press(key)


async def a_socket() -> EmulatedLine:
    line = SocketLine()
    await line.listen(0)
    return line


@asynccontextmanager
async def shown() -> AsyncIterator[tuple[Pilot[None], NotedKeypad]]:
    keypad = NotedKeypad()
    async with KeypadApp(keypad, a_socket).run_test(size=(80, 24)) as pilot:
        await pilot.pause(0.05)
        yield pilot, keypad


def labels(keypad: EmulatedKeypad) -> str:
    return "".join(sorted(LABELS[key] for key in keypad.pressed))


async def until(holds: Any) -> None:
    async with asyncio.timeout(10 * SCALE):
        while not holds():  # noqa: ASYNC110 - a screen tells nobody
            await asyncio.sleep(0.01)


async def test_the_glass_and_the_port_are_shown() -> None:
    async with shown() as (pilot, keypad):
        glass = pilot.app.screen.query_one("#glass", Static)
        await until(lambda: str(glass.render()).splitlines()[:1] == ["NO BRIDGE           "])
        told = str(pilot.app.screen.query_one("#help", Static).render())
        assert "socket://127.0.0.1:" in told
        assert keypad.lcd[3] == "keypad 1.0   115200 "


async def test_a_mouse_button_holds_a_key_until_it_comes_up() -> None:
    async with shown() as (pilot, keypad):
        await pilot.mouse_down("#key0")
        assert labels(keypad) == "1"
        await pilot.mouse_up("#key0")
        assert labels(keypad) == ""


async def test_a_mouse_that_slid_off_lets_go_where_it_comes_up() -> None:
    async with shown() as (pilot, keypad):
        await pilot.mouse_down("#key0")
        assert labels(keypad) == "1"
        await pilot.mouse_up("#key5")
        assert labels(keypad) == ""


async def test_a_label_latches_its_key_and_lets_it_go_and_enter_repeats_the_last() -> None:
    async with shown() as (pilot, keypad):
        await pilot.press("1", "5")
        assert labels(keypad) == "15"
        await pilot.press("1")
        assert labels(keypad) == "5"
        await pilot.press("enter")
        assert labels(keypad) == "15"
        await pilot.press("c", "number_sign")
        assert labels(keypad) == "#15C"
        await pilot.press("escape")
        assert labels(keypad) == ""


@pytest.mark.parametrize("key", ["space", "f8"])
async def test_space_and_f8_are_stop_and_latch_nothing(key: str) -> None:
    async with shown() as (pilot, keypad):
        await pilot.press(key)
        await until(lambda: not keypad.pressed)
        assert keypad.struck == [STOP]


async def test_the_enabling_button_is_latched_and_let_go_with_all() -> None:
    async with shown() as (pilot, keypad):
        await pilot.press("e")
        assert keypad.button
        await pilot.press("escape")
        assert not keypad.button


async def test_a_terminal_that_loses_the_focus_lets_go_of_all() -> None:
    async with shown() as (pilot, keypad):
        await pilot.press("1")
        pilot.app.post_message(events.AppBlur())
        await until(lambda: not keypad.pressed)


def test_each_key_has_its_words_on_it() -> None:
    words = [printed_on(key) for key in range(KEYS)]
    assert [each[0] for each in words] == list(LABELS)
    assert words[0] == ("1", "1+  X+", "REC")
    assert words[14] == ("#", "6-  C-", "T1/T2")
    assert words[11] == ("C", "MODE", "long: menu")
    assert words[15][1] == "STOP"
