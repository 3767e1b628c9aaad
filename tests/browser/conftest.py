"""A real browser, gateway, server and emulator, up once for all tests of the page."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from browser.page_rig import FRONT, Page, PageRig, why_no_browser


@pytest.fixture(scope="session")
def page_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """Processes with free ports, and a browser; skipped aloud where one is missing."""
    if why := why_no_browser():
        pytest.skip(why)
    if not (FRONT / "index.html").is_file():
        pytest.skip("the page is not built: make browser builds it")
    with PageRig(Path(tmp_path_factory.mktemp("page"))) as rig:
        yield rig


@pytest.fixture
def page(page_rig: PageRig) -> Iterator[Page]:
    """A page that holds control in T1, with nothing held."""
    page = page_rig.page()
    page.ready()
    yield page
    page.let_all_go()
