"""What a person meets first: few actions to the first motion, and a page for everybody."""

import json
import re

import pytest

from browser.page_rig import Page, PageRig, show_at
from browser.wcag import broken_rules

pytestmark = pytest.mark.realtime

ORANGE = "[...document.querySelectorAll('button.orange')].filter(b => b.offsetParent !== null)"


@pytest.fixture
def fresh(page_rig: PageRig) -> Page:
    """A page as it opens, of a cell that nobody controls, in Automatic."""
    page = page_rig.page()
    page.open()
    if not re.search("Ready(.|\n)*Automatic", page.text(".chips")):
        page.ready()
        page.tap_key("KeyM", "m")
        page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
        page.open()
    page.wait("document.querySelector('.chips').innerText.includes('Nobody')")
    return page


def _orange(page: Page) -> str:
    page.wait(f"{ORANGE}.length === 1")
    return str(page.run(f"return {ORANGE}[0].innerText"))


def test_four_actions_by_the_orange_control_alone_move_the_robot(fresh: Page) -> None:
    done = []
    for word in ("Take control", "Set T1"):
        fresh.wait(f"{ORANGE}[0]?.innerText === {json.dumps(word)}")
        done.append(_orange(fresh))
        fresh.run(f"{ORANGE}[0].click()")
    fresh.wait(f"{ORANGE}[0]?.innerText === 'Hold'")
    fresh.key(True, "KeyV", "v")
    fresh.wait(f"{ORANGE}[0]?.innerText === 'Base +'")
    fresh.key(True, "Digit1", "1")
    fresh.jogs()
    fresh.let_all_go()
    fresh.stands()
    assert done == ["Take control", "Set T1"]


def test_five_actions_do_where_a_cell_has_to_be_chosen(page_rig: PageRig) -> None:
    cells = {"left": "kawasaki_ra10n", "right": "ur5"}
    _, gateway = page_rig.serve_cells(cells, emulated=cells)
    page = page_rig.page(gateway)
    page.driver.get(page.address)
    for word in ("Enter", "Take control", "Set T1"):
        page.wait(f"{ORANGE}.length === 1 && {ORANGE}[0].innerText === {json.dumps(word)}", 20)
        page.run(f"{ORANGE}[0].click()")
    page.wait(f"{ORANGE}[0]?.innerText === 'Hold'")
    page.key(True, "KeyV", "v")
    page.wait(f"{ORANGE}[0]?.innerText === 'Base +'")
    page.key(True, "Digit1", "1")
    page.jogs()
    page.let_all_go()
    page.stands()


def test_the_page_writes_nothing_to_the_console_and_asks_nobody_else(fresh: Page) -> None:
    assert fresh.console() == []
    asked = fresh.run("return performance.getEntriesByType('resource').map(each => each.name)")
    assert [each for each in asked if not each.startswith(fresh.address)] == []


@pytest.mark.parametrize(
    "shown",
    [
        pytest.param("", id="checklist"),
        pytest.param("document.querySelector('.checklist .quiet').click()", id="observer"),
        pytest.param("document.querySelector('.brand').click()", id="settings"),
        pytest.param("document.querySelector('.chip').click()", id="connect"),
        pytest.param("document.querySelector('.main-act').click()", id="control"),
    ],
)
def test_a_screen_breaks_no_rule_of_wcag_2_2_aa(fresh: Page, shown: str) -> None:
    fresh.run(shown)
    assert broken_rules(fresh) == {}


def test_nothing_scrolls_sideways_on_a_narrow_phone(fresh: Page) -> None:
    show_at(fresh.driver, 320, 700)
    try:
        assert fresh.run("return document.documentElement.scrollWidth") <= 320
    finally:
        show_at(fresh.driver, 1366, 820)


CUT = (
    "return [...document.querySelectorAll('.name, .main-act, .stop, .homes button, .value-box')]"
    ".filter(e => e.offsetParent).filter(e => e.scrollWidth > e.clientWidth + 1"
    " || e.getBoundingClientRect().right > innerWidth).map(e => e.innerText)"
)


@pytest.mark.parametrize(
    ("width", "height"), [(1366, 820), (1024, 600), (412, 915), (320, 700)], ids=str
)
def test_no_word_is_cut_and_the_jog_panel_holds_while_enabling_is_on(
    page: Page, width: int, height: int
) -> None:
    show_at(page.driver, width, height)
    try:
        page.hold_enabling()
        page.key(True, "Digit5", "5")
        page.jogs()
        page.wait("document.querySelectorAll('.actual')[4].innerText !== ''")
        cut = page.run(CUT)
        over = page.run(
            "const p = document.querySelector('.panel');return p.scrollHeight - p.clientHeight"
        )
        page.let_all_go()
        assert (cut, over) == ([], 0)
    finally:
        show_at(page.driver, 1366, 820)
