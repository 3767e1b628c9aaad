"""Keypad on screen, made with textual: its 16 keys and its display in a terminal.

Owns layout, and how a finger is put on a key where a terminal sees no key come up: a mouse button
holds a key, the key's own character or Enter latches it and lets it go again. Space and F8 are STOP
here as everywhere, Esc lets go of all keys.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import ClassVar

from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Grid, Horizontal, Vertical
from textual.screen import Screen
from textual.widgets import Static

from .emulated_keypad import EmulatedKeypad
from .emulator_line import PERIOD, EmulatedLine, RunningKeypad
from .keys import KEYS, LABELS, STOP, printed_on

STOP_KEYS = (" ", "space", "f8")

STRUCK = 0.15
"""STOP by a key of the terminal is down for so long [s]."""

_HELP = """\
SPACE, F8: STOP
Esc: let go of all
mouse: hold a key
{labels}:
 latch it, and let it go
Enter: the last one again
e: enabling button
ctrl+q: quit

{state}
--port {port}"""


class KeyCap(Static):
    """One key: a mouse button holds it while it is over it."""

    def __init__(self, key: int, touched: Callable[[int, bool], None]) -> None:
        super().__init__("\n".join(printed_on(key)), id=f"key{key}", markup=False)
        self._key = key
        self._touched = touched
        self._is_held = False

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Put a finger on it, and keep the mouse until it comes up."""
        self.capture_mouse()
        self._is_held = True
        self._touched(self._key, True)

    def on_mouse_up(self, event: events.MouseUp) -> None:
        """Take the finger off, wherever the mouse is by now."""
        self.release_mouse()
        self._let_go()

    def on_mouse_release(self, event: events.MouseRelease) -> None:
        """Take the finger off where the mouse was taken away."""
        self._let_go()

    def _let_go(self) -> None:
        if self._is_held:
            self._is_held = False
            self._touched(self._key, False)


class KeypadScreen(Screen[None]):
    """The only screen."""

    def __init__(
        self, keypad: EmulatedKeypad, open_line: Callable[[], Awaitable[EmulatedLine]]
    ) -> None:
        super().__init__()
        self._keypad = keypad
        self._open_line = open_line
        self._board: RunningKeypad | None = None
        self._glass = Static(id="glass", markup=False)
        self._help = Static(id="help", markup=False)
        self._caps = [KeyCap(key, self._touched) for key in range(KEYS)]
        self._shown: tuple[object, ...] = ()
        self._latched_last: int | None = None

    def compose(self) -> ComposeResult:
        """Yield the glass, the keys and the help."""
        with Horizontal():
            with Vertical(id="left"):
                yield from (self._glass, self._help)
            with Grid(id="keys"):
                yield from self._caps

    async def on_mount(self) -> None:
        """Open the line, and start the timer that lets the keypad's time pass."""
        self._board = RunningKeypad(self._keypad, await self._open_line())
        self.set_interval(PERIOD, self._look)

    def on_unmount(self) -> None:
        """Close the line: a keypad that is gone is a pulled cable."""
        if self._board is not None:
            self._board.line.close()

    def on_key(self, event: events.Key) -> None:
        """Latch a key, or let it go; nothing else may act on it."""
        event.stop()
        event.prevent_default()
        character = event.character or ""
        if event.key in STOP_KEYS or character in STOP_KEYS:
            self._keypad.press(STOP)
            self.set_timer(STRUCK, lambda: self._keypad.let_go(STOP))
        elif event.key == "escape":
            self.let_go_of_all()
        elif event.key == "enter" and self._latched_last is not None:
            self._toggle(self._latched_last)
        elif character == "e":
            self._keypad.button = not self._keypad.button
        elif len(character) == 1 and character.upper() in LABELS:
            self._toggle(LABELS.index(character.upper()))

    def _toggle(self, key: int) -> None:
        self._latched_last = key
        if key in self._keypad.pressed:
            self._keypad.let_go(key)
        else:
            self._keypad.press(key)

    def _touched(self, key: int, is_down: bool) -> None:
        if is_down:
            self._keypad.press(key)
        elif key == STOP:
            # However short it was, it is scanned.
            self.set_timer(STRUCK, lambda: self._keypad.let_go(STOP))
        else:
            self._keypad.let_go(key)

    def let_go_of_all(self) -> None:
        """Take all fingers off, and let the enabling button go."""
        self._keypad.pressed.clear()
        self._keypad.button = False

    def _look(self) -> None:
        running = self._board
        if running is None:
            return
        running.look()
        keypad = self._keypad
        shown = (tuple(keypad.lcd), frozenset(keypad.pressed), keypad.button, running.is_open)
        if shown == self._shown:
            return
        self._shown = shown
        self._glass.update("\n".join(keypad.lcd))
        for key, cap in enumerate(self._caps):
            cap.set_class(key in keypad.pressed, "down")
        state = "a bridge is there" if running.is_open else "no bridge yet"
        button = "enabling button HELD\n" if keypad.button else ""
        told = _HELP.format(labels=LABELS, port=running.line.name, state=state)
        self._help.update(f"{button}{told}")


class KeypadApp(App[None]):
    """The keypad on screen."""

    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q,ctrl+c", "quit", "Quit", priority=True, show=False)
    ]
    CSS = """
    #left { width: 27; height: auto; }
    #glass { border: heavy $success; width: 24; height: 6; padding: 0 1; margin: 0 1; }
    #keys { grid-size: 4 4; grid-gutter: 0 1; width: 52; height: 20; }
    KeyCap { border: round $secondary; height: 5; text-align: center; }
    KeyCap.down { background: $warning; color: $text; }
    #key15 { border: heavy $error; }
    #help { color: $text-muted; width: 26; height: auto; margin: 0 1; }
    """

    def __init__(
        self, keypad: EmulatedKeypad, open_line: Callable[[], Awaitable[EmulatedLine]]
    ) -> None:
        """Make the keypad of a line that is opened once it is shown."""
        super().__init__()
        self._keypad = keypad
        self._open_line = open_line

    def get_default_screen(self) -> KeypadScreen:
        """Return the only screen."""
        return KeypadScreen(self._keypad, self._open_line)

    def on_app_blur(self, event: events.AppBlur) -> None:
        """Let go of all keys where the terminal is not looked at any more."""
        if isinstance(self.screen, KeypadScreen):
            self.screen.let_go_of_all()
