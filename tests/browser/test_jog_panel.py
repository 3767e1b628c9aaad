"""What the jog panel does besides holding a key: steps, typed targets, home, zero and undo."""

import math
from collections.abc import Callable

import pytest

from browser.page_rig import Page

pytestmark = pytest.mark.realtime

NEAR = 0.002
"""Of a value that is shown rounded, or of a robot that has just arrived [rad]."""


def _joints(page: Page) -> list[float]:
    """Return the joints as the page shows them [rad]."""
    shown = page.run("return [...document.querySelectorAll('.rows .value')].map(e => e.innerText)")
    return [math.radians(float(each.rstrip("°"))) for each in shown]


def _press_button(page: Page, text: str) -> Callable[[], None]:
    """Hold the button that begins with a text, by the pointer; return how to let it go."""
    find = (
        f"[...document.querySelectorAll('.jog button')].find(b => b.innerText.startsWith({text!r}))"
    )
    page.wait(f"{find} && !{find}.hasAttribute('aria-disabled')")
    page.run(f"{find}.scrollIntoView({{block: 'center'}})")
    x, y = page.run(
        f"const b = {find}.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]"
    )
    page.mouse("mouseMoved", (x, y))
    page.mouse("mousePressed", (x, y))
    return lambda: page.mouse("mouseReleased", (x, y))


def _settles(page: Page) -> None:
    page.rig.tap.wait_for_rest(20)
    page.wait("['Ready'].some(w => document.querySelector('.chips').innerText.includes(w))")


def _choose_step(page: Page, size: int) -> None:
    find = (
        f"[...document.querySelectorAll('.steps button')].find(b => b.innerText === 'Step {size}')"
    )
    page.run(f"{find}.click()")
    page.wait(f"{find}.classList.contains('chosen')")


def test_a_step_moves_by_what_its_button_says(page: Page) -> None:
    page.hold_enabling()
    _choose_step(page, 1)
    before = _joints(page)
    page.tap_key("Digit6", "6")
    page.wait(
        f"Math.abs(parseFloat(document.querySelectorAll('.rows .value')[5].innerText) -"
        f" {math.degrees(before[5]) + 1:.2f}) < 0.05"
    )
    _settles(page)
    moved = [now - then for now, then in zip(_joints(page), before, strict=True)]
    assert moved == pytest.approx([0, 0, 0, 0, 0, math.radians(1)], abs=NEAR)


def test_a_step_that_is_asked_for_while_the_robot_moves_says_that_it_still_moves(
    page: Page,
) -> None:
    page.hold_enabling()
    _choose_step(page, 10)
    page.tap_key("Digit6", "6")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    page.tap_key("Digit6", "6")
    page.wait("document.querySelector('.note').innerText.includes('still moves')")
    _settles(page)


def test_a_typed_target_moves_as_long_as_its_button_is_held_and_no_further(page: Page) -> None:
    page.hold_enabling()
    goal = round(math.degrees(_joints(page)[0])) + 12
    page.run("document.querySelectorAll('.value-box')[0].click()")
    page.key(False, "KeyV", "v")
    page.driver.switch_to.active_element.send_keys(f"{goal},5")
    page.run("document.activeElement.blur()")
    page.hold_enabling()
    up = _press_button(page, "Hold to go to")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    up()
    _settles(page)
    halfway = math.degrees(_joints(page)[0])
    assert halfway < goal, "it stood where it was let go"
    up = _press_button(page, "Hold to go to")
    page.wait(
        f"Math.abs(parseFloat(document.querySelector('.rows .value').innerText) -"
        f" {goal + 0.5}) < 0.02"
    )
    up()
    _settles(page)


def test_home_is_reached_by_holding_and_left_where_it_is_let_go(page: Page) -> None:
    page.hold_enabling()
    page.tap_key("KeyF", "f")
    page.run("document.querySelector('.jog .tabs button').click()")
    up = _press_button(page, "Hold to go to zero")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    up()
    _settles(page)
    stopped_at = _joints(page)
    page.rig.tap.forget()
    assert _joints(page) == pytest.approx(stopped_at, abs=NEAR)
    up = _press_button(page, "Hold to go home")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    page.wait("document.querySelector('.chips').innerText.includes('Ready')", within=40)
    up()
    home = _joints(page)
    up = _press_button(page, "Hold to go home")
    page.wait("document.querySelector('.chips').innerText.includes('Ready')")
    up()
    _settles(page)
    assert _joints(page) == pytest.approx(home, abs=NEAR), "home while at home stays there"


def test_undo_leads_back_to_where_the_jog_began(page: Page) -> None:
    page.hold_enabling()
    before = _joints(page)
    page.key(True, "Digit6", "6")
    page.jogs()
    page.wait(
        f"Math.abs(parseFloat(document.querySelectorAll('.rows .value')[5].innerText) -"
        f" {math.degrees(before[5]):.2f}) > 3"
    )
    page.key(False, "Digit6", "6")
    page.stands()
    _settles(page)
    up = _press_button(page, "Hold to undo")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    page.wait("document.querySelector('.chips').innerText.includes('Ready')", within=20)
    up()
    _settles(page)
    assert _joints(page) == pytest.approx(before, abs=NEAR)


def test_another_theme_keeps_what_is_typed_and_another_language_lets_go(page: Page) -> None:
    page.hold_enabling()
    page.key(True, "Digit6", "6")
    page.jogs()
    page.run("document.querySelector('.brand').click()")
    pick = "[...document.querySelectorAll('.card button')].find(b => b.innerText === '{}').click()"
    page.run("document.querySelectorAll('.value-box')[0].click()")
    page.run("document.querySelector('.editor input').value = '12'")
    page.run(pick.format("Light"))
    page.wait("document.documentElement.dataset.theme === 'light'")
    assert page.run("return document.querySelector('.editor input').value") == "12"
    assert "Jogging" in page.text(".chips")
    page.run(pick.format("Deutsch"))
    _settles_in_german(page)
    page.run(pick.format("English"))
    page.run(pick.format("Dark"))
    page.wait("document.querySelector('.chips').innerText.includes('Ready')")


def _settles_in_german(page: Page) -> None:
    page.wait("document.documentElement.lang === 'de'")
    page.rig.tap.wait_for_rest()


MOST_PICTURES = 10
"""Of a robot that stands: clocks are looked at four times a second, states come thirty times."""

MOST_MOVING = 45
"""One for each state, in a second; words and robot drawn one after the other make it sixty."""


def test_a_page_draws_what_moves_and_little_of_a_robot_that_stands(page: Page) -> None:
    page.run(
        "window.pictures = 0; const ask = window.requestAnimationFrame.bind(window);"
        "window.requestAnimationFrame = (draw) => { window.pictures += 1; return ask(draw); }"
    )
    asleep = "return new Promise(over => setTimeout(() => over(window.pictures), {}))"
    for task in ("plan", "scene", "frames", "teach", "jog"):
        page.run(f"document.querySelector('[data-task={task}]').click()")
        page.run("return new Promise(over => setTimeout(over, 400))")
        page.run("window.pictures = 0")
        assert page.run(asleep.format(600)) <= MOST_PICTURES, task
    page.hold_enabling()
    page.key(True, "Digit1", "1")
    page.jogs()
    page.run("window.pictures = 0")
    assert MOST_PICTURES < page.run(asleep.format(1000)) <= MOST_MOVING
