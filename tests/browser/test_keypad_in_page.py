"""The keypad in the page: its line through the gateway, its bridge, the robot that it moves."""

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.warm_start import WarmProcess

from browser.page_rig import Page, PageRig, free_port, show_at
from browser.wcag import broken_rules
from openpendant.tools.pendants.keypad.keys import LABELS

pytestmark = pytest.mark.realtime

MODE, STOP, CONTROL, T1_T2 = "C", "D", "*", "#"
READY = "T1 JOINT      * en--"


class KeypadPage(Page):
    """A page that shows its keypad; it looks on itself, so that the keypad is in control."""

    gateway: WarmProcess

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
    with PageRig(Path(tmp_path_factory.mktemp("keypad")), driver) as rig:
        yield rig
        driver.get("about:blank")


@pytest.fixture(name="page", scope="module")
def _page(rig: PageRig) -> KeypadPage:
    """A page whose keypad holds control in T1, which it took by its own keys."""
    port, line = free_port(), free_port()
    page = KeypadPage(rig, rig.page().driver, f"http://127.0.0.1:{port}/")
    page.gateway = rig.start_gateway(port, keypad=line)
    page.open()
    page.show_keypad()
    page.shows("NO BRIDGE           ", "USE THE ROBOT'S OWN ")
    rig.start_bridge(line)
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


_NOTE_STOP_KEY = """
  const key = document.querySelector('.stop-key');
  new MutationObserver(() => {
    window.stopKeyWasDown ||= key.classList.contains('held');
  }).observe(key, {attributes: true});
"""
AWAY = (300.0, 400.0)


def _off_the_key(page: KeypadPage) -> None:
    page.mouse("mouseMoved", AWAY)


def _blur(page: KeypadPage) -> None:
    page.do("dispatchEvent(new Event('blur'))")


def _escape(page: KeypadPage) -> None:
    page.tap_key("Escape", "Escape")


def _frozen(page: KeypadPage) -> None:
    page.run("const until = performance.now() + 700; while (performance.now() < until);")


LETS_GO = {
    "the pointer leaves the key": _off_the_key,
    "the window loses the focus": _blur,
    "Esc": _escape,
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


def test_space_stops_by_the_page_and_by_the_keypad_and_mode_resets_it(keypad: KeypadPage) -> None:
    keypad.run(_NOTE_STOP_KEY)
    keypad.down("1")
    keypad.rig.tap.wait_for_steady(0)
    keypad.tap_key("Space", " ")
    keypad.rig.tap.wait_for_rest()
    keypad.up()
    keypad.shows("STOP browser        ", "STOP in the browser ")
    keypad.wait("window.stopKeyWasDown")
    keypad.strike(MODE, held=2.2)


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
