"""Handles in the picture of the cell, found by their colour and dragged by the pointer."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping

from browser.page_rig import Page

Colour = tuple[int, int, int]

FLAT: dict[str, Colour] = {"x": (229, 72, 77), "y": (63, 191, 95), "z": (76, 141, 255)}
"""Of the stick view, see `colours.ts`."""

_FIND = """
const [shot, [red, green, blue], near, half, finish] = arguments;
const picture = new Image();
picture.onload = () => {
  const box = document.querySelector('.host').getBoundingClientRect();
  const paper = Object.assign(document.createElement('canvas'), picture);
  paper.width = picture.width; paper.height = picture.height;
  const context = paper.getContext('2d');
  context.drawImage(picture, 0, 0);
  const { data } = context.getImageData(0, 0, paper.width, paper.height);
  const is = (x, y) => {
    const at = 4 * (y * paper.width + x);
    const off = [red, green, blue].map((each, index) => Math.abs(data[at + index] - each));
    return off[0] + off[1] + off[2] <= near;
  };
  const disc = [];
  for (let dx = -half; dx <= half; dx += 1) {
    for (let dy = -half; dy <= half; dy += 1) if (Math.hypot(dx, dy) <= half) disc.push([dx, dy]);
  }
  const found = [];
  for (let y = Math.ceil(box.top) + half; y < box.bottom - half; y += 1) {
    for (let x = Math.ceil(box.left) + half; x < box.right - half; x += 1) {
      if (disc.every(([dx, dy]) => is(x + dx, y + dy))) found.push([x, y]);
    }
  }
  // Found from above to below: the first one, and what is beside it.
  const patch = found.filter(([x, y]) => Math.hypot(x - found[0][0], y - found[0][1]) < 4 * half);
  const mean = (index) => patch.reduce((sum, each) => sum + each[index], 0) / patch.length;
  finish(found.length === 0 ? null : [mean(0), mean(1)]);
};
picture.src = 'data:image/png;base64,' + shot;
"""


def seen(page: Page, colour: Colour, *, near: int = 6, half: int = 4) -> tuple[float, float] | None:
    """Return the middle of the uppermost patch of one colour; None where there is none.

    Args:
        near: by how much red, green and blue together may be off.
        half: radius of the smallest patch [points].
    """
    shot = page.cdp("Page.captureScreenshot", format="png")["data"]
    found = page.driver.execute_async_script(_FIND, shot, list(colour), near, half)
    return None if found is None else tuple(found)


DEEP: dict[str, Colour] = {"z": (0, 0, 255)}
"""Of the 3-D view, by three.js."""


def handle(
    page: Page, axis: str, colours: Mapping[str, Colour] = FLAT, *, half: int = 4
) -> tuple[float, float]:
    """Return where the tip of a handle is, which needs a patch of its colour of some radius."""
    until = time.monotonic() + 20.0
    while (at := seen(page, colours[axis], half=half)) is None:
        assert time.monotonic() < until, f"no handle {axis} is in the picture"
    return at


def drag(
    page: Page,
    start: tuple[float, float],
    by: tuple[float, float],
    *,
    steps: int = 10,
    between: Callable[[], object] = lambda: None,
) -> None:
    """Drag from a place by so many points, in steps."""
    x, y = start
    page.mouse("mouseMoved", (x, y))
    page.mouse("mousePressed", (x, y))
    for step in range(1, steps + 1):
        at = (x + by[0] * step / steps, y + by[1] * step / steps)
        page.cdp(
            "Input.dispatchMouseEvent",
            **{"type": "mouseMoved", "x": at[0], "y": at[1], "button": "left", "buttons": 1},
        )
        between()
    page.mouse("mouseReleased", (x + by[0], y + by[1]))
    # A handle under the pointer has another colour.
    left, top = page.run(
        "const b = document.querySelector('.host').getBoundingClientRect(); return [b.x, b.y]"
    )
    page.mouse("mouseMoved", (left + 20, top + 20))


def boxes(page: Page, selector: str) -> list[float]:
    """Return the numbers of some boxes."""
    script = (
        f"return [...document.querySelectorAll({json.dumps(selector)})].map(e => Number(e.value))"
    )
    found: list[float] = page.run(script)
    return found
