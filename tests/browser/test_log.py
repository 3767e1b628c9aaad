"""The log of the page: who stopped the robot, what was refused, and the same as a file."""

import csv
from collections.abc import Iterator
from io import StringIO

import pytest

from browser.page_rig import Page, PageRig
from browser.wcag import broken_rules
from openpendant.tools.pendants.sync_client import SyncPendantClient

LINES = "[...document.querySelectorAll('.log-lines li')]"


@pytest.fixture
def observer(page_rig: PageRig) -> Page:
    """A page that looks on and shows its log."""
    page = page_rig.page()
    page.open()
    page.run("document.querySelector('.checklist .quiet').click()")
    page.run("document.querySelector('[data-task=log]').click()")
    page.wait(f"{LINES}.length > 0")
    return page


@pytest.fixture
def stopped_by_anna(page_rig: PageRig, observer: Page) -> Iterator[Page]:
    """That page, to which another speed was refused before Anna stopped the robot."""
    speed = "[...document.querySelectorAll('.chip')].find(e => e.innerText.startsWith('Speed'))"
    observer.run(f"{speed}.click()")
    observer.wait(f"{LINES}[0].dataset.kind === 'refusal'")
    with SyncPendantClient.connect(port=page_rig.server, client="Anna") as anna:
        anna.stop("a hand is near")
        observer.wait(f"{LINES}[0].dataset.kind === 'stop'")
        yield observer
        with anna.control():
            anna.reset_stop()


def _shown(page: Page) -> list[str]:
    return list(page.run(f"return {LINES}.map(each => each.lastChild.innerText)"))


def test_it_tells_who_stopped_the_robot_and_what_was_refused_before(stopped_by_anna: Page) -> None:
    stopped_by_anna.run("document.querySelectorAll('.log .tabs button')[1].click()")
    stopped_by_anna.wait(f"{LINES}.length === 2")
    stop, refusal = _shown(stopped_by_anna)
    assert stop == "Stopped by Anna: a hand is near."
    assert refusal.startswith("NOT_IN_CONTROL: ")
    assert broken_rules(stopped_by_anna) == {}


def test_it_is_saved_with_all_its_lines_in_the_order_in_which_they_came(
    stopped_by_anna: Page,
) -> None:
    stopped_by_anna.run("URL.createObjectURL = blob => (window.saved = blob, 'data:,')")
    stopped_by_anna.run("document.querySelector('.log .save').click()")
    head, *rows = csv.reader(StringIO(str(stopped_by_anna.run("return window.saved.text()"))))
    assert head == ["time", "kind", "text"]
    assert [text for _, _, text in rows] == _shown(stopped_by_anna)[::-1]
    assert [kind for _, kind, _ in rows][-2:] == ["refusal", "stop"]
