"""A robot moves only as long as a hand is on the page: how soon the ramp begins when it leaves.

Times run from the test's command to the first set-point of the ramp, or the STOP, at the emulator.
"""

import time
from collections.abc import Callable

import pytest

from browser.hold_trials import TICK, HoldTrials
from browser.motion_tap import Ended
from browser.page_rig import Page

pytestmark = pytest.mark.realtime

AWAY = (500.0, 400.0)
JOG_FOR = 0.3
DEADLINE = 0.25
"""What the page declares for enabling and for each press [s]."""
BOUND_OF_A_KEY = 0.020
"""From a key that comes up to the ramp [s]."""
Act = Callable[[Page, tuple[float, float]], None]


def _mouse_down(page: Page, at: tuple[float, float]) -> None:
    page.mouse("mouseMoved", at)
    page.mouse("mousePressed", at)


def _mouse_up(page: Page, at: tuple[float, float]) -> None:
    page.mouse("mouseReleased", at)


def _touch_down(page: Page, at: tuple[float, float]) -> None:
    page.touch("touchStart", at)


def _touch_up(page: Page, _: tuple[float, float]) -> None:
    page.touch("touchEnd")


def _digit_down(page: Page, at: tuple[float, float]) -> None:
    is_minus = at == page.place(0, "minus")
    page.key(True, "Digit1", "!" if is_minus else "1", 8 if is_minus else 0)


def _digit_up(page: Page, _: tuple[float, float]) -> None:
    page.key(False, "Digit1", "1")


def _slide_off(page: Page, _: tuple[float, float]) -> None:
    page.mouse("mouseMoved", AWAY)


def _finger_off(page: Page, _: tuple[float, float]) -> None:
    page.touch("touchMove", AWAY)


def _blur(page: Page, _: tuple[float, float]) -> None:
    page.run("dispatchEvent(new Event('blur'))")


def _context_menu(page: Page, _: tuple[float, float]) -> None:
    page.run("document.dispatchEvent(new Event('contextmenu', {bubbles: true}))")


def _hide(page: Page, _: tuple[float, float]) -> None:
    page.run(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange')); delete document.hidden;"
    )


def _page_hide(page: Page, _: tuple[float, float]) -> None:
    page.run("dispatchEvent(new Event('pagehide'))")


def _enabling_up(page: Page, _: tuple[float, float]) -> None:
    page.key(False, "KeyV", "v")


def _frame_changed(page: Page, _: tuple[float, float]) -> None:
    page.tap_key("KeyF", "f")


def _frame_back(page: Page, at: tuple[float, float]) -> None:
    _mouse_up(page, at)
    page.run("document.querySelector('.jog .tabs button').click()")
    page.wait("document.querySelector('.jog .tabs button').classList.contains('chosen')")


def _trial(page: Page, side: str, down: Act, go: Act, up: Act) -> Ended:
    page.hold_enabling()
    at = page.place(0, side)
    page.rig.tap.forget()
    down(page, at)
    page.jogs()
    time.sleep(JOG_FOR)
    began = time.monotonic()
    go(page, at)
    page.stands()
    page.rig.tap.wait_for_rest()
    found = page.rig.tap.end_of_steady(0, began)
    if go is not up:
        up(page, at)
    page.key(False, "KeyV", "v")
    page.wait("!document.querySelector('.enabling').classList.contains('on')")
    return found


@pytest.mark.parametrize(
    ("down", "go", "up", "bound"),
    [
        pytest.param(_mouse_down, _mouse_up, _mouse_up, 0.020, id="the pointer is let go"),
        pytest.param(_touch_down, _touch_up, _touch_up, 0.020, id="a finger is lifted"),
        pytest.param(_digit_down, _digit_up, _digit_up, 0.020, id="a key comes up"),
        pytest.param(_mouse_down, _slide_off, _mouse_up, 0.150, id="the pointer slides off"),
        pytest.param(_touch_down, _finger_off, _touch_up, 0.150, id="a finger slides off"),
        pytest.param(_mouse_down, _blur, _mouse_up, 0.050, id="the window loses the focus"),
        pytest.param(_mouse_down, _hide, _mouse_up, 0.050, id="the page is hidden"),
        pytest.param(_mouse_down, _page_hide, _mouse_up, 0.050, id="the page goes away"),
        pytest.param(_mouse_down, _context_menu, _mouse_up, 0.050, id="a context menu opens"),
        pytest.param(_mouse_down, _enabling_up, _mouse_up, 0.050, id="enabling is let go"),
        pytest.param(_mouse_down, _frame_changed, _frame_back, 0.050, id="the frame changes"),
    ],
)
def test_the_ramp_begins_soon_after(
    page: Page, down: Act, go: Act, up: Act, bound: float, request: pytest.FixtureRequest
) -> None:
    trials = HoldTrials(request.node.callspec.id)
    trials.run(lambda side: _trial(page, side, down, go, up), page.ready)
    trials.judge(bound)


def test_of_two_keys_that_are_held_the_other_goes_on(page: Page) -> None:
    def trial(side: str) -> Ended:
        page.hold_enabling()
        modifiers = 8 if side == "minus" else 0
        page.rig.tap.forget()
        page.key(True, "Digit1", "1", modifiers)
        page.key(True, "Digit6", "6", modifiers)
        page.jogs()
        time.sleep(JOG_FOR)
        began = time.monotonic()
        page.key(False, "Digit1", "1", modifiers)
        time.sleep(0.5)
        found = page.rig.tap.end_of_steady(0, began)
        other = [each.joints[5] for each in page.rig.tap.seen() if each.at > began + 0.3]
        assert len(other) > 5, "the other joint went on"
        assert abs(other[-1] - other[0]) > 1e-3
        page.key(False, "Digit6", "6", modifiers)
        page.rig.tap.wait_for_rest()
        page.stands()
        page.key(False, "KeyV", "v")
        return found

    trials = HoldTrials("one of two keys")
    trials.run(trial, page.ready)
    trials.judge(0.020)


def test_a_page_that_is_reloaded_stops_the_robot(page: Page) -> None:
    def trial(side: str) -> Ended:
        page.ready()
        page.hold_enabling()
        page.rig.tap.forget()
        _mouse_down(page, page.place(0, side))
        page.jogs()
        time.sleep(JOG_FOR)
        began = time.monotonic()
        page.cdp("Page.reload")
        page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        page.let_all_go()
        return found

    trials = HoldTrials("reloaded")
    trials.run(trial, page.let_all_go)
    trials.judge(0.100, {"stop", "ramp"})


def test_a_page_whose_thread_is_frozen_ends_as_silent_and_never_moves_again(page: Page) -> None:
    def trial(side: str) -> Ended:
        page.hold_enabling()
        page.rig.tap.forget()
        _mouse_down(page, page.place(0, side))
        page.jogs()
        time.sleep(JOG_FOR)
        began = time.monotonic()
        page.run("const until = performance.now() + 700; while (performance.now() < until);")
        page.stands()
        page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        page.rig.tap.forget()
        time.sleep(0.5)
        assert page.rig.tap.seen() == [], "it moved again"
        _mouse_up(page, AWAY)
        page.key(False, "KeyV", "v")
        return found

    trials = HoldTrials("frozen")
    trials.run(trial, page.ready)
    trials.judge(DEADLINE + TICK)


KEPT_FOR = 30.0
"""Enabling that is kept ends so long after the last key or touch [s]."""


def test_enabling_that_is_kept_ends_amid_a_jog_where_nobody_answers(page: Page) -> None:
    page.run(
        "const s = document.querySelector('.speed input'); s.value = 1;"
        "s.dispatchEvent(new Event('input'))"
    )
    x, y = page.run(
        "const b = document.querySelector('.pad').getBoundingClientRect();"
        "return [b.x + b.width / 2, b.y + b.height / 2]"
    )
    _mouse_down(page, (x, y))
    _mouse_up(page, (x, y))
    page.wait("document.querySelector('.chips').innerText.includes('Kept')")
    page.rig.tap.forget()
    began = time.monotonic()
    at = page.place(0, "plus")
    _mouse_down(page, at)
    page.jogs()
    page.wait("document.querySelector('.question').offsetParent", within=KEPT_FOR)
    assert "Are you still there?" in page.text(".question")
    page.wait("document.querySelector('.note').innerText.includes('no key or touch for 30 s')")
    page.stands()
    page.rig.tap.wait_for_rest()
    found = page.rig.tap.end_of_steady(0, began)
    page.rig.tap.forget()
    time.sleep(0.5)
    assert page.rig.tap.seen() == [], "it moved again"
    _mouse_up(page, at)
    assert found.kind == "ramp"
    beat = 0.050  # the page looks at its clock with each beat
    assert 0 <= found.at - began - KEPT_FOR <= beat + BOUND_OF_A_KEY + TICK
