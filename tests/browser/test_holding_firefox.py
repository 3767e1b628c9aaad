"""Letting go of a jog button in Firefox, by the ways that a hand has."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from browser.firefox import NAMES, Firefox, FirefoxPage, firefox_program
from browser.page_rig import FRONT, PageRig
from browser.test_holding import WAYS, Act, ramp_begins_in_time, the_other_key_goes_on

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    """The browser of these tests; skipped aloud where it or the page is missing."""
    if (program := firefox_program()) is None:
        pytest.skip(f"no {' and no '.join(NAMES)} on this machine")
    if not (FRONT / "index.html").is_file():
        pytest.skip("the page is not built: make browser builds it")
    started = Firefox(program, Path(tmp_path_factory.mktemp("firefox")))
    yield started
    started.quit()


@pytest.fixture(scope="module")
def cell(firefox: Firefox, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """A cell of its own, so that no other browser is needed."""
    with PageRig(Path(tmp_path_factory.mktemp("cell")), firefox) as rig:
        yield rig


@pytest.fixture
def page(firefox: Firefox, cell: PageRig) -> Iterator[FirefoxPage]:
    """A page that holds control in T1, with nothing held."""
    page = FirefoxPage(cell, firefox, f"http://127.0.0.1:{cell.gateway}/")
    page.ready()
    yield page
    page.let_all_go()


@pytest.mark.parametrize(("down", "go", "up", "bound"), WAYS)
def test_in_firefox_the_ramp_begins_soon_after(
    page: FirefoxPage, down: Act, go: Act, up: Act, bound: float, request: pytest.FixtureRequest
) -> None:
    name = f"Firefox: {request.node.callspec.id}"
    ramp_begins_in_time(page, name, down, go, up, bound)


def test_in_firefox_the_other_of_two_keys_goes_on(page: FirefoxPage) -> None:
    the_other_key_goes_on(page)
