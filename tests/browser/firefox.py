"""A headless Firefox, driven by WebDriver BiDi: its debugging port speaks that without a driver."""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from browser.page_rig import UP_WITHIN, Page, PageRig

NAMES = ("firefox-esr", "firefox")
SIZE = {"width": 1366, "height": 820}
_LISTENS = re.compile(rb"WebDriver BiDi listening on (ws://\S+)")
_SHIFT = "\ue008"
_SHIFTED = 8
"""Of the modifiers of a key."""

_PREFERENCES = {
    # Headless it draws in three dimensions nowhere here; elsewhere it shall not either.
    "webgl.disabled": True,
    "browser.shell.checkDefaultBrowser": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.reportingpolicy.firstRun": False,
}


def firefox_program() -> str | None:
    """Return where Firefox is; None where it is not."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


class Firefox:
    """One window; has what a page needs of a driver of selenium."""

    def __init__(self, program: str, profile: Path) -> None:
        """Start it and open a session.

        Args:
            profile: an empty folder.
        """
        told = (f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in _PREFERENCES.items())
        (profile / "user.js").write_text("\n".join(told), "utf-8")
        errors = profile / "errors.log"
        command = [program, "--headless", "--no-remote", "--profile", str(profile)]
        command += ["--remote-debugging-port", "0", "about:blank"]
        with errors.open("wb") as log:
            self._process = subprocess.Popen(command, stdout=log, stderr=log)
        self._loop = asyncio.new_event_loop()
        self._last = 0
        try:
            self._loop.run_until_complete(self._connect(_listens_at(errors)))
        except BaseException:
            self._end()
            raise

    async def _connect(self, address: str) -> None:
        from aiohttp import ClientSession  # an extra, which only tests of browsers need here

        self._session = ClientSession()
        self._socket = await self._session.ws_connect(f"{address}/session", max_msg_size=0)
        await self._ask("session.new", capabilities={})
        tree = await self._ask("browsingContext.getTree")
        self._window = tree["contexts"][0]["context"]
        await self._ask("browsingContext.setViewport", context=self._window, viewport=SIZE)

    async def _ask(self, method: str, **params: object) -> Any:
        self._last += 1
        await self._socket.send_json({"id": self._last, "method": method, "params": params})
        async with asyncio.timeout(60):
            while (answer := await self._socket.receive_json()).get("id") != self._last:
                pass
        assert answer["type"] == "success", f"{method}: {answer}"
        return answer["result"]

    def command(self, method: str, **params: object) -> Any:
        """Carry out a command on the window, and return its result."""
        return self._loop.run_until_complete(self._ask(method, context=self._window, **params))

    def get(self, address: str) -> None:
        """Go to an address."""
        self.command("browsingContext.navigate", url=address, wait="complete")

    def refresh(self) -> None:
        """Load the page anew."""
        self.command("browsingContext.reload", wait="complete")

    def execute_script(self, script: str) -> Any:
        """Run the body of a function, and return what it returns."""
        called = self._loop.run_until_complete(
            self._ask(
                "script.callFunction",
                functionDeclaration=f"() => JSON.stringify((() => {{ {script} }})() ?? null)",
                target={"context": self._window},
                awaitPromise=False,
            )
        )
        assert called["type"] == "success", called
        return json.loads(called["result"]["value"])

    def act(self, source: Mapping[str, object], *actions: Mapping[str, object]) -> None:
        """Have a keyboard, mouse or finger do something."""
        self.command("input.performActions", actions=[{**source, "actions": actions}])

    def quit(self) -> None:
        """End the session and the browser."""
        self._loop.run_until_complete(self._close())
        self._end()

    async def _close(self) -> None:
        await self._ask("session.end")
        await self._socket.close()
        await self._session.close()

    def _end(self) -> None:
        self._process.terminate()
        self._process.wait(20)
        self._loop.close()


def _listens_at(log: Path) -> str:
    until = time.monotonic() + UP_WITHIN
    while (found := _LISTENS.search(log.read_bytes())) is None:
        assert time.monotonic() < until, "Firefox does not listen"
        time.sleep(0.05)
    return found[1].decode()


class FirefoxPage(Page):
    """What a person does at a page in Firefox."""

    browser = "Firefox"

    def __init__(self, rig: PageRig, firefox: Firefox, address: str) -> None:
        """Show nothing yet."""
        super().__init__(rig, firefox, address)
        self._firefox = firefox
        self._shifted: set[str] = set()

    def looks(self, condition: str) -> bool:
        """Return whether the page shows something now, and let it go on for a moment if not."""
        if self.run(f"return Boolean({condition})"):
            return True
        time.sleep(0.02)
        return False

    def do(self, script: str) -> None:
        """Have the page do something at once."""
        self.run(script)

    def key(self, down: bool, code: str, key: str, modifiers: int = 0) -> None:
        """Press or let go a key, and Shift with the first and the last that want it."""
        (self._downs.add if down else self._downs.discard)((code, key))
        value = code.removeprefix("Digit") if code.startswith("Digit") else key
        actions: list[dict[str, object]] = [
            {"type": "keyDown" if down else "keyUp", "value": value}
        ]
        if down and modifiers & _SHIFTED:
            if not self._shifted:
                actions.insert(0, {"type": "keyDown", "value": _SHIFT})
            self._shifted.add(code)
        elif not down and code in self._shifted:
            self._shifted.discard(code)
            if not self._shifted:
                actions.append({"type": "keyUp", "value": _SHIFT})
        self._firefox.act({"type": "key", "id": "keyboard"}, *actions)

    def mouse(self, kind: str, at: tuple[float, float], button: str = "left") -> None:
        """Move the mouse, or press or let go its button, which is the left one."""
        self._point("mouse", kind, at)

    def touch(self, kind: str, *points: tuple[float, float]) -> None:
        """Put one finger on the page, move it, or lift it where there is no point."""
        kinds = {
            "touchStart": "mousePressed",
            "touchMove": "mouseMoved",
            "touchEnd": "mouseReleased",
        }
        self._point("touch", kinds[kind], *points)

    def put_finger(self, at: tuple[float, float]) -> None:
        """Put a finger on the page."""
        self.touch("touchStart", at)

    def lift_finger(self) -> float:
        """Lift it; return when, which is when the browser was told."""
        began = time.monotonic()
        self.touch("touchEnd")
        return began

    def _point(self, pointer: str, kind: str, *points: tuple[float, float]) -> None:
        moves = [
            {"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0} for x, y in points
        ]
        presses = {"mousePressed": "pointerDown", "mouseReleased": "pointerUp"}
        press = [{"type": presses[kind], "button": 0}] if kind in presses else []
        source = {"type": "pointer", "id": pointer, "parameters": {"pointerType": pointer}}
        self._firefox.act(source, *moves, *press)
