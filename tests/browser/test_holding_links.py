"""A robot stops when what lies between it and the hand fails, and moves no more by itself.

Times run from the fault, or from another client's command, to the first set-point of the ramp, or
the STOP, at the emulator.
"""

import time
from collections.abc import Iterator
from dataclasses import replace

import pytest

from browser.hold_trials import TICK, HoldTrials
from browser.loopback_relay import LoopbackRelay
from browser.motion_tap import Ended
from browser.page_rig import Page, PageRig, free_port
from browser.test_holding import DEADLINE, JOG_FOR
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

STALLED_FOR = 0.7
WATCHED_FOR = 0.7
COMMAND = 0.010
"""From a client's call to the server, and from there to the emulator [s]."""
BY_PAGE = 0.020 + TICK
"""Likewise from a key or a button of the page, as where a key is let go; and a tick [s]."""


@pytest.fixture
def other(page_rig: PageRig) -> Iterator[SyncPendantClient]:
    """Another client of the same cell."""
    with SyncPendantClient.connect(port=page_rig.server, client="another") as client:
        yield client


def _jogs(page: Page, side: str) -> tuple[float, float]:
    """Hold the first joint's button until the robot moves steadily; return where that is."""
    page.hold_enabling()
    at = page.place(0, side)
    page.rig.tap.forget()
    page.mouse("mouseMoved", at)
    page.mouse("mousePressed", at)
    page.jogs()
    time.sleep(JOG_FOR)
    return at


def _stays_at_rest(page: Page) -> None:
    """Watch that nothing moves while the button is held on."""
    page.rig.tap.forget()
    time.sleep(WATCHED_FOR)
    assert page.rig.tap.seen() == [], "it moved again"


def test_a_network_that_stalls_ends_it_as_silent_and_its_old_messages_move_nothing(
    page_rig: PageRig,
) -> None:
    relay = LoopbackRelay(page_rig.gateway)
    page = page_rig.page(relay.port)
    page.ready()

    def trial(side: str) -> Ended:
        at = _jogs(page, side)
        began = time.monotonic()
        relay.stand_still()
        time.sleep(STALLED_FOR)
        found = page.rig.tap.end_of_steady(0, began)
        page.rig.tap.forget()
        relay.go_on()
        _stays_at_rest(page)
        page.stands()
        page.mouse("mouseReleased", at)
        page.key(False, "KeyV", "v")
        return found

    try:
        trials = HoldTrials("the network stalls")
        trials.run(trial, page.ready)
        trials.judge(DEADLINE + TICK)
    finally:
        page.let_all_go()
        relay.close()


def test_a_stop_of_another_client_ends_it(page: Page, other: SyncPendantClient) -> None:
    def trial(side: str) -> Ended:
        at = _jogs(page, side)
        began = time.monotonic()
        other.stop("a test")
        page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        _stays_at_rest(page)
        page.mouse("mouseReleased", at)
        page.key(False, "KeyV", "v")
        page.reset_stop()
        return found

    trials = HoldTrials("STOP of another client")
    trials.run(trial, page.ready)
    trials.judge(TICK + COMMAND, {"stop"})


def test_a_control_that_is_given_up_ends_it(page: Page) -> None:
    """In a manual mode nobody takes it away."""

    def trial(side: str) -> Ended:
        at = _jogs(page, side)
        began = time.monotonic()
        page.run("document.querySelector('.main-act').click()")
        page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        page.wait("document.querySelector('.chips').innerText.includes('Nobody')")
        _stays_at_rest(page)
        page.mouse("mouseReleased", at)
        page.key(False, "KeyV", "v")
        page.tap_key("KeyC", "c")
        page.wait("document.querySelector('.chips').innerText.includes('You')")
        return found

    trials = HoldTrials("control is given up")
    trials.run(trial, page.ready)
    trials.judge(BY_PAGE, {"stop", "ramp"})


def test_another_mode_ends_it(page: Page) -> None:
    def trial(side: str) -> Ended:
        at = _jogs(page, side)
        began = time.monotonic()
        page.tap_key("KeyM", "m")
        page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
        _stays_at_rest(page)
        page.mouse("mouseReleased", at)
        page.key(False, "KeyV", "v")
        page.tap_key("KeyM", "m")
        page.wait("document.querySelector('.chips').innerText.includes('T1')")
        return found

    trials = HoldTrials("another mode")
    trials.run(trial, page.ready)
    trials.judge(BY_PAGE, {"stop", "ramp"})


def test_a_gateway_that_is_killed_stops_the_robot(page_rig: PageRig) -> None:
    def trial(side: str) -> Ended:
        port = free_port()
        gateway = page_rig.start_gateway(port)
        page = page_rig.page(port)
        page.ready()
        _jogs(page, side)
        began = time.monotonic()
        gateway.kill()
        gateway.wait(10)
        dead = time.monotonic()
        page.rig.tap.wait_for_rest()
        found = page.rig.tap.end_of_steady(0, began)
        _stays_at_rest(page)
        page.let_all_go()
        return replace(found, began=dead, at=max(dead, found.at))

    trials = HoldTrials("the gateway is killed, from its death on")
    trials.run(trial, lambda: None)
    trials.judge(TICK, {"stop"})
