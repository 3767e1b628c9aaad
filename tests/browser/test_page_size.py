"""What the page weighs and asks for: its bounds, with WebGL and without."""

import gzip
from collections.abc import Iterator
from typing import Any

import pytest

from browser.page_rig import COMPOSED_IN_3D, FRONT, Page, PageRig, chromium, show_at

MOST = 1_100_000
MOST_PACKED = 300_000
"""In English; who reads German has the German words besides."""

MOST_WITHOUT_3D = 400_000
MOST_PACKED_WITHOUT_3D = 120_000

MOST_GERMAN, MOST_PACKED_GERMAN = 50_000, 18_000
MOST_FILES = 4
TASKS = ("teach", "plan", "scene", "frames", "plots", "packets", "log", "jog")


def _sizes(*left_out: str) -> tuple[int, int]:
    """Return the bytes of all files but some, by how they begin, as they are and packed."""
    parts = [FRONT / "index.html", *(FRONT / "assets").iterdir()]
    whole = [each.read_bytes() for each in parts if not each.name.startswith(left_out)]
    return sum(map(len, whole)), sum(len(gzip.compress(each, 9, mtime=0)) for each in whole)


def test_the_page_is_no_larger_than_its_bound(driver: Any) -> None:
    assert _sizes("no file")[0] <= MOST
    assert _sizes("de-")[1] <= MOST_PACKED


def test_the_page_without_webgl_is_no_larger_than_its_bound(driver: Any) -> None:
    whole, packed = _sizes("scene3d", "de-")
    assert whole <= MOST_WITHOUT_3D
    assert packed <= MOST_PACKED_WITHOUT_3D


def test_the_german_words_are_no_larger_than_their_bound(driver: Any) -> None:
    whole, packed = _sizes("scene3d", "index")
    assert whole <= MOST_GERMAN
    assert packed <= MOST_PACKED_GERMAN


def _button(text: str) -> str:
    return f"[...document.querySelectorAll('button')].find(e => e.textContent === '{text}')"


def _tour(page: Page) -> list[str]:
    """Show every task in both languages; return what the page asked for, itself first."""
    page.open()
    for language in ("Deutsch", "English"):
        page.run(f"{_button(language)}.click()")
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


def _files(page: Page, asked: list[str]) -> list[str]:
    """Return the files among what was asked for: the list of servers is none."""
    return [each for each in asked if each != f"{page.address}servers"]


def test_a_page_without_webgl_asks_for_three_files_and_not_for_three_js(page: Page) -> None:
    asked = _tour(page)
    assert len(_files(page, asked)) <= MOST_FILES - 1
    assert not [each for each in asked if "scene3d" in each]
    assert [each for each in asked if not each.startswith(page.address)] == []
    assert page.console() == []


@pytest.fixture(scope="module")
def webgl(driver: Any) -> Iterator[Any]:
    """A browser that draws in three dimensions, by software."""
    started = chromium(COMPOSED_IN_3D)
    show_at(started, 1024, 600)  # software draws each point
    yield started
    started.quit()


def test_a_page_with_webgl_asks_for_four_files_and_writes_nothing_to_the_console(
    page_rig: PageRig, webgl: Any
) -> None:
    page = Page(page_rig, webgl, f"http://127.0.0.1:{page_rig.gateway}/")
    _tour(page)
    page.wait("performance.getEntriesByType('resource').some(e => e.name.includes('scene3d'))")
    asked = _asked_so_far(page)
    assert len(_files(page, asked)) <= MOST_FILES
    assert [each for each in asked if not each.startswith(page.address)] == []
    assert page.console() == []


_TAPPED = """
globalThis.contexts = [];
globalThis.pictures = [];
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  const found = getContext.call(this, kind, ...rest);
  if (kind === 'webgl2' && found !== null && !contexts.includes(found)) contexts.push(found);
  return found;
};
let solids = 0;
const {drawElements, fenceSync} = WebGL2RenderingContext.prototype;
WebGL2RenderingContext.prototype.drawElements = function (...all) {
  solids += 1;
  return drawElements.apply(this, all);
};
WebGL2RenderingContext.prototype.fenceSync = function (...all) {
  pictures.push(solids);
  return fenceSync.apply(this, all);
};
"""
"""Notes each context of WebGL, and how many solids were drawn up to the end of each picture."""


@pytest.fixture(scope="module")
def tapped(page_rig: PageRig, webgl: Any) -> Page:
    """A page whose robot is seen in three dimensions, with its WebGL tapped from the beginning."""
    webgl.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": _TAPPED})
    page = Page(page_rig, webgl, f"http://127.0.0.1:{page_rig.gateway}/")
    page.open()
    page.wait("document.querySelector('canvas[data-shows-robot]') !== null", within=30)
    return page


def test_the_first_picture_in_three_dimensions_shows_the_robot_already(tapped: Page) -> None:
    assert tapped.run("return pictures[0]") > 0


def test_software_begins_webgl_once(tapped: Page) -> None:
    assert tapped.run("return contexts.length") == 1


def test_another_language_leaves_no_context_of_webgl_behind(tapped: Page) -> None:
    page = tapped
    for language in ("Deutsch", "English"):
        page.run(f"{_button(language)}.click()")
        page.wait("document.querySelector('canvas[data-shows-robot]') !== null", within=30)
    assert page.run("return contexts.filter(each => !each.isContextLost()).length") == 1
