"""A robot moves only as long as a hand is on the page: how soon the ramp begins when it leaves.

Times run from the test's command to the first set-point of the ramp, or the STOP, at the emulator;
for a finger that is lifted, from when the browser takes that, since its driver keeps it back first.
After each trial nothing moves while the button is held on.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import cycle

import pytest

from browser.hold_trials import ALONE, TICK, HoldTrials, ready_to_hold
from browser.motion_tap import RAMP_IS_OVER, Ended
from browser.page_rig import Page, PageRig

pytestmark = pytest.mark.realtime

AWAY = (500.0, 400.0)
DEADLINE = 0.25
"""What the page declares for enabling and for each press [s]."""
RELEASED, SLID_OFF, LEFT = 0.020, 0.150, 0.050
"""From a hand that lets go, slides off or leaves the page to the ramp [s]."""
Act = Callable[[Page, tuple[float, float]], float | None]
"""What a hand does at a place; returns when it was taken where that is not when it was told."""


@pytest.fixture
def page(page_rig: PageRig) -> Iterator[Page]:
    """A page that holds control in T1, with nothing held, made ready while nobody measures."""
    page = page_rig.page()
    ready_to_hold(page)
    yield page
    page.let_all_go()


def _mouse_down(page: Page, at: tuple[float, float]) -> None:
    page.mouse("mouseMoved", at)
    page.mouse("mousePressed", at)


def _mouse_up(page: Page, at: tuple[float, float]) -> None:
    page.mouse("mouseReleased", at)


def _touch_down(page: Page, at: tuple[float, float]) -> None:
    page.put_finger(at)


def _touch_up(page: Page, _: tuple[float, float]) -> float:
    return page.lift_finger()


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
    page.do("dispatchEvent(new Event('blur'))")


def _hide(page: Page, _: tuple[float, float]) -> None:
    page.do(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange')); delete document.hidden;"
    )


def _page_hide(page: Page, _: tuple[float, float]) -> None:
    page.do("dispatchEvent(new Event('pagehide'))")


def _context_menu(page: Page, _: tuple[float, float]) -> None:
    page.do("document.dispatchEvent(new Event('contextmenu', {bubbles: true}))")


def _enabling_up(page: Page, _: tuple[float, float]) -> None:
    page.key(False, "KeyV", "v")


def _trial(page: Page, side: str, down: Act, go: Act, up: Act) -> Ended:
    page.stay_enabled()
    at = page.place(0, side)
    with ALONE:
        page.rig.tap.forget()
        down(page, at)
        page.rig.tap.wait_for_steady(0)
        began = time.monotonic()
        taken = go(page, at)
        page.rig.tap.wait_for_rest(at_rest=RAMP_IS_OVER)
    page.rig.tap.wait_for_rest()
    found = page.rig.tap.end_of_steady(0, began)
    page.rig.tap.stays_at_rest()
    page.stands()
    if taken is not None:
        found = replace(found, began=taken)
    if go is not up:
        up(page, at)
    return found


WAYS = {
    "the pointer is let go": (_mouse_down, _mouse_up, _mouse_up, RELEASED),
    "a finger is lifted": (_touch_down, _touch_up, _touch_up, RELEASED),
    "a key comes up": (_digit_down, _digit_up, _digit_up, RELEASED),
    "the pointer slides off": (_mouse_down, _slide_off, _mouse_up, SLID_OFF),
    "a finger slides off": (_touch_down, _finger_off, _touch_up, SLID_OFF),
    "the window loses the focus": (_mouse_down, _blur, _mouse_up, LEFT),
    "the page is hidden": (_mouse_down, _hide, _mouse_up, LEFT),
    "a context menu opens": (_mouse_down, _context_menu, _mouse_up, LEFT),
    "the page goes away": (_mouse_down, _page_hide, _mouse_up, LEFT),
    "enabling is let go": (_mouse_down, _enabling_up, _mouse_up, RELEASED),
}


def ramp_begins_in_time(page: Page, *names: str) -> None:
    """Try ways of letting go in a browser, in turns; they have the bound of the first."""
    turns = cycle([WAYS[name][:3] for name in names])
    trials = HoldTrials(f"{page.browser}: {', '.join(names)}", WAYS[names[0]][3])
    trials.run(lambda side: _trial(page, side, *next(turns)), partial(ready_to_hold, page))
    trials.judge()


@pytest.mark.parametrize("name", WAYS)
def test_the_ramp_begins_soon_after(page: Page, name: str) -> None:
    ramp_begins_in_time(page, name)


def the_other_key_goes_on(page: Page) -> None:
    """Hold two keys in a browser, and let one go."""

    def trial(side: str) -> Ended:
        page.stay_enabled()
        modifiers = 8 if side == "minus" else 0
        with ALONE:
            page.rig.tap.forget()
            page.key(True, "Digit1", "1", modifiers)
            page.key(True, "Digit6", "6", modifiers)
            page.rig.tap.wait_for_steady(0)
            began = time.monotonic()
            page.key(False, "Digit1", "1", modifiers)
            time.sleep(0.3)
        found = page.rig.tap.end_of_steady(0, began)
        later = [each for each in page.rig.tap.seen() if each.at > began + 0.2]
        other = [each.joints[5] for each in later if each.joints]
        assert len(other) > 5, "the other joint went on"
        assert abs(other[-1] - other[0]) > 1e-3
        page.key(False, "Digit6", "6", modifiers)
        page.rig.tap.wait_for_rest()
        page.rig.tap.stays_at_rest()
        page.stands()
        return found

    trials = HoldTrials(f"{page.browser}: one of two keys", RELEASED)
    trials.run(trial, partial(ready_to_hold, page))
    trials.judge()


def test_of_two_keys_that_are_held_the_other_goes_on(page: Page) -> None:
    the_other_key_goes_on(page)


def test_a_page_whose_thread_is_frozen_ends_as_silent_and_never_moves_again(page: Page) -> None:
    def trial(side: str) -> Ended:
        page.stay_enabled()
        with ALONE:
            page.rig.tap.forget()
            _mouse_down(page, page.place(0, side))
            page.rig.tap.wait_for_steady(0)
            began = time.monotonic()
            page.run("const until = performance.now() + 700; while (performance.now() < until);")
            page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        page.rig.tap.stays_at_rest()
        page.stands()
        _mouse_up(page, AWAY)
        return found

    trials = HoldTrials("frozen", DEADLINE + TICK)
    trials.run(trial, partial(ready_to_hold, page))
    trials.judge()
