"""What stands around, in a real browser: added, dragged, resized, held by the tool, undone."""

import time

import pytest

from browser.page_rig import Page, PageRig
from browser.picture_handles import boxes, drag, handle
from browser.test_plan import _task
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

PLACE = ".object-editor .three:not(.three ~ .three) input"
SIZES = ".object-editor .three ~ .three input"
HOLD = "document.querySelector('.grasp button')"


def _objects(page: Page) -> list[str]:
    found: list[str] = page.run(
        "return [...document.querySelectorAll('.object strong')].map(e => e.innerText)"
    )
    return found


def _put(page: Page, selector: str, values: dict[int, float]) -> None:
    """Type numbers into boxes, in mm or degrees."""
    for index, value in values.items():
        box = f"document.querySelectorAll('{selector}')[{index}]"
        page.run(f"{box}.value = '{value:.2f}'; {box}.dispatchEvent(new Event('change'))")


def _save(page: Page) -> None:
    page.wait("!document.querySelector('.object-editor .acts button').ariaDisabled")
    page.run("document.querySelectorAll('.object-editor .acts button')[1].click()")
    page.wait("document.querySelector('.object-editor .acts button').ariaDisabled === 'true'")


def _handles_do(page: Page, what: str) -> None:
    page.run(f"document.querySelector('.scene [data-drags={what}]').click()")
    page.wait(f"document.querySelector('.scene [data-drags={what}].chosen')")


@pytest.fixture
def scene(page_rig: PageRig) -> Page:
    """A page in control, at the scene, in which one box stands beside the robot."""
    with SyncPendantClient.connect(port=page_rig.server, client="clears") as other:
        told = other.scene.show()
        revision = told["revision"]
        for each in told["content"]["objects"]:
            if "link" in each:
                revision = other.scene.detach(each["name"], revision)["revision"]
            revision = other.scene.remove(each["name"], revision)["revision"]
    page = page_rig.page()
    page.ready()
    _task(page, "scene")
    page.wait("document.querySelector('.scene header').innerText.includes('0 of this cell')")
    page.run("document.querySelector('.kinds button').click()")
    page.wait("document.querySelectorAll('.object').length === 1")
    page.wait(f"document.querySelectorAll('{PLACE}').length === 6")
    return page


def test_an_object_that_is_dragged_is_saved_where_it_was_let_go(scene: Page) -> None:
    before = boxes(scene, PLACE)
    drag(scene, handle(scene, "z"), (0.0, -60.0))
    scene.wait("!document.querySelector('.object-editor .foot p').hidden")
    moved = boxes(scene, PLACE)
    assert moved[2] > before[2] + 30, "it went up"
    assert moved[:2] == before[:2]
    _save(scene)
    with SyncPendantClient.connect(port=scene.rig.server, client="looks") as other:
        (kept,) = other.scene.show()["content"]["objects"]
    assert kept["position"][2] * 1000 == pytest.approx(moved[2], abs=0.06)


def test_an_object_is_resized_by_its_handles_and_by_numbers(scene: Page) -> None:
    before = boxes(scene, SIZES)
    _handles_do(scene, "size")
    drag(scene, handle(scene, "z"), (0.0, -60.0))
    scene.wait("!document.querySelector('.object-editor .foot p').hidden")
    grown = boxes(scene, SIZES)
    assert grown[2] > 1.2 * before[2]
    assert grown[:2] == before[:2]
    _put(scene, SIZES, {0: 320.0})
    _save(scene)
    with SyncPendantClient.connect(port=scene.rig.server, client="looks") as other:
        (kept,) = other.scene.show()["content"]["objects"]
    assert [1000 * each for each in kept["shape"]["size"]] == pytest.approx(
        [320.0, *grown[1:]], abs=0.06
    )


def test_what_is_dragged_and_put_back_was_never_saved(scene: Page) -> None:
    before = boxes(scene, PLACE)
    drag(scene, handle(scene, "z"), (0.0, -40.0))
    scene.wait("!document.querySelector('.object-editor .acts button').ariaDisabled")
    scene.run("document.querySelectorAll('.object-editor .acts button')[0].click()")
    scene.wait("document.querySelector('.object-editor .acts button').ariaDisabled === 'true'")
    assert boxes(scene, PLACE) == before
    with SyncPendantClient.connect(port=scene.rig.server, client="looks") as other:
        assert other.scene.show()["revision"] == _revision(scene)


def _revision(page: Page) -> int:
    with SyncPendantClient.connect(port=page.rig.server, client="counts") as other:
        revision: int = other.scene.show()["revision"]
        return revision


def test_the_last_change_is_undone_and_somebody_elses_is_none(scene: Page) -> None:
    undo = "document.querySelector('.scene header button')"
    before = boxes(scene, PLACE)
    _put(scene, PLACE, {0: before[0] + 50.0})
    _save(scene)
    scene.run(f"{undo}.click()")
    scene.wait(f"Math.abs(document.querySelector('{PLACE}').value - {before[0]}) < 0.1")
    box = {"name": "theirs", "shape": {"type": "sphere", "radius": 0.05}, "position": [2, 2, 1]}
    with SyncPendantClient.connect(port=scene.rig.server, client="another") as other:
        other.scene.add(box, _revision(scene))
    scene.wait("document.querySelectorAll('.object').length === 2")
    assert scene.run(f"return {undo}.ariaDisabled") == "true"


def test_an_object_is_held_from_within_10_mm_of_the_grasp_point_and_left_again(
    scene: Page,
) -> None:
    cells = "[...document.querySelectorAll('.tool-place td')].map(e => parseFloat(e.innerText))"
    tool: list[float] = scene.run(f"return {cells}")
    below = tool[2] - 50.0
    _put(scene, PLACE, {0: tool[0], 1: tool[1], 2: below - 25.0})
    _save(scene)
    scene.wait(f"{HOLD}.innerText === 'Attach: 25.0 mm away'")
    assert scene.run(f"return {HOLD}.ariaDisabled") == "true"
    assert "25.0 mm from the grasp point; the tool reaches 10.0 mm" in scene.text(".grasp p")
    before = _revision(scene)
    scene.run(f"{HOLD}.click()")
    time.sleep(0.3)
    assert _revision(scene) == before, "what is too far away is not held"
    _put(scene, PLACE, {2: below - 6.0})
    _save(scene)
    scene.wait(f"{HOLD}.innerText === 'Attach' && !{HOLD}.ariaDisabled")
    scene.run(f"{HOLD}.click()")
    scene.wait("document.querySelector('.object .where').innerText.startsWith('held')")
    scene.wait(f"{HOLD}.innerText === 'Detach here'")
    assert "Gripped 6.0 mm from the grasp point" in scene.text(".grasp p")
    scene.run(f"{HOLD}.click()")
    scene.wait("document.querySelector('.object .where').innerText === 'stands'")
    assert boxes(scene, PLACE)[2] == pytest.approx(below - 6.0, abs=0.2)
    undo = "document.querySelector('.scene header button')"
    scene.run(f"{undo}.click()")
    scene.wait("document.querySelector('.object .where').innerText.startsWith('held')")
    scene.run(f"{undo}.click()")
    scene.wait("document.querySelector('.object .where').innerText === 'stands'")
    assert boxes(scene, PLACE)[2] == pytest.approx(below - 6.0, abs=0.2)
