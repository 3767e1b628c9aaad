"""Emulator, server and gateway as processes, and a page of theirs in headless Chromium."""

from __future__ import annotations

import importlib.util
import json
import shutil
import signal
import socket
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rigs.processes.warm_start import WarmProcess

from browser.motion_tap import MotionTap
from openpendant.tools.pendants.web.page_files import BUILT

FRONT = BUILT
ROBOT = "kawasaki_ra10n"
UP_WITHIN = 30.0
PICTURES = Path("test-output") / "page"
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--window-size=1366,820",
    "--disable-background-networking",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)
WITHOUT_3D = ("--disable-3d-apis",)
WITH_3D = ("--enable-unsafe-swiftshader", "--disable-accelerated-2d-canvas")
"""Software draws WebGL; the page is composed without, as where there is no graphics hardware."""
COMPOSED_IN_3D = (*WITH_3D, "--use-angle=swiftshader")
"""As where there is hardware. Without it Chromium reads pixels back to compose the page, and writes
to the page's console that this is slow."""


_LOOPBACK = "http://127.0.0.1:"
_TO_HANDLER = 0.002
"""From an event that a browser takes to the first handler of the page [s]; 1.5 ms were seen."""

_NOTE_LIFTED = """
if (window.fingerLifted === undefined) {
  window.fingerLifted = null;
  addEventListener('pointerup', () => (window.fingerLifted = performance.now()), {capture: true});
}
"""


_LOOK = """
const [over] = arguments;
const until = performance.now() + 300;
const look = () => {
  try {
    if (CONDITION) over(true);
    else if (performance.now() > until) over(false);
    else setTimeout(look, 20);
  } catch (error) {
    over(String(error));
  }
};
look();
"""


def why_no_browser() -> str:
    """Return what is missing for a browser; empty for nothing."""
    if importlib.util.find_spec("selenium") is None:
        return "no selenium, which drives the browser"
    missing = [each for each in ("chromium", "chromedriver") if shutil.which(each) is None]
    return f"no {' and no '.join(missing)} on this machine" if missing else ""


def free_port() -> int:
    """Return a port that was free a moment ago."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
        return port


class PageRig:
    """All processes; ends those that it started, by their ids."""

    def __init__(
        self,
        folder: Path,
        driver: Any,
        *,
        robot: str = ROBOT,
        serve: Sequence[object] = ("--emulated",),
        emulate: Sequence[object] = (),
    ) -> None:
        """Make a rig that is not up yet.

        Args:
            folder: for the logs of its processes.
            driver: of the browser, which several rigs may share.
            robot: that of its one cell.
            serve: words for the server besides ports and robot.
            emulate: words for the emulator besides ports and robot.
        """
        self._folder = folder
        self._driver = driver
        self._robot = robot
        self._serve = serve
        self._emulate = emulate
        self._processes: list[WarmProcess] = []
        self._started = 0
        self._tap: MotionTap | None = None

    @property
    def tap(self) -> MotionTap:
        """What goes by in front of the emulator."""
        assert self._tap is not None
        return self._tap

    def __enter__(self) -> Self:
        try:
            self._begin()
        except BaseException:
            self.close()
            raise
        return self

    def _begin(self) -> None:
        motion, state = free_port(), free_port()
        self._start(
            *("emulate", "--robot", self._robot, "--motion-port", motion, "--state-port", state),
            *self._emulate,
        )
        wait_for(motion)
        self.emulator_began = time.monotonic_ns()
        self._tap = MotionTap(motion)
        self.server, self.gateway = free_port(), free_port()
        self._start(
            *(
                "serve",
                "--robot",
                self._robot,
                "--controller",
                f"127.0.0.1:{self.tap.port}:{state}",
            ),
            *("--signals", "openpendant", "--pendant-port", self.server),
            *("--ros-motion-port", "off", "--ros-state-port", "off"),
            *("--store", self._folder / "store.db", *self._serve),
        )
        wait_for(self.server)
        self.start_gateway(self.gateway)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave their page, which would look for its gateway, and end the processes."""
        self._driver.get("about:blank")
        for each in self._processes:
            each.send_signal(signal.SIGTERM)
        for each in self._processes:
            each.end(20)
        if self._tap is not None:
            self._tap.close()

    def page(self, port: int = 0) -> Page:
        """Return the page in the browser, by the rig's gateway or at another port."""
        return Page(self, self._driver, f"http://127.0.0.1:{port or self.gateway}/")

    def end_emulator(self) -> None:
        """End the controller of the cell."""
        _end(self._processes[0])

    def serve_cells(self, robots: dict[str, str], emulated: Collection[str]) -> tuple[int, int]:
        """Serve several cells besides; return the ports of that server and its gateway.

        Args:
            robots: by the names of the cells.
            emulated: cells whose controller runs, and says that it is emulated.
        """
        tables = []
        for name, robot in robots.items():
            motion, state = free_port(), free_port()
            is_emulated = str(name in emulated).lower()
            if name in emulated:
                ports = ("--motion-port", motion, "--state-port", state)
                self._start("emulate", "--robot", robot, *ports)
                wait_for(motion)
            controller = f"motion_port = {motion}, state_port = {state}, emulated = {is_emulated}"
            tables.append(
                f'[[cells]]\nname = "{name}"\nrobot = "{robot}"\ncontroller = {{{controller}}}\n'
            )
        config, server, gateway = self._folder / "cells.toml", free_port(), free_port()
        config.write_text("\n".join(tables), encoding="utf-8")
        self._start("serve", "--config", config, "--pendant-port", server)
        wait_for(server)
        self.start_gateway(gateway, server)
        return server, gateway

    def start_gateway(self, port: int, server: int = 0, keypad: int = 0) -> WarmProcess:
        """Start a gateway at a port, and wait until it listens.

        Args:
            server: the port that it dials; the server's own unless given.
            keypad: the port for the bridge of the keypad in its page; no keypad unless given.
        """
        at = f"127.0.0.1:{server or self.server}"
        more = ("--keypad", keypad) if keypad else ()
        started = self._start("web", "--server", at, "--port", port, *more)
        wait_for(port)
        return started

    def start_bridge(self, keypad: int) -> Path:
        """Start the bridge of the keypad in the page of a gateway; return where it says what."""
        line = f"socket://127.0.0.1:{keypad}"
        self._start("keypad", "--port", line, "--server", f"127.0.0.1:{self.server}")
        return self._folder / f"{self._started}-keypad.log"

    def end(self, process: WarmProcess) -> None:
        """End one of its processes before the others."""
        self._processes.remove(process)
        _end(process)

    def _start(self, *words: object) -> WarmProcess:
        self._started += 1
        log = self._folder / f"{self._started}-{words[0]}.log"
        started = WarmProcess("openpendant.tools", *map(str, words), log=log)
        self._processes.append(started)
        return started


def _end(process: WarmProcess) -> None:
    process.send_signal(signal.SIGTERM)
    process.end(20)


def wait_for(port: int) -> None:
    """Wait until something listens at a port."""
    until = time.monotonic() + UP_WITHIN
    while time.monotonic() < until:
        with socket.socket() as dial:
            if dial.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise AssertionError(f"nothing listens at port {port}")


def chromium(drawing: Sequence[str] = WITHOUT_3D) -> Any:
    """Return the driver of a browser that was started for it.

    Args:
        drawing: flags that say how it draws.
    """
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in (*FLAGS, *drawing):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    show_at(driver, 1366, 820)
    return driver


def show_at(driver: Any, width: int, height: int) -> None:
    """Give the page a size, whatever the window has around it; a narrow one is a phone's."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 700}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


@contextmanager
def own_tab(driver: Any) -> Iterator[None]:
    """Go on in a new tab, and come back: once a second finger was put on the page of one server,
    the browser's driver puts none on that of another.
    """
    first = driver.current_window_handle
    driver.switch_to.new_window("tab")
    try:
        show_at(driver, 1366, 820)
        yield
    finally:
        driver.close()
        driver.switch_to.window(first)


class Page:
    """What a person does at the page, and what it shows."""

    browser = "Chromium"

    def __init__(self, rig: PageRig | None, driver: Any, address: str) -> None:
        self._rig = rig
        self.driver = driver
        self.address = address
        self._downs: set[tuple[str, str]] = set()
        self._at = (0.0, 0.0)

    @property
    def rig(self) -> PageRig:
        """The processes behind it, where a test began them as such."""
        assert self._rig is not None
        return self._rig

    def ready(self) -> None:
        """Open it anew, take control, end a stop, set T1, and hide the checklist."""
        self.open()
        self.wait("document.querySelector('.chips').innerText.includes('Nobody')")
        self.tap_key("KeyC", "c")
        self.wait("document.querySelector('.chips').innerText.includes('You')")
        # A busy machine makes the server stop the robot by itself, which has to be reset.
        if self.run("return document.querySelector('.frame').dataset.state") == "stopped":
            self.reset_stop()
        if "T1" not in self.text(".chips"):
            self.tap_key("KeyM", "m")
        self.wait("document.querySelector('.chips').innerText.includes('T1')")
        self.run("document.querySelector('.checklist .quiet').click()")

    def open(self) -> None:
        """Load the page with the usual settings, and wait until it shows the cell."""
        self.driver.get(self.address)
        usual, kept = json.dumps({"theme": "dark", "language": "en"}), "openpendant.settings"
        if self.run(f"return localStorage.getItem('{kept}')") != usual:
            self.run(f"localStorage.setItem('{kept}', {json.dumps(usual)})")
            self.driver.refresh()
        self.wait("document.querySelector('.chips')?.innerText.includes('Connected')")
        self.wait("document.querySelectorAll('.row').length > 3")
        self.wait("document.querySelector('.host[data-shows-robot]')", within=20)

    def run(self, script: str) -> Any:
        return self.driver.execute_script(script)

    def do(self, script: str) -> None:
        """Have the page do something at once: nothing but the browser stands in between."""
        self.cdp("Runtime.evaluate", expression=script)

    def text(self, selector: str) -> str:
        return str(self.run(f"return document.querySelector({json.dumps(selector)}).innerText"))

    def wait(self, condition: str, within: float = 10.0) -> None:
        until = time.monotonic() + within
        while not self.looks(condition):
            if time.monotonic() >= until:
                raise AssertionError(f"not within {within:g} s: {condition}; {self.told()}")

    def looks(self, condition: str) -> bool:
        """Return whether the page shows something within a moment.

        It looks by itself: asked from here each 20 ms, it costs a sixth of a processor more.
        """
        found = self.driver.execute_async_script(_LOOK.replace("CONDITION", condition))
        if not isinstance(found, bool):
            raise TypeError(f"{condition}: {found}")
        return found

    def told(self) -> str:
        """Return what the chips and the banner say, for whoever reads why a test failed."""
        return " / ".join(self.text(part) for part in (".chips", ".banners")).replace("\n", " ")

    def console(self) -> list[str]:
        """Return what this page has written to the console; another one may be told of later."""
        told = [str(entry["message"]) for entry in self.driver.get_log("browser")]
        return [each for each in told if self.address in each or _LOOPBACK not in each]

    def key(self, down: bool, code: str, key: str, modifiers: int = 0) -> None:
        kind = "keyDown" if down else "keyUp"
        known = (code, key)
        (self._downs.add if down else self._downs.discard)(known)
        self.cdp("Input.dispatchKeyEvent", type=kind, code=code, key=key, modifiers=modifiers)

    def tap_key(self, code: str, key: str) -> None:
        self.key(True, code, key)
        self.key(False, code, key)

    def cdp(self, command: str, **values: object) -> Any:
        return self.driver.execute_cdp_cmd(command, values)

    def hold_enabling(self) -> None:
        self.key(True, "KeyV", "v")
        self.wait("document.querySelector('.enabling').classList.contains('on')")
        self.wait("document.querySelector('.jog-key:not([aria-disabled])') !== null")

    def stay_enabled(self) -> None:
        """Hold the enabling device, unless the page has it held."""
        if not self.run("return document.querySelector('.enabling').classList.contains('on')"):
            self.key(False, "KeyV", "v")
            self.hold_enabling()

    def place(self, row: int, side: str) -> tuple[float, float]:
        """Return the middle of a jog button, `minus` or `plus`."""
        index = 2 * row + (side == "plus")
        box = f"document.querySelectorAll('.jog-key')[{index}].getBoundingClientRect()"
        x, y = self.run(f"const b = {box}; return [b.x + b.width / 2, b.y + b.height / 2]")
        return x, y

    def mouse(self, kind: str, at: tuple[float, float], button: str = "left") -> None:
        pressed = kind == "mousePressed"
        self._at = at
        count = 0 if kind == "mouseMoved" else 1
        self.cdp(
            "Input.dispatchMouseEvent",
            **{"type": kind, "x": at[0], "y": at[1], "clickCount": count},
            button="none" if kind == "mouseMoved" else button,
            buttons=int(pressed),
        )

    def touch(self, kind: str, *points: tuple[float, float]) -> None:
        told = [{"x": x, "y": y, "id": index} for index, (x, y) in enumerate(points)]
        self.cdp("Input.dispatchTouchEvent", type=kind, touchPoints=told)

    def put_finger(self, at: tuple[float, float]) -> None:
        """Put a finger on the page, which notes in front of its own handlers when that leaves."""
        self.run(_NOTE_LIFTED)
        self.touch("touchStart", at)

    def lift_finger(self) -> float:
        """Lift it; return when the browser took it, by the monotonic clock [s].

        The devtools protocol hands a finger on only after the next picture of the page, for which
        it asks by `VisualStateRequest`: up to two pictures later. No hand's finger waits for that.
        """
        self.touch("touchEnd")
        noted = self.run("return (performance.timeOrigin + window.fingerLifted) / 1000")
        return float(noted) - (time.time() - time.monotonic()) - _TO_HANDLER

    def jogs(self) -> None:
        self.wait("document.querySelector('.chips').innerText.includes('Jogging')")

    def stands(self) -> None:
        self.wait("!document.querySelector('.chips').innerText.includes('Jogging')")

    def reset_stop(self) -> None:
        """End a stop in its two steps."""
        self.wait("document.querySelector('.steps-of-stop button')?.offsetParent")
        self.run("document.querySelectorAll('.steps-of-stop button')[0].click()")
        self.wait("!document.querySelector('.steps-of-stop .blue').hasAttribute('aria-disabled')")
        self.run("document.querySelectorAll('.steps-of-stop button')[1].click()")
        self.wait("document.querySelector('.frame').dataset.state === 'control'")

    def picture(self, name: str) -> Path:
        """Keep what the page looks like; return the file."""
        PICTURES.mkdir(parents=True, exist_ok=True)
        kept = PICTURES / f"{name}.png"
        kept.write_bytes(self.driver.get_screenshot_as_png())
        return kept

    def let_all_go(self) -> None:
        for code, key in tuple(self._downs):
            self.key(False, code, key)
        self.mouse("mouseReleased", (5, 400))
        self.run("dispatchEvent(new Event('blur'))")
