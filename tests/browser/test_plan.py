"""Plans in a real browser: round an obstacle, looked at, executed; stale ones never move."""

import json
from typing import Any

import pytest

from browser.page_rig import Page, PageRig

READY = "document.querySelector('.verdict').innerText.includes('can run')"
PLAN = "document.querySelector('.plan .acts button').click()"
EXECUTE = "document.querySelector('.execute').click()"
PILLAR = {
    "name": "pillar",
    "shape": {"type": "box", "size": [0.14, 0.14, 1.6]},
    "position": [0.55, 0.55, 0.8],
}


@pytest.fixture
def plans(page_rig: PageRig) -> Page:
    """A page in control in Automatic, at the task of plans, with an empty scene."""
    page = page_rig.page()
    page.ready()
    page.tap_key("KeyM", "m")
    page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
    _task(page, "scene")
    page.wait("document.querySelector('.scene header').innerText.includes('of this cell')")
    while page.run("return document.querySelectorAll('.object').length"):
        count = page.run("return document.querySelectorAll('.object').length")
        page.run("document.querySelector('.object').click()")
        page.run("for (const _ of [1, 2]) document.querySelector('.remove').click()")
        page.wait(f"document.querySelectorAll('.object').length === {count - 1}")
    _task(page, "plan")
    page.wait("document.querySelector('.plan select').options.length > 1")
    return page


def _task(page: Page, name: str) -> None:
    page.run(f"document.querySelector('[data-task={name}]').click()")
    page.wait(f"document.querySelector('[data-task={name}].chosen') !== null")


def _goal(page: Page, name: str, way: str = "ptp") -> None:
    page.run(
        f"document.querySelector('[data-way={way}]').click();"
        "const goal = document.querySelector('.plan select');"
        f"goal.value = {json.dumps(name)}; goal.dispatchEvent(new Event('change'))"
    )


def _add_box(page: Page, place: list[float], size: list[float]) -> None:
    """Add a box by the panel: a new one, then its numbers in mm, then save."""
    _task(page, "scene")
    count = page.run("return document.querySelectorAll('.object').length")
    page.run("document.querySelector('.kinds button').click()")
    page.wait(f"document.querySelectorAll('.object').length === {count + 1}")
    page.wait("document.querySelectorAll('.object-editor .three input').length === 9")
    values = {0: place[0], 1: place[1], 2: place[2], 6: size[0], 7: size[1], 8: size[2]}
    page.run(
        "const boxes = document.querySelectorAll('.object-editor .three input');"
        f"for (const [index, value] of Object.entries({json.dumps(values)})) {{"
        "boxes[index].value = String(value * 1000);"
        "boxes[index].dispatchEvent(new Event('change')); }"
    )
    page.wait("!document.querySelector('.object-editor .acts button').ariaDisabled")
    page.run("document.querySelectorAll('.object-editor .acts button')[1].click()")
    page.wait("document.querySelector('.object-editor .acts button').ariaDisabled === 'true'")
    _task(page, "plan")


def _make(page: Page) -> None:
    page.run(PLAN)
    page.wait(READY)


def _tool(page: Page) -> list[float]:
    cells = (
        "[...document.querySelectorAll('.tool-place td')].map(each => parseFloat(each.innerText))"
    )
    values: list[float] = page.run(f"return {cells}")
    return values


def _execute(page: Page) -> None:
    page.run(EXECUTE)
    page.wait("document.querySelector('.verdict').innerText.includes('was executed')", 20)


def _other_goal(page: Page) -> str:
    """Return the one of home and zero where the robot does not stand."""
    return "zero" if abs(_tool(page)[2] - 992.0) < 1.0 else "home"


def _elsewhere(page: Page) -> None:
    _goal(page, _other_goal(page), "free")
    _make(page)
    _execute(page)


def test_a_plan_moves_nothing_until_execute_and_ends_where_it_was_shown(plans: Page) -> None:
    before = _tool(plans)
    goal = _other_goal(plans)
    _goal(plans, goal)
    _make(plans)
    assert _tool(plans) == before
    assert "does not move until you press Execute" in plans.text(".banner.note")
    _execute(plans)
    assert abs(_tool(plans)[2] - (992.0 if goal == "home" else 1868.0)) < 0.5


def test_a_way_round_a_pillar_is_planned_looked_at_and_executed(plans: Page) -> None:
    if _other_goal(plans) == "home":
        _elsewhere(plans)
    _add_box(plans, [0.0, 0.62, 1.5], [0.14, 0.14, 0.5])
    _goal(plans, "zero")
    plans.run(PLAN)
    plans.wait("document.querySelector('.verdict').innerText.includes('PATH_IN_COLLISION')")
    _goal(plans, "zero", "free")
    _make(plans)
    facts = plans.text(".facts")
    assert "nearest" in facts
    assert "box" in facts
    plans.run("document.querySelector('.moment.nearest').click()")
    seconds = "parseFloat(document.querySelector('.preview-bar .time').innerText)"
    assert plans.run(f"return {seconds}") > 0
    _execute(plans)
    assert abs(_tool(plans)[2] - 1868.0) < 0.5


def test_a_scene_that_changes_makes_a_plan_old_and_says_so(plans: Page) -> None:
    _goal(plans, _other_goal(plans))
    _make(plans)
    _add_box(plans, [2.0, 2.0, 0.5], [0.1, 0.1, 0.1])
    plans.wait("document.querySelector('.verdict').innerText.includes('This plan is old')")
    assert "changed the scene" in plans.text(".verdict")
    before = _tool(plans)
    plans.run(EXECUTE)
    assert _tool(plans) == before
    _make(plans)


def test_a_plan_is_kept_for_a_minute_that_counts_down(plans: Page) -> None:
    _goal(plans, _other_goal(plans))
    _make(plans)
    first = plans.text(".verdict .left")
    assert first.startswith(("1:00", "0:5"))
    plans.wait(f"document.querySelector('.verdict .left').innerText !== {json.dumps(first)}")


def test_the_handles_tell_whether_the_robot_reaches_their_place(plans: Page) -> None:
    _goal(plans, "")
    plans.wait("document.querySelector('.reach .told').innerText.includes('reaches it')")
    boxes = "document.querySelectorAll('.reach input')"
    plans.run(f"{boxes}[0].value = '5000'; {boxes}[0].dispatchEvent(new Event('change'))")
    plans.wait("document.querySelector('.reach .told.bad') !== null")
    assert "UNREACHABLE" in plans.text(".reach .told")


def test_a_held_enter_makes_one_plan(plans: Page) -> None:
    _goal(plans, _other_goal(plans))
    plans.run("document.querySelector('.plan .acts button').focus()")
    for _ in range(4):
        plans.key(True, "Enter", "Enter")
    plans.key(False, "Enter", "Enter")
    plans.wait(READY)
    number = plans.text(".verdict .muted")
    plans.run(PLAN)
    plans.wait(f"document.querySelector('.verdict .muted').innerText !== {json.dumps(number)}")
    plans.wait(READY)
    found: Any = [
        int("".join(filter(str.isdigit, text.split(",")[0])))
        for text in (number, plans.text(".verdict .muted"))
    ]
    assert found[1] == found[0] + 1
