"""The browser pendant in a real browser: how soon it is there, and how soon a press is seen.

Times are those of the page's own clock, which begins when the browser is told to load it, and end
with the picture in which the thing is first seen. The browser is this machine's Chromium, headless,
driven by selenium (extra browser); what is drawn in three dimensions is drawn by software.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..pendants.web.build import FRONTEND, PAGE, NotBuilt, node_tools
from .peers import EMULATOR, SERVER, process
from .table import Benchmark, Bound, Judged, MissingRequirement, Sides

MOST_PRESS = 60.0
MOST_CONNECT = 1_000.0
MOST_STICKS = 1_500.0
MOST_RATIO_3D = 2.5
MOST_PICTURE = 100.0
"""Ten pictures a second [ms]."""

SAMPLES = 100_000
_PAN = 3_000
"""Length of one sample of panning [ms]."""

_WITHIN = 60.0
_FLAGS = (
    *("--headless=new", "--no-sandbox", "--window-size=1366,820"),
    *("--disable-background-networking", "--disable-accelerated-2d-canvas"),
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)
_WITHOUT_3D = ("--disable-3d-apis",)
_WITH_3D = ("--enable-unsafe-swiftshader",)
"""As where there is no graphics hardware: software draws WebGL, and the page is composed without.
Made to compose by it too (`--use-angle=swiftshader`), a browser takes twice as long for a page."""

_FIRST_SEEN = """
globalThis.seen = {};
const wanted = %s;
const look = () => {
  for (const [name, selector] of Object.entries(wanted)) {
    if (seen[name] === undefined && document.querySelector(selector)?.getClientRects().length) {
      seen[name] = null;
      // The page marks its picture in three dimensions when that is done; any other is out when the
      // next but one is begun.
      const told = () => seen[name] = performance.now();
      if (name === 'solid') told(); else requestAnimationFrame(() => requestAnimationFrame(told));
    }
  }
  requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
_SHOWN = {
    "connect": ".chips",
    "robot": ".host[data-shows-robot]",
    "solid": "canvas[data-shows-robot]",
    "empty": "canvas[data-engine]",
}

_PRESS = """
globalThis.pressed = null;
const row = document.querySelector('.row');
let began = null;
addEventListener('keydown', ({code, repeat, timeStamp}) => {
  if (code === 'Digit1' && !repeat) [began, pressed] = [timeStamp, null];
}, true);
new MutationObserver(() => {
  if (began === null) return;
  pressed = performance.now() - began;
  began = null;
}).observe(row, {subtree: true, childList: true, characterData: true});
"""


def benchmarks() -> list[Benchmark]:
    """Return what a person waits for at the page, and how fast its plots are panned."""
    value = partial(Bound, judged=Judged.VALUE)
    name = f"page {SAMPLES:,} samples"
    one, six = partial(_plots, 1), partial(_plots, 6)
    return [
        Benchmark("page press to motion seen", "ms", _press, value(MOST_PRESS), 15),
        Benchmark("page connect screen", "ms", partial(_load, "connect"), value(MOST_CONNECT), 7),
        Benchmark("page robot of sticks", "ms", partial(_load, "robot"), value(MOST_STICKS), 7),
        Benchmark("page robot in 3-D, empty page", "ms", _solid, Bound(MOST_RATIO_3D), 15),
        Benchmark(f"{name}, a joint, pan", "ms/picture", one, value(MOST_PICTURE), 5),
        Benchmark(f"{name}, six joints, pan", "ms/picture", six, None, 3),
    ]


@contextmanager
def _browser(drawing: tuple[str, ...]) -> Iterator[Any]:
    missing = [each for each in ("chromium", "chromedriver") if shutil.which(each) is None]
    if find_spec("selenium") is None or missing:
        what = " and no ".join([*missing, *([] if find_spec("selenium") else ["selenium"])])
        raise MissingRequirement(f"there is no {what} here, to drive a browser")
    from selenium import webdriver  # the other rows need none

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in (*_FLAGS, *drawing):
        options.add_argument(flag)
    driver = webdriver.Chrome(
        options=options, service=webdriver.ChromeService(shutil.which("chromedriver"))
    )
    try:
        driver.execute_cdp_cmd("Network.enable", {})
        driver.execute_cdp_cmd("Network.setCacheDisabled", {"cacheDisabled": True})
        yield driver
    finally:
        driver.quit()


@contextmanager
def _served() -> Iterator[str]:
    """Run emulator, server and gateway; yields the address of the page."""
    if find_spec("aiohttp") is None:
        raise MissingRequirement("aiohttp is not installed (extra web)")
    if not (PAGE / "index.html").is_file():
        raise MissingRequirement("the page is not built (make pendant)")
    with ExitStack() as stack:
        emulator = stack.enter_context(process(*EMULATOR))
        controller = f"127.0.0.1:{emulator['motion']}:{emulator['state']}"
        server = stack.enter_context(
            process(*SERVER, "--controller", controller, "--emulated", "--signals", "openpendant")
        )
        address = f"cell=127.0.0.1:{server['pendant']}"
        yield str(stack.enter_context(_gateway(PAGE, address))["page"])


@contextmanager
def _gateway(page: Path, server: str) -> Iterator[dict[str, int]]:
    web = ("openpendant.tools", "web", "--json", "--port", "0", "--page", str(page))
    with process(*web, "--server", server) as ready:
        yield ready


def _wait(driver: Any, condition: str) -> Any:
    until = time.monotonic() + _WITHIN
    while not (found := driver.execute_script(f"return {condition}")):
        if time.monotonic() > until:
            raise RuntimeError(f"the page did not come to {condition}")
        time.sleep(0.01)
    return found


def _first_seen(driver: Any, address: str, name: str) -> float:
    driver.get(address)
    return float(_wait(driver, f"globalThis.seen?.{name}"))


def _watch(driver: Any) -> None:
    script = _FIRST_SEEN % json.dumps(_SHOWN)
    driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})


@contextmanager
def _load(name: str) -> Iterator[Sides]:
    with _browser(_WITHOUT_3D) as driver, _served() as page:
        _watch(driver)
        yield Sides(partial(_first_seen, driver, page, name))


@contextmanager
def _solid() -> Iterator[Sides]:
    with ExitStack() as stack:
        driver = stack.enter_context(_browser(_WITH_3D))
        page = stack.enter_context(_served())
        bare = stack.enter_context(_bench_pages())
        _watch(driver)
        yield Sides(
            partial(_first_seen, driver, page, "solid"),
            partial(_first_seen, driver, f"{bare}empty.html", "empty"),
        )


@contextmanager
def _plots(joints: int) -> Iterator[Sides]:
    with _browser(_WITHOUT_3D) as driver, _bench_pages() as pages:
        driver.set_script_timeout(_WITHIN)
        driver.get(f"{pages}plots.html?samples={SAMPLES}&joints={joints}")
        _wait(driver, "typeof globalThis.pan === 'function'")

        def panned() -> float:
            return float(driver.execute_async_script(f"pan({_PAN}).then(arguments[0])"))

        yield Sides(panned)


@contextmanager
def _bench_pages() -> Iterator[str]:
    """Build the pages of the benchmarks into a folder of their own, and serve them."""
    tools = node_tools()
    vite = FRONTEND / "node_modules" / "vite" / "bin" / "vite.js"
    if tools is None or not vite.is_file():
        raise MissingRequirement("Node.js or what builds the page is not here (make browser)")
    with tempfile.TemporaryDirectory() as folder:
        build = [tools.node, str(vite), "build", "-c", "bench/vite.config.ts", "--outDir", folder]
        quiet = ["--emptyOutDir", "--logLevel", "error"]
        if subprocess.run([*build, *quiet], cwd=FRONTEND, check=False).returncode:
            raise NotBuilt("vite failed")
        with _gateway(Path(folder), "none=127.0.0.1:1") as ready:
            yield str(ready["page"])


@contextmanager
def _press() -> Iterator[Sides]:
    with _browser(_WITHOUT_3D) as driver, _served() as page:
        driver.get(page)
        chips = "document.querySelector('.chips')?.innerText.includes('%s')"
        _wait(driver, chips % "Nobody")
        _key(driver, "keyDown", "KeyC", "c")
        _key(driver, "keyUp", "KeyC", "c")
        _wait(driver, chips % "You")
        _key(driver, "keyDown", "KeyM", "m")
        _key(driver, "keyUp", "KeyM", "m")
        _wait(driver, chips % "T1")
        driver.execute_script("document.querySelector('.checklist .quiet').click()")
        _key(driver, "keyDown", "KeyV", "v")
        _wait(driver, "document.querySelector('.jog-key:not([aria-disabled])') !== null")
        driver.execute_script(_PRESS)

        def pressed() -> float:
            _key(driver, "keyDown", "Digit1", "1")
            seen = float(_wait(driver, "globalThis.pressed"))
            _key(driver, "keyUp", "Digit1", "1")
            _wait(driver, f"!({chips % 'Jogging'})")
            time.sleep(0.1)
            return seen

        yield Sides(pressed)


def _key(driver: Any, kind: str, code: str, key: str) -> None:
    driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "code": code, "key": key})
