"""A real browser, up once for all tests of the page; the processes behind it, up once a file."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.warm_start import import_besides

from browser.hold_trials import ALONE
from browser.page_rig import FRONT, Page, PageRig, chromium, why_no_browser

HERE = Path(__file__).parent
_LONG = "test_kept_enabling.py"
"""Waits for 30 s, in which other workers have the processor: it is not to come last. Nor first,
while browsers and programs start, in a page that has never drawn."""


def pytest_configure() -> None:
    """Have what each page needs imported once for all rigs of a worker."""
    import_besides("openpendant.tools.cli", "openpendant.tools.pendants.web.cli")


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Mark them all: whatever waits for a browser and a server runs against the real clock."""
    for item in items:
        if item.path.is_relative_to(HERE):
            item.add_marker(pytest.mark.realtime)
    yield
    files = list(dict.fromkeys(item.path for item in items))
    early = files[:2]
    items.sort(key=lambda item: 0 if item.path in early else 1 if item.path.name == _LONG else 2)


@pytest.fixture(scope="session")
def driver() -> Iterator[Any]:
    """The one browser of the run; skipped aloud where it or the page is missing."""
    if why := why_no_browser():
        pytest.skip(why)
    if not (FRONT / "index.html").is_file():
        pytest.skip("the page is not built: make browser builds it")
    with ALONE:
        started = chromium()
    yield started
    started.quit()


@pytest.fixture(scope="module")
def page_rig(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """Emulator, server and gateway: what one file leaves there is in no other's way."""
    with ExitStack() as ends:
        with ALONE:
            rig = ends.enter_context(PageRig(Path(tmp_path_factory.mktemp("page")), driver))
        yield rig
        # A page that outlived them would write to the console that it finds them no more.
        driver.get("about:blank")


@pytest.fixture
def page(page_rig: PageRig) -> Iterator[Page]:
    """A page that holds control in T1, with nothing held."""
    page = page_rig.page()
    page.ready()
    yield page
    page.let_all_go()
