"""Letting go of a jog button in Firefox, by the ways that a hand has."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from browser.firefox import NAMES, Firefox, FirefoxPage, firefox_program
from browser.hold_trials import ALONE, ready_to_hold
from browser.page_rig import FRONT, PageRig
from browser.test_holding import ramp_begins_in_time, the_other_key_goes_on

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    """The browser of these tests; skipped aloud where it or the page is missing."""
    if (program := firefox_program()) is None:
        pytest.skip(f"no {' and no '.join(NAMES)} on this machine")
    if not (FRONT / "index.html").is_file():
        pytest.skip("the page is not built: make browser builds it")
    with ALONE:
        started = Firefox(program, Path(tmp_path_factory.mktemp("firefox")))
    yield started
    started.quit()


@pytest.fixture(scope="module")
def cell(firefox: Firefox, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """A cell of its own, so that no other browser is needed."""
    with ExitStack() as ends:
        with ALONE:
            rig = ends.enter_context(PageRig(Path(tmp_path_factory.mktemp("cell")), firefox))
        yield rig


@pytest.fixture
def page(firefox: Firefox, cell: PageRig) -> Iterator[FirefoxPage]:
    """A page that holds control in T1, with nothing held."""
    page = FirefoxPage(cell, firefox, f"http://127.0.0.1:{cell.gateway}/")
    ready_to_hold(page)
    yield page
    page.let_all_go()


@pytest.mark.parametrize(
    "names",
    [
        pytest.param(
            ("the pointer is let go", "a finger is lifted", "a key comes up"), id="released"
        ),
        pytest.param(("the pointer slides off", "a finger slides off"), id="slid off"),
        pytest.param(
            ("the window loses the focus", "the page is hidden", "a context menu opens"), id="left"
        ),
    ],
)
def test_in_firefox_the_ramp_begins_soon_after_the_button_is(
    page: FirefoxPage, names: tuple[str, ...]
) -> None:
    ramp_begins_in_time(page, *names)


def test_in_firefox_the_other_of_two_keys_goes_on(page: FirefoxPage) -> None:
    the_other_key_goes_on(page)
