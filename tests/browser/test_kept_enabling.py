"""Enabling that is kept ends by itself, and the jog with it, where nobody answers."""

import time

import pytest

from browser.hold_trials import TICK
from browser.page_rig import Page
from browser.test_holding import RELEASED

pytestmark = [pytest.mark.realtime, pytest.mark.soak]

KEPT_FOR = 30.0
"""Enabling that is kept ends so long after the last key or touch [s]."""
BEAT = 0.050
"""So often the page looks at its clock [s]."""


def test_enabling_that_is_kept_ends_amid_a_jog_where_nobody_answers(page: Page) -> None:
    page.run(
        "const s = document.querySelector('.speed input'); s.value = 1;"
        "s.dispatchEvent(new Event('input'))"
    )
    pad = page.run(
        "const b = document.querySelector('.pad').getBoundingClientRect();"
        "return [b.x + b.width / 2, b.y + b.height / 2]"
    )
    page.mouse("mousePressed", pad)
    page.mouse("mouseReleased", pad)
    page.wait("document.querySelector('.chips').innerText.includes('Kept')")
    page.rig.tap.forget()
    # Wherever other tests have left it: it shall not come to its limit meanwhile.
    angle = float(page.text(".rows .value").rstrip("°"))
    at = page.place(0, "minus" if angle > 0 else "plus")
    page.mouse("mouseMoved", at)
    began = time.monotonic()
    page.mouse("mousePressed", at)
    page.jogs()
    page.wait("document.querySelector('.question').offsetParent", within=KEPT_FOR)
    assert "Are you still there?" in page.text(".question")
    page.picture("v2-t1-hold")
    page.wait("document.querySelector('.note').innerText.includes('no key or touch for 30 s')")
    page.rig.tap.wait_for_rest()
    found = page.rig.tap.end_of_steady(0, began + KEPT_FOR)
    page.rig.tap.stays_at_rest()
    page.stands()
    page.mouse("mouseReleased", at)
    assert found.kind == "ramp"
    assert found.at - found.began <= BEAT + RELEASED + TICK
