"""Every task for everybody: no rule of WCAG 2.2 AA broken, no line cut."""

import json

import pytest

from browser.page_rig import Page, PageRig, show_at
from browser.wcag import broken_rules

SHOWN = {
    "plan": "document.querySelector('.plan select')?.options.length > 1",
    "scene": "document.querySelector('.scene .kinds') !== null",
    "frames": "document.querySelectorAll('.numbers .values td').length > 10",
    "packets": "document.querySelector('button.packet:not(.out, .state, [hidden])') !== null",
    "log": "document.querySelector('.log-lines li') !== null",
    "plots": "document.querySelectorAll('.plots canvas').length >= 3",
    "tour": "document.querySelector('.tour .begin') !== null",
}
THEN = {
    "plan": "const goal = document.querySelector('.plan select'); goal.value = '';"
    "goal.dispatchEvent(new Event('change'))",
    # One that came in: its way is blue, on the paper of what is chosen.
    "packets": "document.querySelector('.pause').click();"
    "document.querySelector('button.packet:not(.out, .state, [hidden])').click()",
}


@pytest.fixture(scope="module")
def control(page_rig: PageRig) -> Page:
    """A page in control, one for all tasks."""
    page = page_rig.page()
    page.ready()
    return page


def _show(page: Page, task: str) -> None:
    """Choose a task of the rail, or the tour, which stands below the checklist."""
    button = ".checklist .take-tour" if task == "tour" else f"[data-task={task}]"
    page.run(f"document.querySelector({json.dumps(button)}).click()")
    if task == "packets":
        page.wait("document.querySelector('[data-kind=\"no state\"]') !== null")
        page.run("document.querySelector('[data-kind=\"no state\"]').click()")
    page.wait(SHOWN[task])


@pytest.mark.parametrize("task", SHOWN)
def test_a_task_breaks_no_rule_of_wcag_2_2_aa(control: Page, task: str) -> None:
    _show(control, task)
    control.run(THEN.get(task, ""))
    assert broken_rules(control) == {}


@pytest.mark.parametrize("task", SHOWN)
def test_a_task_scrolls_nothing_sideways_on_a_narrow_phone(control: Page, task: str) -> None:
    size = {"width": 320, "height": 700, "deviceScaleFactor": 1, "mobile": True}
    control.cdp("Emulation.setDeviceMetricsOverride", **size)
    try:
        _show(control, task)
        assert control.run("return document.documentElement.scrollWidth") <= 320
    finally:
        control.cdp("Emulation.clearDeviceMetricsOverride")


def test_plots_become_narrower_with_their_window(control: Page) -> None:
    _show(control, "plots")
    show_at(control.driver, 320, 700)
    try:
        rights = (
            "[...document.querySelectorAll('.plots canvas')].map(c => c.getBoundingClientRect())"
        )
        control.wait(f"{rights}.every(({{ right }}) => right <= 320)")
    finally:
        show_at(control.driver, 1366, 820)
