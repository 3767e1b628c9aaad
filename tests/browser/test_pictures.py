"""The pictures of the page that its design asks for, most of them drawn as sticks.

They go to `test-output/page/`, named as the pictures that they are to be held against. Each test
waits for what its picture is about, so a page that does not show it fails here.
"""

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser.page_rig import WITH_3D, Page, PageRig, chromium, free_port, show_at
from browser.pictured_cell import START, furnish
from browser.test_states import waits_for
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(180)]

CELLS = {"Bench 1": "kawasaki_ra10n", "Bench 2": "abb_irb120", "Hall 4": "fanuc_m10ia"}

JOG_ROW = "document.querySelectorAll('.jog-key')[{}].classList.contains('held')"
_DRAWN_TWICE = "requestAnimationFrame(() => requestAnimationFrame(() => arguments[0]()))"


def _rig(driver: Any, folder: Path, serve: tuple[object, ...]) -> PageRig:
    return PageRig(folder, driver, serve=serve, emulate=("--start", START))


@pytest.fixture(scope="module")
def bench(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """A furnished cell that is known to be emulated."""
    with _rig(driver, Path(tmp_path_factory.mktemp("bench")), ("--emulated",)) as rig:
        with SyncPendantClient.connect(port=rig.server) as integrator, integrator.control():
            furnish(integrator)
        yield rig


@pytest.fixture(scope="module")
def hall(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRig]:
    """A furnished cell that may be a real one."""
    with _rig(driver, Path(tmp_path_factory.mktemp("hall")), ()) as rig:
        with SyncPendantClient.connect(port=rig.server) as integrator, integrator.control():
            furnish(integrator)
        yield rig


@pytest.fixture
def stands(bench: PageRig) -> Iterator[Page]:
    """The page of the bench in control in T1, its robot above the bin, nothing held."""
    page = bench.page()
    page.ready()
    yield page
    page.let_all_go()
    _look(page, "dark")


@pytest.fixture
def automatic(stands: Page) -> Page:
    stands.tap_key("KeyM", "m")
    stands.wait("document.querySelector('.chips').innerText.includes('Automatic')")
    return stands


def _look(page: Page, theme: str) -> None:
    page.run(f"document.documentElement.dataset.theme = '{theme}'")


def _task(page: Page, name: str) -> None:
    page.run(f"document.querySelector('[data-task={name}]').click()")
    page.wait(f"document.querySelector('.panel .{name}') !== null")


def _press(page: Page, words: str) -> None:
    found = (
        "[...document.querySelectorAll('button')].find(b => b.offsetParent !== null"
        f" && [b.innerText.trim(), b.ariaLabel].includes({json.dumps(words)}))"
    )
    page.wait(f"{found} && {found}.ariaDisabled !== 'true'", within=20)
    page.run(f"{found}.click()")


def _plan_round_the_pillar(page: Page) -> None:
    _task(page, "plan")
    goal = "document.querySelector('.plan select')"
    page.wait(f"[...({goal}?.options ?? [])].some(o => o.value === 'above_table')")
    page.run(
        "document.querySelector('[data-way=free]').click();"
        f"{goal}.value = 'above_table'; {goal}.dispatchEvent(new Event('change'));"
        "const planner = document.querySelector('[aria-label=Planner]');"
        "planner.value = 'RRTConnect'; document.querySelector('.plan .acts button').click()"
    )
    page.wait("document.querySelector('.verdict').innerText.includes('can run')", within=30)


def _seek(page: Page, part: float) -> None:
    slider = "document.querySelector('.preview-bar input[type=range]')"
    page.run(f"{slider}.value = {slider}.max * {part}; {slider}.dispatchEvent(new Event('input'))")


def _settled(page: Page, name: str) -> None:
    """Take a picture once what was asked for is drawn, and no fault of a busy machine over it."""
    # States, which move what is drawn, come every 33 ms.
    time.sleep(0.2)
    page.driver.execute_async_script(_DRAWN_TWICE)
    if "fault" not in name:
        page.wait("document.querySelector('.frame').dataset.state !== 'fault'")
    page.picture(name)


def _jogs_with(page: Page, row: int) -> None:
    """Hold enabling by its key and a jog button by the pointer."""
    page.hold_enabling()
    at = page.place(row, "plus")
    page.mouse("mouseMoved", at)
    page.mouse("mousePressed", at)
    page.jogs()


def test_the_lobby(bench: PageRig) -> None:
    server, gateway = bench.serve_cells(CELLS, ("Bench 1", "Bench 2"))
    page = bench.page(gateway)
    with SyncPendantClient.connect(port=server, cell="Bench 2", client="Jonas R.") as jonas:
        with jonas.control():
            page.driver.get(page.address)
            page.run("localStorage.setItem('openpendant.settings', '{\"theme\":\"dark\"}')")
            page.driver.refresh()
            page.wait("document.querySelectorAll('.lobby .cell').length === 3")
            told = page.text(".lobby")
            _settled(page, "v2-lobby")
    assert "Jonas R. is in control" in told
    assert "REAL ROBOT" in told


def test_the_checklist(bench: PageRig) -> None:
    page = bench.page()
    page.ready()
    page.tap_key("KeyM", "m")
    page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
    page.open()
    page.wait("document.querySelector('.checklist').innerText.includes('Four steps')")
    _settled(page, "v2-checklist")


def test_in_control_a_jog_button_is_held(stands: Page) -> None:
    _jogs_with(stands, 0)
    stands.wait("document.querySelector('.held-line').innerText.includes('Base + held')")
    _settled(stands, "best-in-control-jogging")


def test_a_phone_jogs_with_two_thumbs(stands: Page) -> None:
    show_at(stands.driver, 412, 892)
    try:
        stands.wait("document.querySelector('.enabling').offsetParent")
        # The pad lies where it stays only once the narrow page is drawn.
        stands.run(
            "return new Promise(drawn => requestAnimationFrame(() => setTimeout(drawn, 100)))"
        )
        pad = stands.run(
            "const b = document.querySelector('.enabling').getBoundingClientRect();"
            "return [b.x + b.width / 4, b.y + b.height / 3]"
        )
        left = (pad[0], pad[1])
        stands.touch("touchStart", left)
        stands.wait("document.querySelector('.jog-key:not([aria-disabled])') !== null")
        stands.touch("touchStart", left, stands.place(4, "plus"))
        stands.jogs()
        _settled(stands, "v2-phone-jog")
        stands.touch("touchEnd")
    finally:
        show_at(stands.driver, 1366, 820)


def _open_pick(page: Page) -> None:
    _task(page, "teach")
    page.wait("document.querySelector('.programs-button')")
    page.run("document.querySelector('.programs-button').click()")
    pick = (
        "[...document.querySelectorAll('.teach button')].find(b => b.innerText.startsWith('pick'))"
    )
    page.wait(pick)
    page.run(f"{pick}.click()")
    page.wait("document.querySelectorAll('.program-row').length > 9")


def test_a_program_with_a_line_that_cannot_be_reached(automatic: Page) -> None:
    page = automatic
    _open_pick(page)
    _press(page, "Dry run")
    rows = "[...document.querySelectorAll('.program-row')]"
    page.wait(f"{rows}.some(row => row.dataset.mark === 'bad')", within=30)
    page.run(f"{rows}.find(row => row.innerText.includes('place')).click()")
    _settled(page, "v2-teach-program")


def test_a_plan_round_the_pillar_is_looked_at(automatic: Page) -> None:
    _plan_round_the_pillar(automatic)
    _seek(automatic, 0.45)
    _settled(automatic, "v2-plan-preview")
    assert "does not move until you press Execute" in automatic.text(".banner.note")


def test_numbers_of_a_plan_in_the_light(automatic: Page) -> None:
    _plan_round_the_pillar(automatic)
    automatic.run("document.querySelector('.brand').click()")
    _press(automatic, "Light")
    automatic.run("[...document.querySelectorAll('.card .acts button')].at(-1).click()")
    automatic.run("document.querySelector('[data-task=plots]').click()")
    automatic.wait("document.querySelectorAll('.plots-dock canvas').length >= 3")
    _settled(automatic, "v2-plots-light")
    _task(automatic, "jog")
    _settled(automatic, "best-light-theme")


def test_an_object_is_moved_and_its_old_place_stays_as_a_shadow(stands: Page) -> None:
    _task(stands, "scene")
    pillar = "[...document.querySelectorAll('.object')].find(o => o.innerText.includes('pillar'))"
    stands.wait(f"{pillar}")
    stands.run(f"{pillar}.click()")
    box = "document.querySelector('.object-editor .three input')"
    stands.run(f"{box}.value = '150'; {box}.dispatchEvent(new Event('change'))")
    stands.wait("document.querySelector('.object-editor .foot .muted').offsetParent")
    _settled(stands, "v2-scene-edit")


def test_an_observer(bench: PageRig) -> None:
    page = bench.page()
    page.open()
    with SyncPendantClient.connect(port=bench.server, client="Anna") as anna, anna.control():
        page.run("document.querySelector('.checklist .quiet').click()")
        page.wait("document.querySelector('.banner').innerText.includes('Anna holds control')")
        _settled(page, "best-observer")


def test_a_program_runs(automatic: Page) -> None:
    _open_pick(automatic)
    _press(automatic, "Run")
    automatic.wait("document.querySelector('.program-row.current')")
    waits_for(automatic, "running")
    automatic.picture("best-running")
    _press(automatic, "End")
    waits_for(automatic, "control")


def test_a_tablet(stands: Page) -> None:
    show_at(stands.driver, 1024, 600)
    try:
        _jogs_with(stands, 1)
        _settled(stands, "best-tablet-1024x600")
    finally:
        show_at(stands.driver, 1366, 820)


def test_sticks_where_the_browser_cannot_draw(stands: Page) -> None:
    assert stands.run("return document.createElement('canvas').getContext('webgl2')") is None
    _settled(stands, "best-no-webgl-fallback")


def test_the_same_cell_in_three_dimensions(bench: PageRig) -> None:
    drawing = chromium(WITH_3D)
    try:
        page = Page(bench, drawing, f"http://127.0.0.1:{bench.gateway}/")
        page.open()
        page.run("document.querySelector('.checklist .quiet').click()")
        page.wait("document.querySelector('.host canvas[data-engine^=three]')", within=30)
        page.wait("document.querySelector('.host canvas').dataset.showsRobot === ''", within=30)
        # The first one is rough.
        host = "document.querySelector('.host')"
        page.wait(f"{host}.querySelector('canvas').width === {host}.clientWidth")
        time.sleep(0.5)
        page.picture("v2-checklist-3d")
    finally:
        drawing.quit()


def test_packets_of_a_real_robot(hall: PageRig) -> None:
    page = hall.page()
    page.ready()
    _jogs_with(page, 0)
    page.let_all_go()
    page.stands()
    page.run("document.querySelector('[data-task=packets]').click()")
    # States come thirty times a second: among all frames it is out of sight at once.
    box = "document.querySelector('.packets input')"
    page.wait(f"{box} !== null")
    page.run(f"{box}.value = 'jog_start'; {box}.dispatchEvent(new Event('input'))")
    packets = "[...document.querySelectorAll('button.packet')].filter(p => p.offsetParent)"
    start = f"{packets}.find(p => p.children[2].innerText === 'jog_start')"
    page.wait(f"{start}")
    page.run(f"{start}.click()")
    page.wait("document.querySelector('.packet-detail').innerText.includes('jog_start')")
    page.run(f"{box}.value = ''; {box}.dispatchEvent(new Event('input'))")
    page.wait(f"{packets}.some(p => p.classList.contains('state'))")
    page.wait(f"{start}?.classList.contains('selected')")
    _settled(page, "v2-packet-inspector")
    assert page.text(".kind") == "REAL ROBOT"


def test_a_real_robot_that_is_stopped(hall: PageRig) -> None:
    page = hall.page()
    page.ready()
    page.tap_key("Space", " ")
    waits_for(page, "stopped")
    page.wait("document.querySelector('.stop').innerText.includes('is pressed')")
    _settled(page, "v2-stopped-real")
    page.reset_stop()


def test_a_controller_that_is_gone(hall: PageRig) -> None:
    page = hall.page()
    page.ready()
    hall.end_emulator()
    waits_for(page, "fault")
    _settled(page, "best-fault")


def test_a_link_that_is_gone(bench: PageRig) -> None:
    port = free_port()
    gateway = bench.start_gateway(port)
    page = bench.page(port)
    page.open()
    gateway.kill()
    gateway.end(10)
    waits_for(page, "disconnected")
    page.wait("document.querySelector('.banner').innerText.includes('No link')")
    _settled(page, "best-disconnected")
