"""Screen of the terminal pendant, made with textual: keys in, texts out.

Owns layout and colours. Decides nothing: every key goes to the core, every text comes from it.
Pasted text is discarded, so that no clipboard moves a robot.
"""

from __future__ import annotations

import asyncio
import signal
import sys
import threading
import time
from typing import ClassVar

from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widgets import Static

from ..client import PendantError
from ..panel import lcd
from ..panel.connection import Connect, LogIn, PanelConnection, as_nobody
from ..panel.keyboard import legend
from ..panel.panel import Panel
from . import screen_text
from .missing_steps import steps_line

TICK = 0.04
"""Time between two looks at the clock and two pictures [s]."""

_ROWS_FOR_ALL = 34
"""From so many rows on there is room for the list of all keys and for more messages."""

_COLUMNS_FOR_ALL = 100
"""From so many columns on there is room for whole lines beside the display."""

_MESSAGES, _FEW_MESSAGES = 6, 3

_TEXTS = (
    *("lamps", "status", "steps", "banner", "lcd", "jog"),
    *("joints", "pose", "program", "messages", "keys"),
)


class PendantScreen(Screen[None]):
    """The only screen; it has no widget that could consume a key."""

    def __init__(self, panel: Panel, connection: PanelConnection) -> None:
        super().__init__()
        self._panel = panel
        self._connection = connection
        # Without markup: a program's brackets are shown as they are.
        self._texts = {name: Static(id=name, markup=False) for name in _TEXTS}
        self._shown: dict[str, str] = {}

    def compose(self) -> ComposeResult:
        """Yield the widgets of the screen."""
        texts = self._texts
        yield from (texts["lamps"], texts["status"], texts["steps"], texts["banner"])
        with Horizontal(id="middle"):
            with Vertical(id="left"):
                yield from (texts["lcd"], texts["jog"])
            with Vertical(id="right"):
                yield from (texts["joints"], texts["pose"], texts["program"])
        yield from (texts["messages"], texts["keys"])

    def on_mount(self) -> None:
        """Start the timer that advances the core and draws."""
        self.set_interval(TICK, self._tick)

    def on_key(self, event: events.Key) -> None:
        """Pass a key to the core; nothing else may act on it."""
        event.stop()
        event.prevent_default()
        printable = event.character is not None and event.character.isprintable()
        key = event.character if printable and event.character else event.key
        self._connection.perform(self._panel.key(key, time.monotonic_ns()))

    def _tick(self) -> None:
        now = time.monotonic_ns()
        self._connection.perform(self._panel.tick(now))
        self._draw(now)

    def _draw(self, now: int) -> None:
        panel = self._panel
        columns, rows = self.size
        is_small = rows < _ROWS_FOR_ALL
        self.set_class(is_small, "small")
        self.set_class(columns < _COLUMNS_FOR_ALL, "narrow")
        messages = _FEW_MESSAGES if is_small else _MESSAGES
        banner = screen_text.banner(panel, now)
        self._put("lamps", screen_text.lamp_line(panel, now))
        self._put("status", screen_text.status_line(panel, now))
        self._put("steps", steps_line(panel, now))
        self._put("banner", banner)
        self._put("lcd", "\n".join(lcd.page(panel, now)))
        self._put("jog", screen_text.jog_line(panel, now))
        self._put("joints", screen_text.joint_table(panel))
        self._put("pose", screen_text.pose_table(panel))
        self._put("program", screen_text.program_list(panel))
        self._put("messages", screen_text.message_list(panel, messages, max(1, columns)))
        self.set_class(panel.shows_keys, "keys")
        is_short = is_small and not panel.shows_keys
        self._put("keys", legend(panel.jog.axis_names, panel.jog.frame or "joints", short=is_short))
        self._texts["banner"].set_class(bool(banner), "shown")
        bad = panel.cell.is_stopped or panel.cell.is_stale(now) or bool(panel.stop_key.doubt(now))
        self._texts["lcd"].set_class(bad, "bad")

    def _put(self, name: str, text: str) -> None:
        """Show a text if it has changed: an idle pendant draws nothing."""
        if self._shown.get(name) != text:
            self._shown[name] = text
            self._texts[name].update(text)


class PendantApp(App[PendantError | None]):
    """The terminal pendant; it returns the error that ended it, None if its user ended it."""

    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+q,ctrl+c", "quit", "Quit", priority=True, show=False)
    ]
    CSS = """
    Static { height: auto; }
    #middle { height: 1fr; overflow: hidden; }
    .narrow #left { width: 27; }
    #joints { text-wrap: nowrap; text-overflow: ellipsis; }
    .small #messages { height: 4; }
    .keys #middle, .keys #messages { display: none; }
    #left { width: 44; height: auto; padding-right: 1; }
    #right { width: 1fr; height: auto; }
    #lcd { border: heavy $success; width: 24; padding: 0 1; margin: 0 1; }
    #lcd.bad { border: heavy $error; }
    #banner { background: $warning; color: $text; display: none; }
    #banner.shown { display: block; }
    #program { margin-top: 1; }
    #messages { border-top: solid $secondary; height: 7; }
    #keys { border-top: solid $secondary; color: $text-muted; }
    """

    def __init__(
        self, connect: Connect, log_in: LogIn = as_nobody, panel: Panel | None = None
    ) -> None:
        """Make a pendant."""
        super().__init__()
        self.panel = Panel() if panel is None else panel
        self._connection = PanelConnection(self.panel, connect, log_in)

    def get_default_screen(self) -> PendantScreen:
        """Return the only screen."""
        return PendantScreen(self.panel, self._connection)

    def on_mount(self) -> None:
        """Start the connection loop; let SIGTERM end the pendant as its user would."""
        if sys.platform != "win32" and threading.current_thread() is threading.main_thread():
            # Its default would leave the terminal as the screen needs it: no echo, no line ends.
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, self.exit)
        self.run_worker(self._stay_connected(), name="connection")

    async def _stay_connected(self) -> None:
        try:
            await self._connection.run()
        except PendantError as error:
            self.exit(error)
