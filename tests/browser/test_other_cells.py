"""Robots with other axes, a controller that is not known to be emulated, and one that is gone."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser.page_rig import Page, PageRig
from browser.test_states import waits_for

pytestmark = pytest.mark.realtime


@pytest.fixture(params=["fanuc_m410ib", "kuka_iiwa14", "rail_kr5_arc"])
def cell(
    request: pytest.FixtureRequest, driver: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[PageRig]:
    """A cell whose robot has 4 axes, 7, or 6 on a rail, and whose controller may be a real one."""
    folder = Path(tmp_path_factory.mktemp(request.param))
    with PageRig(folder, driver, robot=request.param, serve=()) as rig:
        yield rig


ROWS = {"fanuc_m410ib": 4, "kuka_iiwa14": 7, "rail_kr5_arc": 7}


def _rows(page: Page) -> int:
    return int(page.run("return document.querySelectorAll('.row').length"))


def test_a_cell_that_is_not_known_to_be_emulated_has_its_rows_a_grey_stop_and_its_fault(
    cell: PageRig, request: pytest.FixtureRequest
) -> None:
    name = request.node.callspec.params["cell"]
    page = cell.page()
    page.open()
    page.wait("document.querySelector('.kind').innerText === 'REAL ROBOT'")
    assert _rows(page) == ROWS[name]
    assert not page.run("return document.querySelector('.stop').classList.contains('training')")
    page.tap_key("KeyC", "c")
    page.wait("document.querySelector('.chips').innerText.includes('You')")
    page.tap_key("KeyM", "m")
    page.wait("document.querySelector('.chips').innerText.includes('T1')")
    page.hold_enabling()
    assert not page.run(
        "return [...document.querySelectorAll('.positions button')]"
        ".some(b => b.innerText === 'Kept' && b.offsetParent)"
    )
    page.key(True, f"Digit{ROWS[name]}", str(ROWS[name]))
    page.jogs()
    page.key(False, f"Digit{ROWS[name]}", str(ROWS[name]))
    page.stands()
    page.picture(f"cell-{name}")
    page.let_all_go()
    cell.end_emulator()
    waits_for(page, "fault")
    page.wait("document.querySelector('.banner').innerText.includes('controller')")
    page.picture("fault")
