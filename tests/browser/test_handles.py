"""The tool's target is dragged in the picture: asked, shown, and gone to while a button is held."""

import contextlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import pytest

from browser.page_rig import WITH_3D, Page, PageRig, chromium, show_at
from browser.picture_handles import DEEP, boxes, drag, handle
from browser.test_plan import _goal, _task, plans

pytestmark = pytest.mark.realtime

__all__ = ["plans"]

TOLD = "document.querySelector('.reach .told')"
NUMBERS = ".reach .six input"
ASKED = "window.asked"

_COUNT = """
if (window.asked === undefined) {
  window.asked = []; window.open_ = 0; window.mostOpen = 0;
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (data) {
    const text = new TextDecoder('latin1').decode(data);
    if (text.includes('"kinematics.ik"')) window.asked.push(performance.now());
    return send.call(this, data);
  };
}
window.asked = [];
"""


@pytest.fixture
def handles(plans: Page) -> Page:
    """A page at the task of plans, whose goal is where the handles are."""
    plans.run(_COUNT)
    _goal(plans, "")
    plans.wait(f"{TOLD}.innerText.includes('reaches it')")
    return plans


def test_a_dragged_target_is_asked_for_ten_times_a_second_at_most(handles: Page) -> None:
    before = boxes(handles, NUMBERS)
    handles.run(_COUNT)
    drag(handles, handle(handles, "z"), (0.0, 90.0), steps=60, between=lambda: time.sleep(0.02))
    time.sleep(0.5)
    after = boxes(handles, NUMBERS)
    assert after[2] < before[2] - 50.0, "it went down"
    assert after[:2] == before[:2]
    asked = handles.run(f"return {ASKED}")
    assert len(asked) >= 3
    assert min(later - one for one, later in pairwise(asked)) >= 100.0


def test_a_place_that_is_reached_names_its_postures_and_the_tightest_joint(handles: Page) -> None:
    drag(handles, handle(handles, "z"), (0.0, 60.0))
    handles.wait("document.querySelectorAll('.branches button').length > 1")
    assert "left" in handles.text(".reach .told"), "how far the tightest joint is from its limit"
    handles.run("document.querySelectorAll('.branches button')[1].click()")
    handles.wait("document.querySelectorAll('.branches button')[1].ariaPressed === 'true'")


def test_a_place_out_of_reach_says_so_and_is_not_gone_to(handles: Page) -> None:
    drag(handles, handle(handles, "z"), (0.0, -300.0))
    handles.wait(f"{TOLD}.classList.contains('bad')")
    assert "UNREACHABLE" in handles.text(".reach .told")
    go = "document.querySelector('.reach .go')"
    handles.wait(f"{go}.ariaDisabled === 'true'")
    handles.rig.tap.forget()
    with _hold(handles):
        time.sleep(0.4)
    assert handles.rig.tap.seen() == []


@contextmanager
def _hold(page: Page) -> Iterator[None]:
    """Hold the button that moves to the handles."""
    go = "document.querySelector('.reach .go')"
    page.run(f"{go}.scrollIntoView({{block: 'center'}})")
    at = page.run(
        f"const b = {go}.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]"
    )
    page.mouse("mouseMoved", at)
    page.mouse("mousePressed", at)
    try:
        yield
    finally:
        page.mouse("mouseReleased", at)


PLACE = "[...document.querySelectorAll('.tool-place td')].map(e => parseFloat(e.innerText))"


@pytest.mark.parametrize("way", ["ptp", "lin"])
def test_it_moves_there_as_long_as_the_button_is_held(handles: Page, way: str) -> None:
    handles.run(
        f"document.querySelector('[data-way={way}]').click();"
        "document.querySelector('.plan .speed input').value = '5'"
    )
    drag(handles, handle(handles, "z"), (0.0, 60.0))
    handles.wait("!document.querySelector('.reach .go').ariaDisabled")
    wanted = boxes(handles, NUMBERS)[2]
    before = handles.run(f"return {PLACE}")[2]
    with _hold(handles):
        handles.wait(f"Math.abs({PLACE}[2] - {before}) > 2")
    handles.rig.tap.wait_for_rest(20)
    handles.wait("document.querySelector('.chips').innerText.includes('Ready')")
    halfway = handles.run(f"return {PLACE}")[2]
    assert abs(halfway - wanted) > 1.0, "it stood where it was let go"
    with _hold(handles):
        handles.wait(f"Math.abs({PLACE}[2] - {wanted}) < 0.3", within=30)


@pytest.fixture(scope="module")
def deep_driver(driver: Any) -> Iterator[Any]:
    """A browser that draws in three dimensions, by software."""
    del driver
    started = chromium(WITH_3D)
    show_at(started, 1024, 600)  # software draws each point
    yield started
    started.quit()


@pytest.fixture
def deep(page_rig: PageRig, deep_driver: Any) -> Iterator[Page]:
    """A page in three dimensions, in control, at the task of plans; another page has let go."""
    page = Page(page_rig, deep_driver, page_rig.page().address)
    page_rig.page().driver.get("about:blank")
    page.ready()
    _task(page, "plan")
    page.wait("document.querySelector('.plan select')?.options.length > 1")
    page.wait("document.querySelector('.host canvas[data-engine]')", within=30)
    yield page
    page.driver.get("about:blank")


def _deep_handle(page: Page) -> tuple[float, float]:
    """Return where the handle z is; skipped where the page found 3-D too slow for this machine."""
    try:
        return handle(page, "z", DEEP, half=3)
    except AssertionError:
        if page.run("return document.querySelector('.host canvas[data-engine]') === null"):
            pytest.skip("the machine is too slow for 3-D just now: the page went back to sticks")
        raise


def test_in_three_dimensions_a_target_is_dragged_along_one_axis_and_asked_for(deep: Page) -> None:
    _goal(deep, "")
    deep.wait(f"{TOLD}.innerText.includes('reaches it')")
    before = boxes(deep, NUMBERS)
    deep.run(_COUNT)
    drag(deep, _deep_handle(deep), (0.0, 60.0), between=lambda: time.sleep(0.05))
    deep.wait(f"document.querySelectorAll('{NUMBERS}')[2].value < {before[2] - 30}")
    assert boxes(deep, NUMBERS)[:2] == before[:2]
    deep.wait(f"{ASKED}.length > 0 && {TOLD}.innerText.includes('reaches it')")


def test_in_three_dimensions_an_object_is_resized_by_its_handles(deep: Page) -> None:
    _task(deep, "scene")
    deep.run("document.querySelector('.kinds button').click()")
    deep.wait("document.querySelector('.object-editor .three ~ .three input')")
    deep.run("document.querySelector('.scene [data-drags=size]').click()")
    sizes = ".object-editor .three ~ .three input"
    before = boxes(deep, sizes)
    # What is in the picture may be the handle of before, as software draws a few a second.
    for _ in range(3):
        drag(deep, _deep_handle(deep), (0.0, -50.0), between=lambda: time.sleep(0.05))
        with contextlib.suppress(AssertionError):
            deep.wait(f"document.querySelectorAll('{sizes}')[2].value > {1.2 * before[2]}", 3.0)
            break
    assert boxes(deep, sizes)[2] > 1.2 * before[2]
    assert boxes(deep, sizes)[:2] == before[:2]
