"""What comes broken, late or not at all: the page stays usable, and says what is wrong."""

import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser.page_rig import ROBOT, Page, PageRig, free_port, own_tab
from browser.spoiling_relay import (
    MANAGEMENT,
    STATE,
    Spoil,
    SpoilingRelay,
    framed,
    kind_of,
    with_answer,
)
from openpendant.motion.description.robot import ParallelRobot, load_robot
from openpendant.motion.kinematics.stewart.platform import StewartKinematics
from openpendant.motion.robot_report.robot_report import robot_data
from openpendant.motion.robot_report.shapes_report import shapes_report
from openpendant.motion.visuals.drawing import link_poses
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

URDF = Path(__file__).parents[1] / "robots_files" / "seven_axes.urdf"


class Spoiled:
    """A page whose server can be spoiled."""

    def __init__(self, page: Page, relay: SpoilingRelay, gateway: Any) -> None:
        self.page = page
        self.relay = relay
        self.gateway = gateway
        self.has_vanished = False

    def vanish(self) -> None:
        """Let the server be gone, for good."""
        self.has_vanished = True
        self.relay.close()

    def comes_back(self) -> None:
        """Wait until the page shows the cell again, fresh, and can take control."""
        page = self.page
        page.wait("document.querySelector('.chips').innerText.includes('Connected')", within=20)
        page.wait("document.querySelector('.frame').dataset.state === 'observer'")
        page.wait("document.querySelector('.age').hidden")
        page.tap_key("KeyC", "c")
        page.wait("document.querySelector('.chips').innerText.includes('You')")


@pytest.fixture
def spoiled(page_rig: PageRig) -> Iterator[Spoiled]:
    """A page in control by a gateway of its own, whose server is behind a relay that can spoil."""
    relay = SpoilingRelay(page_rig.server)
    port = free_port()
    gateway = page_rig.start_gateway(port, relay.port)
    page = page_rig.page(port)
    page.ready()
    page.run("window.faults = []; addEventListener('error', e => faults.push(e.message));")
    page.run("addEventListener('unhandledrejection', e => faults.push(String(e.reason)))")
    made = Spoiled(page, relay, gateway)
    yield made
    relay.spoil = None
    assert page.run("return window.faults ?? []") == []
    page.let_all_go()
    page.driver.get("about:blank")
    gateway.send_signal(signal.SIGCONT)
    page_rig.end(gateway)
    if not made.has_vanished:
        relay.close()


def _noise(_: bytes) -> bytes:
    return bytes(range(1, 65))


def _cut_frame(frame: bytes) -> bytes:
    """Half of it, in front of what comes next."""
    return frame[: len(frame) // 2]


def _cut_body(frame: bytes) -> bytes:
    """A whole frame whose body is none of its type."""
    return framed(frame, frame[16:40])


def _no_json(frame: bytes) -> bytes:
    return framed(frame, frame[16:20] + b'{"half": ')


@pytest.mark.parametrize(
    ("spoil", "kind"),
    [(_noise, STATE), (_cut_frame, STATE), (_cut_body, STATE), (_no_json, MANAGEMENT)],
    ids=["noise", "cut frame", "another body", "half an answer"],
)
def test_what_is_no_message_ends_the_link_says_so_and_leaves_a_page_that_comes_back(
    spoiled: Spoiled, spoil: Spoil, kind: int
) -> None:
    page = spoiled.page
    spoiled.relay.spoil_once(spoil, kind)
    # The checklist asks why the robot does not move.
    page.tap_key("Slash", "?")
    page.wait("document.querySelector('.banner').innerText.includes('No link')")
    spoiled.comes_back()


def test_a_message_of_a_type_that_nobody_knows_is_passed_over(spoiled: Spoiled) -> None:
    def strange(frame: bytes) -> bytes:
        return frame + framed(frame[:4] + (64999).to_bytes(4, "little") + frame[8:], b"later")

    spoiled.relay.spoil = strange
    time.sleep(1.0)
    assert "You" in spoiled.page.text(".chips")
    assert "Connected" in spoiled.page.text(".chips")


def test_values_that_are_no_numbers_are_shown_as_none_and_the_page_goes_on(
    spoiled: Spoiled,
) -> None:
    def empty(frame: bytes) -> bytes:
        if kind_of(frame) != STATE:
            return frame
        # Positions, velocities and the place of the tool end a state.
        return frame[:-108] + struct.pack("<27f", *[float("nan")] * 27)

    page = spoiled.page
    spoiled.relay.spoil = empty
    page.wait("!/\\d/.test(document.querySelector('.tool-place td').innerText)")
    spoiled.relay.spoil = None
    page.wait("/\\d/.test(document.querySelector('.tool-place td').innerText)")


def test_a_server_that_vanishes_stops_what_is_held_and_leaves_greyed_values_with_their_age(
    spoiled: Spoiled,
) -> None:
    page = spoiled.page
    page.hold_enabling()
    page.key(True, "Digit1", "1")
    page.jogs()
    spoiled.vanish()
    page.wait("document.querySelector('.frame').dataset.state === 'disconnected'")
    page.wait("document.querySelector('.banner').innerText.includes('trying again in')")
    page.wait("document.querySelector('.stop').innerText.includes('no link')")
    page.wait("document.querySelector('.age').innerText.includes('s old')")
    assert page.run("return document.querySelectorAll('.jog-key:not([aria-disabled])').length") == 0
    page.rig.tap.wait_for_rest()
    page.run("document.querySelector('[data-task=teach]').click()")
    page.wait("document.querySelector('.panel .teach, .teach')?.offsetParent")
    page.run("document.querySelector('[data-task=jog]').click()")


def test_a_gateway_that_stands_still_is_told_within_a_second_and_nothing_moves_afterwards(
    spoiled: Spoiled,
) -> None:
    page = spoiled.page
    page.hold_enabling()
    page.key(True, "Digit1", "1")
    page.jogs()
    spoiled.gateway.send_signal(signal.SIGSTOP)
    page.wait("document.querySelector('.chips').innerText.includes('Silent')", within=2)
    page.wait("!document.querySelector('.age').hidden")
    page.rig.tap.wait_for_rest()
    page.rig.tap.forget()
    spoiled.gateway.send_signal(signal.SIGCONT)
    page.wait("document.querySelector('.age').hidden", within=20)
    time.sleep(0.5)
    assert page.rig.tap.seen() == [], "it moved again"


def test_a_controller_that_takes_steps_only_has_step_buttons_and_a_line_that_says_why(
    spoiled: Spoiled,
) -> None:
    def toy(frame: bytes) -> bytes:
        return with_answer(
            frame, lambda data: {**data, "jog": "increments"} if "jog" in data else data
        )

    page = spoiled.page
    spoiled.relay.spoil = toy
    page.ready()
    page.wait("document.querySelector('.jog').innerText.includes('takes steps only')")
    hold = (
        "[...document.querySelectorAll('.steps button')].find(b => b.innerText.startsWith('Hold'))"
    )
    assert page.run(f"return {hold}.ariaDisabled") == "true"
    page.key(True, "KeyV", "v")
    page.wait("document.querySelector('.enabling').classList.contains('on')")
    page.rig.tap.forget()
    page.key(True, "Digit6", "6")
    page.rig.tap.wait_for_motion()
    page.rig.tap.wait_for_rest()
    steps = len(page.rig.tap.seen())
    time.sleep(0.5)
    assert len(page.rig.tap.seen()) == steps, "a key that is held is one step"


@pytest.fixture
def alone(page_rig: PageRig, driver: Any) -> Iterator[Page]:
    """A page in a tab of its own: one that slept, or was hidden, may draw no more."""
    driver.get("about:blank")
    with own_tab(driver):
        page = page_rig.page()
        page.ready()
        yield page


def test_a_page_that_sleeps_stops_the_robot_and_wakes_with_what_is_true_now(alone: Page) -> None:
    page = alone
    page.hold_enabling()
    page.key(True, "Digit1", "1")
    page.jogs()
    page.cdp("Page.setWebLifecycleState", state="frozen")
    page.rig.tap.wait_for_rest()
    page.rig.tap.forget()
    time.sleep(5.0)
    page.cdp("Page.setWebLifecycleState", state="active")
    page.wait("document.querySelector('.chips').innerText.includes('Connected')", within=20)
    page.wait("document.querySelector('.age').hidden")
    assert page.rig.tap.seen() == [], "nothing moved while it slept, nor when it woke"


_DRAW_SLOWLY = """
window.drawnFor = 0;
const next = window.requestAnimationFrame;
window.requestAnimationFrame = (draw) => next((at) => {
  const began = performance.now();
  draw(at);
  while (performance.now() < began + 60);
  window.drawnFor += performance.now() - began;
});
"""


def test_a_page_that_draws_slowly_keeps_most_of_the_time_for_the_beats(alone: Page) -> None:
    page = alone
    page.hold_enabling()
    page.run(_DRAW_SLOWLY)
    page.key(True, "Digit1", "1")
    page.jogs()
    page.run("window.drawnFor = 0; window.lookedFrom = performance.now()")
    time.sleep(2.0)
    share = page.run("return window.drawnFor / (performance.now() - window.lookedFrom)")
    assert 0.2 < share < 0.42
    assert "Jogging" in page.text(".chips")
    page.let_all_go()


def _await_holder(client: SyncPendantClient, *, is_there: bool) -> None:
    until = time.monotonic() + 2.0
    while client.state is None or (client.state.holder != 0) != is_there:
        assert time.monotonic() < until, f"holder {client.state and client.state.holder}"
        time.sleep(0.02)


def test_a_page_that_is_left_gives_its_control_up_at_once_and_comes_back(alone: Page) -> None:
    """A browser keeps it as it is, with its socket, for who goes back."""
    page = alone
    with SyncPendantClient.connect(port=page.rig.server, client="Anna") as other:
        _await_holder(other, is_there=True)
        page.driver.get("about:blank")
        _await_holder(other, is_there=False)
        page.driver.back()
        page.wait("document.querySelector('.chips')?.innerText.includes('Connected')")
        page.wait("document.querySelector('.chips').innerText.includes('Nobody')")


def test_a_tab_in_the_background_knows_the_cell_when_it_is_shown_again(alone: Page) -> None:
    page, driver = alone, alone.driver
    first = driver.current_window_handle
    driver.switch_to.new_window("tab")
    second = driver.current_window_handle
    time.sleep(4.0)
    driver.close()
    driver.switch_to.window(first)
    assert second != first
    page.wait("document.querySelector('.chips').innerText.includes('Connected')")
    page.wait("document.querySelector('.age').hidden")
    page.wait("/You|Nobody/.test(document.querySelector('.chips').innerText)")


def _save_large(page: Page, count: int) -> None:
    """Save a program of so many points and moves, as another client."""
    points = [f"point p{n} joints {n / 2000} -0.2 -1.4 0 0.2 0 rad" for n in range(count)]
    moves = [f"move PTP p{n}" for n in range(count)]
    text = "\n".join(
        ["openpendant-program/1", f'program "large" robot {ROBOT}', *points, *moves, ""]
    )
    parts = [text[at : at + 30_000] for at in range(0, len(text), 30_000)]
    with SyncPendantClient.connect(port=page.rig.server, client="teacher") as other:
        found = [p for p in other.programs.list()["programs"] if p["name"] == "large"]
        revision = found[0]["revision"] if found else 0
        for part, body in enumerate(parts, 1):
            other.programs.save("large", body, revision, part=part, parts=len(parts))


ROWS = "Number(document.querySelector('.program-grid')?.ariaRowCount)"


def _press(page: Page, words: str) -> None:
    """Press a button of Teach by its words, once it is on."""
    found = (
        "[...document.querySelectorAll('.teach button')].find(b => b.offsetParent !== null"
        f" && [b.innerText.trim(), b.ariaLabel].includes({words!r}))"
    )
    page.wait(f"{found} && {found}.ariaDisabled !== 'true'")
    page.run(f"{found}.click()")


def test_a_program_of_1000_points_is_shown_edited_and_undone_while_it_is_checked(
    page: Page,
) -> None:
    _save_large(page, 1000)
    page.run("document.querySelector('[data-task=teach]').click()")
    entries = "[...document.querySelectorAll('.programs .entry')]"
    page.wait(f"{entries}.some(b => b.innerText.includes('large'))")
    page.run(f"{entries}.find(b => b.innerText.includes('large')).click()")
    page.wait(f"{ROWS} === 1000", within=20)
    page.wait("document.querySelectorAll('.program-row').length < 100")
    page.wait(
        "[...document.querySelectorAll('.program-row')].some(e => e.innerText.includes('p999'))"
    )
    _press(page, "Delete line")
    page.wait(f"{ROWS} === 999", within=20)
    page.run("document.querySelector('.dry-run').click()")
    page.wait("document.querySelector('.dry-run').innerText.includes('Checking')")
    _press(page, "Undo")
    page.wait(f"{ROWS} === 1000", within=10)
    assert "Checking" in page.text(".dry-run"), "it did not wait for the end of the check"
    page.tap_key("Space", " ")
    page.wait("document.querySelector('.frame').dataset.state === 'stopped'", within=2)
    page.reset_stop()
    page.driver.get("about:blank")


def _drawn_colours(page: Page) -> int:
    """Return how many colours the picture of the cell has: few where only the ground is drawn."""
    script = """
    const canvas = document.querySelector('.host canvas');
    const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const found = new Set();
    for (let at = 0; at < data.length; at += 4) {
      found.add((data[at] >> 3 << 10) + (data[at + 1] >> 3 << 5) + (data[at + 2] >> 3));
    }
    return found.size;
    """
    return int(page.run(script))


def test_a_platform_is_drawn_with_its_legs(spoiled: Spoiled) -> None:
    """None is served yet, so a robot of six axes is told to be one."""
    platform = load_robot("stewart_classroom")
    assert isinstance(platform, ParallelRobot)
    shapes, facts = shapes_report(platform), robot_data(platform)["facts"]
    lengths = StewartKinematics(platform).inverse(
        link_poses(platform, [0.0] * 6)[platform.tool_link]
    )

    def toy(frame: bytes) -> bytes:
        if kind_of(frame) == STATE:
            return frame[:-108] + struct.pack("<6f", *lengths) + frame[-84:]
        return with_answer(frame, told)

    def told(data: dict[str, Any]) -> dict[str, Any]:
        if "facts" in data:
            return {**data, "facts": facts}
        return {**data, **shapes} if "struts" in data or "links" in data else data

    page = spoiled.page
    spoiled.relay.spoil = toy
    page.open()
    page.wait("document.querySelectorAll('.row').length === 6")
    page.run(
        "window.faults = []; addEventListener('error', e => faults.push(e.message));"
        "document.querySelector('.looks button').click();"
        "document.querySelector('.checklist .quiet').click()"
    )
    time.sleep(0.5)
    assert _drawn_colours(page) > 30


def test_an_imported_robot_whose_meshes_are_missing_is_drawn_from_simple_shapes(
    driver: Any, tmp_path: Path
) -> None:
    file = tmp_path / "seven_axes.yaml"
    words = ["robots", "import", str(URDF), "-o", str(file), "--yes"]
    subprocess.run(
        [sys.executable, "-m", "openpendant.tools", *words], check=True, capture_output=True
    )
    with PageRig(tmp_path, driver, robot=str(file)) as rig:
        page = rig.page()
        page.open()
        assert page.run("return document.querySelectorAll('.row').length") >= 7
        assert _drawn_colours(page) > 30
        assert page.text(".note") == "" or not page.run(
            "return document.querySelector('.note').offsetParent !== null"
        )
        page.driver.get("about:blank")
