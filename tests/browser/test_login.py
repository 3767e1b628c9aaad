"""A server that demands logins: by name and password, and by a pairing code."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.guarded_server import PASSWORDS, add_accounts

from browser.page_rig import Page, PageRig
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def guarded(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """A cell with accounts."""
    folder = Path(tmp_path_factory.mktemp("guarded"))
    add_accounts(folder / "store.db")
    with PageRig(folder, driver) as rig:
        yield rig


def _logs_in(page: Page, kind: int, name: str, secret: str) -> None:
    page.wait("document.querySelector('form')?.offsetParent")
    page.run(f"document.querySelectorAll('form .tabs button')[{kind}].click()")
    page.run(
        "const [name, secret] = document.querySelectorAll('form input');"
        f"name.value = {name!r}; secret.value = {secret!r};"
    )
    page.run("document.querySelector('form').requestSubmit()")


def _asks_for_control(page: Page) -> None:
    page.driver.get(page.address)
    page.wait("document.querySelector('.chips')?.innerText.includes('Connected')")
    page.run("document.querySelector('.chip').click()")


def test_a_wrong_password_is_told_and_the_right_one_takes_control(guarded: PageRig) -> None:
    page = guarded.page()
    _asks_for_control(page)
    _logs_in(page, 0, "otto", "wrong")
    page.wait("document.querySelector('.note')?.innerText !== '×'")
    page.wait("document.querySelector('.note').offsetParent")
    page.run("document.querySelector('.chip').click()")
    _logs_in(page, 0, "otto", PASSWORDS["otto"])
    page.wait("!document.querySelector('form').offsetParent")
    page.wait("document.querySelectorAll('.row').length === 6")
    # A password takes its time; until then the refusal of the wrong one stands there.
    page.wait("!document.querySelector('.note').offsetParent")
    page.tap_key("KeyC", "c")
    page.wait("document.querySelector('.chips').innerText.includes('You')")


def test_a_pairing_code_lets_a_browser_in(guarded: PageRig) -> None:
    page = guarded.page()
    with SyncPendantClient.connect(
        port=guarded.server, user="ann", password=PASSWORDS["ann"]
    ) as ann:
        code = ann.issue_pairing_code()
        _asks_for_control(page)
        _logs_in(page, 1, "student", code)
        page.wait("document.querySelectorAll('.row').length === 6")
        page.tap_key("KeyC", "c")
        page.wait("document.querySelector('.chips').innerText.includes('You')")
