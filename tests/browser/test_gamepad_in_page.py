"""A gamepad of the browser at the page: a stand-in for the browser's own tells what it shows."""

import pytest

from browser.page_rig import Page

pytestmark = pytest.mark.realtime

STAND_IN = """
  window.pad = {
    connected: true, mapping: 'standard', axes: [0, 0, 0, 0],
    buttons: Array.from({length: 17}, () => ({pressed: false})),
    get timestamp() { return performance.now(); },
  };
  navigator.getGamepads = () => [window.pad];
  dispatchEvent(new Event('gamepadconnected'));
"""
LEFT_X, ENABLING, STOP = 0, 4, 1


def _shown(page: Page, milliseconds: int) -> None:
    page.run(f"return new Promise(shown => setTimeout(shown, {milliseconds}))")


def _jog(page: Page) -> None:
    """Hold the enabling button and push the left stick, which moves the second joint.

    A busy machine shows too few frames, which lets go; then it is pressed anew.
    """
    page.run(STAND_IN)
    for _ in range(20):
        _shown(page, 100)
        page.run(f"pad.buttons[{ENABLING}].pressed = true")
        _shown(page, 100)
        page.run(f"pad.axes[{LEFT_X}] = -0.6")
        _shown(page, 300)
        if "Jogging" in page.text(".chips"):
            return
        page.run(f"pad.axes[{LEFT_X}] = 0; pad.buttons[{ENABLING}].pressed = false")
    raise AssertionError(f"no jog began: {page.told()}")


def test_a_stick_jogs_while_the_enabling_button_is_held(page: Page) -> None:
    _jog(page)
    page.run(f"pad.buttons[{ENABLING}].pressed = false")
    page.stands()
    page.wait("!document.querySelector('.enabling').classList.contains('on')")


def test_a_stick_without_the_enabling_button_moves_nothing(page: Page) -> None:
    page.run(STAND_IN)
    page.run(f"pad.axes[{LEFT_X}] = -1.0")
    _shown(page, 500)
    page.stands()


@pytest.mark.parametrize(
    "what",
    [
        "window.pad = null",
        "window.pad = null; dispatchEvent(new Event('gamepaddisconnected'))",
        "dispatchEvent(new Event('blur'))",
        f"pad.buttons[{STOP}].pressed = true",
    ],
)
def test_what_lets_go_ends_the_jog_and_nothing_moves_by_itself(page: Page, what: str) -> None:
    _jog(page)
    page.run(what)
    page.stands()
    _shown(page, 300)
    page.stands()
    page.wait("!document.querySelector('.enabling').classList.contains('on')")


def test_a_page_whose_frames_end_lets_go(page: Page) -> None:
    _jog(page)
    page.run("window.requestAnimationFrame = () => 0")  # what it shows stands still, too
    page.rig.tap.wait_for_rest(2.0)
