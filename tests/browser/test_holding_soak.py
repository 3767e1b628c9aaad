"""An hour of holding to and fro: nothing but a hand ends a jog.

Three pages hold, each in a window and a cell of its own, beside 27 other clients of the gateway
that hold as well. `OPENPENDANT_HOLD_SECONDS` makes it shorter.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from promises.promise_figures import VOID_SHARE, tell
from rigs.clock.stall_watch import StallWatch

from browser.page_rig import Page, chromium, free_port, show_at, wait_for
from openpendant.tools.bench.cells import running_room
from openpendant.tools.bench.peers import before_ordinary_programs

SECONDS = float(os.environ.get("OPENPENDANT_HOLD_SECONDS", "3600"))
CELLS, PAGES = 30, 3
HELD_FOR = 1.5
JOGGED_BESIDE = 0.4
"""Share of the time in which the robots of the other clients jog, at least."""

MOST_FALSE_STOPS = 1
BEGUN_ANEW_WITHIN = 60.0
LATE = 0.020
"""An idle process that waited for so much longer than it asked explains a stop [s]: a controller
refuses what comes late."""

LATE_BEHIND = 0.050
"""The same of an idle process that has the niceness of the browser [s]."""

BROWSER_NICENESS = 3
"""At 0 robots run out of points; put behind by more, pages fall silent more often."""

JOG_LEAD = 0.1
"""The most that a jog may have ahead [s]: thirty robots in motion, their gateway and three browser
windows take two processors whole."""

pytestmark = [pytest.mark.realtime, pytest.mark.soak, pytest.mark.timeout(SECONDS + 600)]

BYTE_CLIENTS = Path(__file__).with_name("byte_clients.py")


@contextmanager
def _process(*command: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen([sys.executable, *command], stdout=subprocess.PIPE, text=True) as child:
        try:
            yield child
        finally:
            child.terminate()


def _put_behind(pid: int) -> None:
    """Put a process and its children behind controllers, server and gateway, which have machines
    of their own in life.

    A browser that root began even puts its drawing before them (niceness -8). Each thread has a
    niceness of its own, and a new one that of the thread that made it.
    """
    for thread in Path(f"/proc/{pid}/task").iterdir():
        with suppress(ProcessLookupError, FileNotFoundError):
            os.setpriority(os.PRIO_PROCESS, int(thread.name), BROWSER_NICENESS)
            for child in (thread / "children").read_text("ascii").split():
                _put_behind(int(child))


class _Window:
    """A page in a window of its own, which holds one joint's key."""

    def __init__(self, driver: Any, address: str, cell: str) -> None:
        driver.switch_to.new_window("window")
        self.page = Page(None, driver, address)
        self._handle = driver.current_window_handle
        show_at(driver, 1024, 600)
        self._is_minus = False
        self.pressed_at = 0.0
        self._enter(cell)

    def _enter(self, cell: str) -> None:
        page = self.page
        page.driver.get(page.address)
        enter = f"document.querySelector('[aria-label$=\" {cell}\"]')"
        page.wait(enter)
        # One that is not known to be emulated asks twice.
        page.run(f"{enter}.click(); {enter}?.click()")
        page.wait("document.querySelector('.chips')?.innerText.includes('Connected')")
        page.wait("document.querySelectorAll('.row').length > 3")
        page.run("document.querySelector('.checklist .quiet').click()")
        self.recover()

    def _take_control(self) -> None:
        self.page.tap_key("KeyC", "c")
        self.page.wait("document.querySelector('.chips').innerText.includes('You')")
        self.page.hold_enabling()

    def front(self) -> Page:
        """Have commands go to this window."""
        self.page.driver.switch_to.window(self._handle)
        return self.page

    def press(self) -> None:
        """Hold the first joint's key, every other time the other way."""
        self.pressed_at = time.monotonic()
        self._is_minus = not self._is_minus
        self.front().key(True, "Digit1", "1", 8 if self._is_minus else 0)

    def is_held(self) -> bool:
        """Return whether it jogs; a press that has ended never comes to life again."""
        return "Jogging" in self.front().text(".chips")

    def told(self) -> str:
        """Return what the page's log says of how the press ended."""
        page = self.front()
        page.run("document.querySelector('[data-task=log]').click()")
        page.wait("document.querySelector('.log-lines li') !== null")
        lines = "[...document.querySelectorAll('.log-lines li')].slice(0, 3)"
        told = page.run(f"return {lines}.map(line => line.lastChild.innerText)")
        page.run("document.querySelector('[data-task=jog]').click()")
        return " < ".join(told)

    def let_go(self) -> None:
        """Let the key go, and wait until the robot stands."""
        page = self.front()
        page.key(False, "Digit1", "1")
        page.stands()

    def recover(self) -> None:
        """Begin anew after a stop; a machine that is late ends that, too."""
        until = time.monotonic() + BEGUN_ANEW_WITHIN
        while True:
            page = self.front()
            page.let_all_go()
            try:
                if page.run("return document.querySelector('.frame').dataset.state") == "stopped":
                    page.reset_stop()
                self._take_control()
            except AssertionError:
                if time.monotonic() > until:
                    raise
            else:
                return


def test_in_an_hour_of_holding_nothing_but_the_hand_ends_a_jog() -> None:
    watch, watch_behind = StallWatch(), StallWatch()
    _put_behind(watch_behind.pid)
    port = free_port()
    address = f"http://127.0.0.1:{port}/"
    driver = chromium()
    try:
        room = running_room(CELLS, is_pinned=False, jog_lead=JOG_LEAD, is_unhurried=True)
        with room as (server, cells):
            gateway = ("web", "--server", f"127.0.0.1:{server['pendant']}", "--port", str(port))
            with _process("-m", "openpendant.tools", *gateway) as relaying:
                before_ordinary_programs(relaying.pid)
                wait_for(port)
                with _process(str(BYTE_CLIENTS), address, *cells[PAGES:]) as others:
                    windows = [_Window(driver, address, cell) for cell in cells[:PAGES]]
                    _put_behind(driver.service.process.pid)
                    presses, false, explained = _to_and_fro(windows, watch, watch_behind)
                    others.terminate()
                    assert others.stdout is not None
                    beside = json.loads(others.stdout.readline())
    finally:
        driver.quit()
        for each in (watch, watch_behind):
            each.end()
    told = f"{presses} presses of {PAGES} pages, false stops: {false}, beside a late machine:"
    told += f" {len(explained)} {explained}; of the other clients: {beside}"
    tell(told)
    assert beside["jogged"] > JOGGED_BESIDE, f"they did not hold: {told}"
    assert len(explained) <= VOID_SHARE * presses, f"not judged, the machine was busy: {told}"
    assert len(false) <= MOST_FALSE_STOPS, told


def _to_and_fro(
    windows: list[_Window], watch: StallWatch, watch_behind: StallWatch
) -> tuple[int, list[str], list[str]]:
    presses, false, explained = 0, list[str](), list[str]()
    until = time.monotonic() + SECONDS
    while time.monotonic() < until:
        for each in windows:
            each.press()
            presses += 1
        time.sleep(HELD_FOR)
        ended = [each for each in windows if not each.is_held()]
        for each in ended:
            is_late = watch.worst_since(each.pressed_at) > LATE
            is_late |= watch_behind.worst_since(each.pressed_at) > LATE_BEHIND
            told = each.told()
            (explained if is_late else false).append(told)
            tell(f"press {presses}, {'late machine' if is_late else 'false stop'}: {told}")
            each.recover()
        for each in windows:
            if each not in ended:
                each.let_go()
    return presses, false, explained
