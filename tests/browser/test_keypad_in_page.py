"""The keypad in the page: its line through the gateway, its bridge, the robot that it moves."""

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.warm_start import WarmProcess

from browser.page_rig import Page, PageRig, free_port, own_tab, show_at
from browser.wcag import broken_rules
from openpendant.simplemsg.serial_frames import FrameReader, KeyDown, LineWay
from openpendant.tools.pendants.keypad.keys import LABELS

pytestmark = pytest.mark.realtime

MODE, STOP, CONTROL, T1_T2 = "C", "D", "*", "#"
READY = "T1 JOINT      * en--"


class KeypadPage(Page):
    """A page that shows its keypad; it looks on itself, so that the keypad is in control.

    Attributes:
        bridge_log: what the bridge said.
    """

    gateway: WarmProcess
    bridge_log: Path

    def shows(self, *rows: str, within: float = 10.0) -> None:
        """Wait until the display begins with these rows, character by character."""
        shown = f"[...document.querySelectorAll('.glass div')].slice(0, {len(rows)})"
        wanted = json.dumps(list(rows))
        try:
            self.wait(
                f"JSON.stringify({shown}.map(row => row.textContent)) === JSON.stringify({wanted})",
                within,
            )
        except AssertionError as error:
            raise AssertionError(f"{error}; it shows {self.display()}") from None

    def display(self) -> list[str]:
        rows: list[str] = self.run(
            "return [...document.querySelectorAll('.glass div')].map(row => row.textContent)"
        )
        return rows

    def at_key(self, label: str) -> tuple[float, float]:
        """Return the middle of a key."""
        key = f"document.querySelectorAll('.keys button')[{LABELS.index(label)}]"
        box = f"const b = {key}.getBoundingClientRect()"
        x, y = self.run(f"{box}; return [b.x + b.width / 2, b.y + b.height / 2]")
        return x, y

    def down(self, label: str) -> None:
        """Press a key once all are up and the bridge knows it, as a hand would."""
        self.wait("document.querySelector('.keys .held') === null")
        self.run("return new Promise(over => setTimeout(over, 50))")
        self.mouse("mousePressed", self.at_key(label))

    def up(self) -> None:
        self.mouse("mouseReleased", self._at)

    def strike(self, label: str, held: float = 0.1) -> None:
        """Hold a key for a while [s]."""
        self.down(label)
        self.run(f"return new Promise(over => setTimeout(over, {1000 * held}))")
        self.up()

    def show_keypad(self) -> None:
        self.run("document.querySelector('[data-task=keypad]').click()")
        self.run("document.querySelector('.checklist .quiet').click()")


@pytest.fixture(name="rig", scope="module")
def _rig(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    folder = Path(tmp_path_factory.mktemp("keypad"))
    with own_tab(driver), PageRig(folder, driver) as rig:
        yield rig


@pytest.fixture(name="page", scope="module")
def _page(rig: PageRig) -> KeypadPage:
    """A page whose keypad holds control in T1, which it took by its own keys."""
    port, line = free_port(), free_port()
    page = KeypadPage(rig, rig.page().driver, f"http://127.0.0.1:{port}/")
    page.gateway = rig.start_gateway(port, keypad=line)
    page.open()
    page.show_keypad()
    page.shows("NO BRIDGE           ", "USE THE ROBOT'S OWN ")
    page.bridge_log = rig.start_bridge(line)
    page.shows("AUTO JOINT    o en--", within=20)
    page.strike(MODE, held=1.0)
    page.shows("REC    PLAY   UP    ", "TEACH  UNDO   DOWN  ")
    page.strike(CONTROL)
    page.wait("document.querySelector('.chips').innerText.includes('keypad')")
    page.strike(T1_T2)
    page.wait("document.querySelector('.chips').innerText.includes('T1')")
    page.run("return new Promise(over => setTimeout(over, 200))")  # the bridge hears of it, too
    page.strike(MODE)
    page.shows(READY)
    return page


@pytest.fixture
def keypad(page: KeypadPage) -> Iterator[KeypadPage]:
    """The keypad, with control and nothing held."""
    page.shows(READY)
    page.rig.tap.forget()
    yield page
    page.let_all_go()
    page.rig.tap.wait_for_rest()


def test_a_held_key_jogs_its_joint_until_it_is_let_go(keypad: KeypadPage) -> None:
    keypad.down("1")
    keypad.rig.tap.wait_for_steady(0)
    keypad.shows("T1 JOINT      * EN  ")
    keypad.picture("keypad")
    keypad.up()
    keypad.rig.tap.wait_for_rest()
    keypad.rig.tap.stays_at_rest()
    keypad.shows(READY)


def test_two_fingers_jog_two_joints(keypad: KeypadPage) -> None:
    fingers = keypad.at_key("1"), keypad.at_key("8")
    keypad.touch("touchStart", fingers[0])
    keypad.touch("touchStart", *fingers)
    try:
        keypad.rig.tap.wait_for_steady(0)
        keypad.rig.tap.wait_for_steady(4)
    finally:
        keypad.touch("touchEnd")
    keypad.rig.tap.wait_for_rest()
    keypad.rig.tap.stays_at_rest()


_NOTE_LINE = """
  window.saidOnLine = [];
  const send = window.sendOfSocket ??= WebSocket.prototype.send;
  WebSocket.prototype.send = function (data) {
    if (this.url.endsWith('/keypad')) window.saidOnLine.push(...data);
    return send.call(this, data);
  };
"""
AWAY = (300.0, 400.0)


def _off_the_key(page: KeypadPage) -> None:
    page.mouse("mouseMoved", AWAY)


def _blur(page: KeypadPage) -> None:
    page.do("dispatchEvent(new Event('blur'))")


def _escape(page: KeypadPage) -> None:
    page.tap_key("Escape", "Escape")


def _modifier(page: KeypadPage) -> None:
    page.tap_key("MetaLeft", "Meta")


def _frozen(page: KeypadPage) -> None:
    page.run("const until = performance.now() + 700; while (performance.now() < until);")


LETS_GO = {
    "the pointer leaves the key": _off_the_key,
    "the window loses the focus": _blur,
    "Esc": _escape,
    "a modifier goes down": _modifier,
    "the page is frozen": _frozen,
}


@pytest.mark.parametrize("how", LETS_GO)
def test_what_lets_go_stands_and_needs_the_key_again(keypad: KeypadPage, how: str) -> None:
    keypad.down("1")
    keypad.rig.tap.wait_for_steady(0)
    LETS_GO[how](keypad)
    keypad.rig.tap.wait_for_rest()
    keypad.rig.tap.stays_at_rest()
    keypad.up()


def test_a_hidden_page_is_a_pulled_cable(keypad: KeypadPage) -> None:
    keypad.down("1")
    keypad.rig.tap.wait_for_steady(0)
    keypad.run(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange'));"
    )
    keypad.rig.tap.wait_for_rest()
    keypad.rig.tap.stays_at_rest()
    keypad.up()
    keypad.run("delete document.hidden; document.dispatchEvent(new Event('visibilitychange'));")
    keypad.rig.tap.stays_at_rest()
    assert "unplugged; what it held was released" in keypad.bridge_log.read_text("utf-8")


def test_space_stops_by_the_page_and_by_the_keypad_and_mode_resets_it(keypad: KeypadPage) -> None:
    keypad.run(_NOTE_LINE)
    keypad.down("1")
    keypad.rig.tap.wait_for_steady(0)
    keypad.tap_key("Space", " ")
    keypad.rig.tap.wait_for_rest()
    keypad.up()
    keypad.shows("STOP browser        ", "STOP in the browser ")
    assert _stops_on_line(keypad) == 1
    keypad.strike(MODE, held=2.2)


def _stops_on_line(page: KeypadPage) -> int:
    """Return how often the keypad has told that its STOP went down."""
    said = FrameReader(LineWay.TO_HOST).receive(bytes(page.run("return window.saidOnLine")))
    return sum(isinstance(frame, KeyDown) and frame.key == LABELS.index(STOP) for _, frame in said)


def test_a_stop_that_is_pressed_and_let_go_while_the_page_hangs_stops(keypad: KeypadPage) -> None:
    keypad.run(
        "const stop = document.querySelector('.stop-key');"
        "const told = {bubbles: true, pointerId: 1, button: 0};"
        "stop.dispatchEvent(new PointerEvent('pointerdown', told));"
        "window.dispatchEvent(new PointerEvent('pointerup', told));"
        "const until = performance.now() + 300; while (performance.now() < until);"
    )
    keypad.shows("STOP keypad         ", "STOP key            ")
    keypad.strike(MODE, held=2.2)


def test_enter_holds_the_key_that_has_the_focus(keypad: KeypadPage) -> None:
    keypad.run("document.querySelectorAll('.keys button')[0].focus()")
    keypad.key(True, "Enter", "Enter")
    keypad.rig.tap.wait_for_steady(0)
    keypad.key(False, "Enter", "Enter")
    keypad.rig.tap.wait_for_rest()
    keypad.rig.tap.stays_at_rest()


def test_a_click_without_a_pointer_stops_or_explains_and_moves_nothing(keypad: KeypadPage) -> None:
    keypad.run("document.querySelectorAll('.keys button')[0].click()")
    keypad.wait("document.querySelector('.banners').innerText.includes('Hold this key')")
    keypad.rig.tap.stays_at_rest()
    keypad.run("document.querySelector('.stop-key').click()")
    keypad.shows("STOP keypad         ")
    keypad.strike(MODE, held=2.2)


def test_in_another_language_and_theme_space_is_still_the_keypads_stop(
    keypad: KeypadPage,
) -> None:
    def choose(word: str) -> None:
        buttons = "[...document.querySelectorAll('.setting button')]"
        keypad.run(f"{buttons}.find(e => e.textContent === '{word}').click()")

    choose("Deutsch")
    keypad.wait("document.documentElement.lang === 'de'")
    keypad.shows("T1 JOINT      * en--")
    choose("Hell")
    keypad.run(_NOTE_LINE)
    keypad.tap_key("Space", " ")
    keypad.shows("STOP browser        ")
    keypad.wait("document.querySelector('.keys .held') === null")
    assert _stops_on_line(keypad) == 1
    keypad.strike(MODE, held=2.2)
    choose("English")
    keypad.wait("document.documentElement.lang === 'en'")
    choose("Dark")


def test_the_stop_key_stops_a_robot_that_stands(keypad: KeypadPage) -> None:
    keypad.strike(STOP)
    keypad.shows("STOP keypad         ")
    keypad.wait("document.querySelector('.frame').dataset.state === 'stopped'")
    keypad.strike(MODE, held=2.2)


def test_the_keypad_breaks_no_rule_of_wcag_2_2_aa(keypad: KeypadPage) -> None:
    assert broken_rules(keypad) == {}


def test_the_keypad_scrolls_nothing_sideways_on_a_narrow_phone(keypad: KeypadPage) -> None:
    show_at(keypad.driver, 320, 700)
    try:
        assert keypad.run("return document.documentElement.scrollWidth") <= 320
    finally:
        show_at(keypad.driver, 1366, 820)


def test_a_gateway_that_is_killed_lets_go(keypad: KeypadPage) -> None:
    """The last of them: it takes the page's own link, too."""
    keypad.down("1")
    keypad.rig.tap.wait_for_steady(0)
    keypad.gateway.send_signal(signal.SIGKILL)
    keypad.rig.tap.wait_for_rest()
    keypad.rig.tap.stays_at_rest()
    keypad.up()
    keypad.wait("document.querySelector('.keypad [role=status]').innerText.includes('No line')")
