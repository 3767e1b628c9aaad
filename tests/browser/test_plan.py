"""Plans in a real browser: round an obstacle, looked at, executed; stale ones never move."""

import json
import time

import pytest

from browser.page_rig import ROBOT, Page, PageRig
from browser.wcag import broken_rules
from openpendant.tools.pendants.sync_client import SyncPendantClient

READY = "document.querySelector('.verdict').innerText.includes('can run')"
PLAN = "document.querySelector('.plan .acts button').click()"
EXECUTE = "document.querySelector('.execute').click()"


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
    page.wait("document.querySelector('.plan select')?.options.length > 1")
    return page


def _task(page: Page, name: str) -> None:
    page.run(f"document.querySelector('[data-task={name}]').click()")
    page.wait(f"document.querySelector('[data-task={name}].chosen') !== null")
    panel = "plots-panel" if name == "plots" else name
    page.wait(f"document.querySelector('.panel .{panel}') !== null")


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
    began = "/is executed|was executed/.test(document.querySelector('.verdict').innerText)"
    page.wait(f"{began} || document.querySelector('.execute.asks') !== null")
    if not page.run(f"return {began}"):
        # The connection of the page before this one counts as somebody who looks on.
        time.sleep(0.5)
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
    plans.wait(f"{seconds} > 0")
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


def _number(told: str) -> int:
    return int(told.split(",")[0].removeprefix("Plan "))


def test_a_held_enter_makes_one_plan(plans: Page) -> None:
    _goal(plans, _other_goal(plans))
    plans.run("document.querySelector('.plan .acts button').focus()")
    enter = {"code": "Enter", "key": "Enter", "text": "\r", "windowsVirtualKeyCode": 13}
    for index in range(4):
        plans.cdp("Input.dispatchKeyEvent", type="keyDown", autoRepeat=index > 0, **enter)
    plans.cdp("Input.dispatchKeyEvent", type="keyUp", code="Enter", key="Enter")
    plans.wait(READY)
    first = plans.text(".verdict .muted")
    plans.run(PLAN)
    plans.wait(f"{READY} && !document.querySelector('.verdict').innerText.includes('{first}')")
    assert _number(plans.text(".verdict .muted")) == _number(first) + 1


def _slid_to(page: Page, seconds: float) -> list[float]:
    """Put the slider at a moment of the plan; return the joints that the preview shows there."""
    slider = "document.querySelector('.preview-bar input')"
    page.run(f"{slider}.value = '{seconds}'; {slider}.dispatchEvent(new Event('input'))")
    page.wait(
        f"Math.abs(parseFloat(document.querySelector('.preview-bar .time').innerText) - {seconds})"
        " < 0.006"
    )
    return [float(each) for each in page.run(f"return {slider}.dataset.joints").split()]


def _duration(page: Page) -> float:
    page.wait("document.querySelector('.preview-bar input')?.dataset.joints")
    return float(page.run("return document.querySelector('.preview-bar input').max"))


def _passed(joints: list[float], driven: list[tuple[float, ...]]) -> float:
    """Return how near the nearest of the driven set-points comes to these joints [rad]."""
    return min(
        max(abs(one - other) for one, other in zip(joints, each, strict=False)) for each in driven
    )


def test_what_the_slider_shows_is_what_is_driven(plans: Page) -> None:
    _goal(plans, _other_goal(plans))
    _make(plans)
    duration = _duration(plans)
    shown = {k: _slid_to(plans, round(k * duration / 8, 2)) for k in range(1, 8)}
    plans.rig.tap.forget()
    _execute(plans)
    driven = [each.joints for each in plans.rig.tap.seen() if each.joints]
    assert len(driven) > 50
    for k, joints in shown.items():
        away = _passed(joints, driven)
        assert away < 1e-3, f"at {k}/8 of the plan the robot passed {away:.5f} beside"


def _add_stop(page: Page, words: str) -> None:
    """Choose what is to be added to the path by its words, and add it."""
    option = (
        f"[...document.querySelector('.path-stops select').options].find(o => o.text === {words!r})"
    )
    page.wait(option)
    page.run(
        f"document.querySelector('.path-stops select').value = {option}.value;"
        "document.querySelector('.add-stop').click()"
    )


STOPS = "[...document.querySelectorAll('.stops li')].map(e => e.firstChild.data)"


def _path_program(page: Page, joints: list[list[float]]) -> None:
    """Save a program with these points, in turn, as another client."""
    points = [f"point p{n} joints {' '.join(map(str, each))} rad" for n, each in enumerate(joints)]
    moves = [f"move PTP p{n}" for n in range(len(joints))]
    text = ["openpendant-program/1", f'program "way" robot {ROBOT}', *points, *moves, ""]
    with SyncPendantClient.connect(port=page.rig.server, client="teacher") as other:
        kept = (p for p in other.programs.list()["programs"] if p["name"] == "way")
        revision = next((each["revision"] for each in kept), 0)
        other.programs.save("way", "\n".join(text), revision)


def test_plots_show_a_plan_alone_until_it_is_driven_and_then_both(plans: Page) -> None:
    _goal(plans, _other_goal(plans))
    _make(plans)
    _task(plans, "plots")
    plans.wait("document.querySelector('.plan-name').innerText.startsWith('plan ')")
    panel = "document.querySelector('.plots-panel').innerText"
    plans.wait(f"{panel}.includes('Execute the plan to compare it')")
    assert "At 0 s" in plans.text(".plots-panel")
    _task(plans, "plan")
    _execute(plans)
    _task(plans, "plots")
    plans.wait(f"{panel}.includes('largest difference')")


def test_a_path_goes_through_the_points_of_a_program_and_named_positions(plans: Page) -> None:
    stops = [[0.4, 0.1, -0.2, 0.0, 0.1, 0.0], [-0.3, 0.2, -0.1, 0.1, 0.0, 0.2]]
    _path_program(plans, stops)
    plans.run("document.querySelector('[data-way=path]').click()")
    _add_stop(plans, "All points of way")
    plans.wait(f"{STOPS}.length === 2")
    _add_stop(plans, "home")
    assert plans.run(f"return {STOPS}") == ["p0", "p1", "home"]
    _make(plans)
    _duration(plans)
    plans.rig.tap.forget()
    _execute(plans)
    driven = [each.joints for each in plans.rig.tap.seen() if each.joints]
    for stop in stops:
        assert _passed(stop, driven) < 0.02


def test_a_path_without_a_stop_is_not_planned(plans: Page) -> None:
    plans.run("document.querySelector('[data-way=path]').click()")
    plans.run("document.querySelector('.stop-source button:last-child').click()")
    before = plans.text(".verdicts")
    plans.run(PLAN)
    time.sleep(0.3)
    assert plans.text(".verdicts") == before
    assert "Add named positions" in plans.text(".path-stops")


def test_the_stops_of_a_path_break_no_rule_of_wcag_2_2_aa(plans: Page) -> None:
    plans.run("document.querySelector('[data-way=path]').click()")
    _add_stop(plans, "home")
    _add_stop(plans, "zero")
    assert broken_rules(plans) == {}
