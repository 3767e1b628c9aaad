"""The states of the page, each as it stands on the screen; their pictures go to `test-output/`."""

import time
from collections.abc import Iterator

import pytest

from browser.page_rig import Page, PageRig, free_port
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime


def state(page: Page) -> str:
    """Return the state that the page is in."""
    return str(page.run("return document.querySelector('.frame').dataset.state"))


def waits_for(page: Page, wanted: str, within: float = 10.0) -> None:
    """Wait until the page is in a state."""
    page.wait(f"document.querySelector('.frame').dataset.state === '{wanted}'", within)


@pytest.fixture
def other(page_rig: PageRig) -> Iterator[SyncPendantClient]:
    """Another client of the same cell."""
    with SyncPendantClient.connect(port=page_rig.server, client="Anna") as client:
        yield client


def test_an_observer_reads_who_holds_control_and_its_stop_works(
    page_rig: PageRig, other: SyncPendantClient
) -> None:
    page = page_rig.page()
    page.open()
    page.wait("document.querySelector('.chips').innerText.includes('Nobody')")
    with other.control():
        page.run("document.querySelector('.checklist .quiet').click()")
        page.wait("document.querySelector('.banner').innerText.includes('Anna holds control')")
        assert state(page) == "observer"
        assert "Ask for control" in page.text(".main-act")
        page.picture("observer")
        page.tap_key("Space", " ")
        waits_for(page, "stopped")
        other.reset_stop()
    waits_for(page, "observer")


def test_whoever_is_in_control_may_jog_and_the_driven_joint_is_named(page: Page) -> None:
    page.hold_enabling()
    page.key(True, "Digit1", "1")
    page.jogs()
    page.wait("document.querySelector('.held-line').innerText.includes('Base + held')")
    assert state(page) == "control"
    page.picture("in-control")


def test_a_motion_of_its_own_offers_a_pause(page: Page) -> None:
    page.tap_key("KeyM", "m")
    page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
    find = "[...document.querySelectorAll('.homes button')].find(b => b.innerText.endsWith({!r}))"
    page.wait(f"!{find.format('zero')}.hasAttribute('aria-disabled')")
    x, y = page.run(
        f"const b = {find.format('zero')}.getBoundingClientRect();"
        "return [b.x + b.width / 2, b.y + b.height / 2]"
    )
    page.mouse("mouseMoved", (x, y))
    page.mouse("mousePressed", (x, y))
    waits_for(page, "running")
    assert "Pause" in page.text(".main-act")
    page.picture("running")
    page.mouse("mouseReleased", (x, y))
    waits_for(page, "control")
    page.tap_key("KeyM", "m")


def test_a_stop_is_ended_in_two_steps_and_pressed_again_it_stops_on(page: Page) -> None:
    page.tap_key("Space", " ")
    waits_for(page, "stopped")
    page.wait("document.querySelector('.stop').innerText.includes('is pressed')")
    page.picture("stopped")
    page.tap_key("F8", "F8")
    time.sleep(0.3)
    assert state(page) == "stopped"
    page.run("[...document.querySelectorAll('.steps-of-stop button')][1].click()")
    time.sleep(0.3)
    assert state(page) == "stopped", "a reset before the release ends no stop"
    page.reset_stop()


def test_a_stop_that_is_pressed_without_a_link_is_sent_as_soon_as_there_is_one(
    page_rig: PageRig,
) -> None:
    port = free_port()
    gateway = page_rig.start_gateway(port)
    page = page_rig.page(port)
    page.ready()
    page.wait("document.querySelector('.brand .place').innerText.includes('kawasaki')")
    gateway.kill()
    gateway.end(10)
    waits_for(page, "disconnected")
    page.wait("document.querySelector('.stop').innerText.includes('no link')")
    page.wait("document.querySelector('.banner').innerText.includes('No link')")
    page.picture("disconnected")
    page.tap_key("Space", " ")
    gateway = page_rig.start_gateway(port)
    waits_for(page, "stopped", within=20)
    with SyncPendantClient.connect(port=page_rig.server) as client, client.control():
        client.reset_stop()
    waits_for(page, "observer")
