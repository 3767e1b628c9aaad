"""Plots in a real browser: lines are drawn, and one cursor goes over all three."""

import pytest

from browser.page_rig import Page, PageRig

CANVASES = "document.querySelectorAll('.plots-dock canvas')"
COLOUR = [0xFF, 0x7A, 0x66]
"""Of the first joint's lines."""
DRAWN = (
    "(() => {const from = document.querySelector('.plots-dock canvas');"
    "const copy = new OffscreenCanvas(from.width, from.height);"
    "const paper = copy.getContext('2d', {willReadFrequently: true});"
    "paper.drawImage(from, 0, 0);"
    "const {data} = paper.getImageData(0, 0, from.width, from.height);"
    "let found = 0;"
    "for (let at = 0; at < data.length; at += 4)"
    f" if ({COLOUR}.every((part, index) => Math.abs(data[at + index] - part) < 24)) found += 1;"
    "return found})()"
)
"""Points of the first plot in that colour."""


@pytest.fixture
def plots(page: Page) -> Page:
    """A page that shows how the first joint was driven, which has just moved."""
    page.hold_enabling()
    page.key(True, "Digit1", "1")
    page.jogs()
    page.let_all_go()
    page.stands()
    page.run("document.querySelector('[data-task=plots]').click()")
    page.wait(f"{CANVASES}.length === 3")
    return page


def test_a_driven_joint_is_a_line_in_its_colour(plots: Page) -> None:
    plots.wait(f"{DRAWN} > 20")


def test_a_line_does_not_end_a_plot_that_is_dragged_and_shown_whole_again(plots: Page) -> None:
    plots.wait(f"{DRAWN} > 20")
    box = "document.querySelector('.plots-dock .plot-over').getBoundingClientRect()"
    x, y = plots.run(f"const b = {box}; return [b.x + b.width / 2, b.y + b.height / 2]")
    plots.mouse("mousePressed", (x, y))
    plots.mouse("mouseMoved", (x + 40, y))
    plots.mouse("mouseReleased", (x + 40, y))
    plots.run("document.querySelectorAll('.plots-dock header > button')[1].click()")
    plots.wait(f"{DRAWN} > 20")


def test_the_cursor_stands_at_one_time_in_all_three_plots(plots: Page) -> None:
    box = "document.querySelector('.plots-dock .plot-over').getBoundingClientRect()"
    x, y = plots.run(f"const b = {box}; return [b.x + b.width / 3, b.y + b.height / 2]")
    plots.run("document.querySelectorAll('.plots-dock header > button')[0].click()")
    plots.mouse("mouseMoved", (x, y))
    places = (
        "[...document.querySelectorAll('.plots-dock .plot-cursor')].map("
        "each => new DOMMatrix(each.style.transform).e)"
    )
    plots.wait(f"{places}.every(place => place > 20 && Math.abs(place - {places}[0]) < 2)")
    plots.run("document.querySelectorAll('.plots-dock header > button')[0].click()")


def test_a_saved_picture_has_the_lines_on_the_ground_of_the_page(plots: Page) -> None:
    plots.wait(f"{DRAWN} > 20")
    plots.run("URL.createObjectURL = blob => (window.saved = blob, 'data:,')")
    plots.run("document.querySelectorAll('.plots-panel .acts button')[1].click()")
    plots.wait("window.saved?.type === 'image/png'")
    found = plots.run(
        "const picture = await createImageBitmap(window.saved);"
        "const copy = new OffscreenCanvas(picture.width, picture.height);"
        "const paper = copy.getContext('2d'); paper.drawImage(picture, 0, 0);"
        "const {data} = paper.getImageData(0, 0, picture.width, picture.height);"
        "let lines = 0;"
        f"for (let at = 0; at < data.length; at += 4) if ({COLOUR}.every("
        "(part, index) => Math.abs(data[at + index] - part) < 24)) lines += 1;"
        "return [...data.slice(0, 4), lines > 20]"
    )
    assert found == [0x1A, 0x20, 0x26, 0xFF, True]


def test_plots_write_nothing_to_the_console(page_rig: PageRig, plots: Page) -> None:
    assert plots.console() == []
