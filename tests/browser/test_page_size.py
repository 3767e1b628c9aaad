"""What the page weighs and asks for: its bounds, with WebGL and without."""

import gzip
from collections.abc import Iterator
from typing import Any

import pytest

from browser.page_rig import FRONT, WITH_3D, Page, PageRig, chromium

MOST = 1_100_000
MOST_PACKED = 300_000
MOST_WITHOUT_3D = 400_000
MOST_REQUESTS = 4
TASKS = ("teach", "plan", "scene", "frames", "plots", "packets", "jog")


def _sizes(*, with_three: bool) -> tuple[int, int]:
    """Return the bytes of all that a page loads, as they are and packed."""
    parts = [FRONT / "index.html", *(FRONT / "assets").iterdir()]
    taken = [each for each in parts if with_three or not each.name.startswith("scene3d")]
    whole = [each.read_bytes() for each in taken]
    return sum(map(len, whole)), sum(len(gzip.compress(each, 9, mtime=0)) for each in whole)


def test_the_page_is_no_larger_than_its_bound(driver: Any) -> None:
    whole, packed = _sizes(with_three=True)
    assert whole <= MOST
    assert packed <= MOST_PACKED


def test_the_page_without_webgl_is_no_larger_than_its_bound(driver: Any) -> None:
    whole, _ = _sizes(with_three=False)
    assert whole <= MOST_WITHOUT_3D


def _tour(page: Page) -> list[str]:
    """Show every task in both languages; return what the page asked for, itself first."""
    page.open()
    for language in ("Deutsch", "English"):
        button = (
            f"[...document.querySelectorAll('button')].find(e => e.textContent === '{language}')"
        )
        page.run(f"{button}.click()")
        for task in TASKS:
            page.run(f"document.querySelector('[data-task={task}]').click()")
            page.wait(f"document.querySelector('[data-task={task}].chosen') !== null")
    page.wait("document.querySelector('.host canvas') !== null")
    return _asked_so_far(page)


def _asked_so_far(page: Page) -> list[str]:
    kinds = "['navigation', 'resource'].includes(each.entryType)"
    told = page.run(
        f"return performance.getEntries().filter(each => {kinds}).map(each => each.name)"
    )
    return [str(each) for each in told]


def test_a_page_without_webgl_asks_for_three_things_and_not_for_three_js(page: Page) -> None:
    asked = _tour(page)
    assert len(asked) <= MOST_REQUESTS - 1
    assert not [each for each in asked if "scene3d" in each]
    assert [each for each in asked if not each.startswith(page.address)] == []
    assert page.driver.get_log("browser") == []


@pytest.fixture(scope="module")
def webgl(driver: Any) -> Iterator[Any]:
    """A browser that draws in three dimensions, by software."""
    started = chromium(WITH_3D)
    yield started
    started.quit()


def test_a_page_with_webgl_asks_for_four_things_and_writes_nothing_to_the_console(
    page_rig: PageRig, webgl: Any
) -> None:
    page = Page(page_rig, webgl, f"http://127.0.0.1:{page_rig.gateway}/")
    _tour(page)
    page.wait("performance.getEntriesByType('resource').some(e => e.name.includes('scene3d'))")
    asked = _asked_so_far(page)
    assert len(asked) <= MOST_REQUESTS
    assert [each for each in asked if not each.startswith(page.address)] == []
    assert page.driver.get_log("browser") == []
