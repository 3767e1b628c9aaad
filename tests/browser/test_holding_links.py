"""A robot stops when what lies between it and the hand fails, and moves no more by itself.

Times run from the fault, or from another client's command, to the first set-point of the ramp, or
the STOP, at the emulator. What the page itself takes away (control, mode, frame) has two: from the
key, as where a key is let go; and from what the page says, as it reaches the server: a tick.
"""

import os
import select
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import pytest
from promises.promise_figures import tell

from browser.hold_trials import ALONE, TICK, HoldTrials, ready_to_hold
from browser.loopback_relay import LoopbackRelay, MessageTap
from browser.motion_tap import RAMP_IS_OVER, Ended
from browser.page_rig import Page, PageRig, free_port
from browser.test_holding import DEADLINE, RELEASED, page
from openpendant.simplemsg.pendant import JogRelease
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

__all__ = ["page"]

LINK_ENDED = 0.100
"""From a page that ends to the STOP [s]."""
STALLED_FOR = 0.7
WATCHED_FOR = 0.5
"""After old messages came [s]."""


@pytest.fixture
def other(page_rig: PageRig) -> Iterator[SyncPendantClient]:
    """Another client of the same cell."""
    with SyncPendantClient.connect(port=page_rig.server, client="another") as client:
        yield client


@pytest.fixture(scope="module")
def releases(page_rig: PageRig) -> Iterator[tuple[MessageTap, int]]:
    """Sees what lets go as it reaches the server; and the port of the gateway before it."""
    tap, port = MessageTap(page_rig.server, JogRelease), free_port()
    with ALONE:
        gateway = page_rig.start_gateway(port, tap.port)
    yield tap, port
    page_rig.end(gateway)
    tap.close()


def _jogs(page: Page, side: str) -> tuple[float, float]:
    """Hold the first joint's button until the robot moves steadily; return where that is."""
    page.stay_enabled()
    at = page.place(0, side)
    page.rig.tap.forget()
    page.mouse("mouseMoved", at)
    page.mouse("mousePressed", at)
    page.rig.tap.wait_for_steady(0)
    return at


def _ends(page: Page, began: float) -> Ended:
    """Return how it ended once it stands and has stayed at rest with the button held on."""
    page.rig.tap.wait_for_rest()
    found = page.rig.tap.end_of_steady(0, began)
    page.rig.tap.stays_at_rest()
    return found


def _let_go(page: Page, at: tuple[float, float]) -> None:
    page.mouse("mouseReleased", at)


def test_a_tab_that_is_reloaded_or_closed_stops_the_robot(page_rig: PageRig) -> None:
    page = page_rig.page()
    first = page.driver.current_window_handle
    page.driver.get("about:blank")

    def trial(side: str) -> Ended:
        with ALONE:
            page.driver.switch_to.new_window("tab")
        try:
            with ALONE:
                ready_to_hold(page)
                _jogs(page, side)
                began = time.monotonic()
                if side == "plus":
                    page.cdp("Page.reload")
                else:
                    page.driver.close()
                page.rig.tap.wait_for_rest(at_rest=RAMP_IS_OVER)
            return _ends(page, began)
        finally:
            for each in set(page.driver.window_handles) - {first}:
                page.driver.switch_to.window(each)
                page.driver.close()
            page.driver.switch_to.window(first)
            page.let_all_go()

    trials = HoldTrials("reloaded or closed", LINK_ENDED)
    trials.run(trial, lambda: None)
    trials.judge({"stop", "ramp"})


def test_a_network_that_stalls_ends_it_as_silent_and_its_old_messages_move_nothing(
    page_rig: PageRig,
) -> None:
    relay = LoopbackRelay(page_rig.gateway)
    page = page_rig.page(relay.port)
    ready_to_hold(page)

    def trial(side: str) -> Ended:
        with ALONE:
            at = _jogs(page, side)
            began = time.monotonic()
            relay.stand_still()
            time.sleep(DEADLINE)
            page.rig.tap.wait_for_rest(at_rest=RAMP_IS_OVER)
        time.sleep(max(0.0, began + STALLED_FOR - time.monotonic()))
        found = page.rig.tap.end_of_steady(0, began)
        page.rig.tap.forget()
        relay.go_on()
        page.rig.tap.stays_at_rest(WATCHED_FOR)
        page.stands()
        _let_go(page, at)
        page.key(False, "KeyV", "v")
        return found

    try:
        trials = HoldTrials("the network stalls", DEADLINE + TICK)
        trials.run(trial, partial(ready_to_hold, page))
        trials.judge()
    finally:
        page.let_all_go()
        relay.close()


def test_a_stop_of_another_client_ends_it(page: Page, other: SyncPendantClient) -> None:
    def trial(side: str) -> Ended:
        with ALONE:
            at = _jogs(page, side)
            began = time.monotonic()
            other.stop("a test")
            page.rig.tap.wait_for_rest(at_rest=RAMP_IS_OVER)
        found = _ends(page, began)
        _let_go(page, at)
        page.reset_stop()
        return found

    trials = HoldTrials("STOP of another client", TICK)
    trials.run(trial, partial(ready_to_hold, page))
    trials.judge({"stop"})


def _control_given_up(page: Page) -> Callable[[], None]:
    """In a manual mode nobody takes it away."""
    page.do("document.querySelector('.main-act').click()")

    def back() -> None:
        page.wait("document.querySelector('.chips').innerText.includes('Nobody')")
        page.tap_key("KeyC", "c")
        page.wait("document.querySelector('.chips').innerText.includes('You')")

    return back


def _other_mode(page: Page) -> Callable[[], None]:
    page.tap_key("KeyM", "m")

    def back() -> None:
        page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
        page.tap_key("KeyM", "m")
        page.wait("document.querySelector('.chips').innerText.includes('T1')")

    return back


def _other_frame(page: Page) -> Callable[[], None]:
    page.tap_key("KeyF", "f")

    def back() -> None:
        page.run("document.querySelector('.jog .tabs button').click()")
        page.wait("document.querySelector('.jog .tabs button').classList.contains('chosen')")

    return back


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(_control_given_up, id="control is given up"),
        pytest.param(_other_mode, id="another mode"),
        pytest.param(_other_frame, id="another frame"),
    ],
)
def test_what_the_page_takes_away_ends_it(
    page_rig: PageRig,
    releases: tuple[MessageTap, int],
    change: Callable[[Page], Callable[[], None]],
    request: pytest.FixtureRequest,
) -> None:
    tap, port = releases
    page = page_rig.page(port)
    ready_to_hold(page)
    name = request.node.callspec.id
    at_server: dict[float, Ended] = {}

    def trial(side: str) -> Ended:
        with ALONE:
            at = _jogs(page, side)
            tap.forget()
            began = time.monotonic()
            back = change(page)
            page.rig.tap.wait_for_rest(at_rest=RAMP_IS_OVER)
        found = _ends(page, began)
        at_server[found.at] = replace(found, began=tap.first())
        back()
        _let_go(page, at)
        return found

    try:
        trials = HoldTrials(name, RELEASED)
        trials.run(trial, partial(ready_to_hold, page))
        trials.judge({"stop", "ramp"})
        counted = [at_server[each.at] for each in trials.found]
        HoldTrials(f"{name}, from the server on", TICK, counted).judge({"stop", "ramp"})
    finally:
        page.let_all_go()
        page.driver.get("about:blank")


def test_a_gateway_that_is_killed_stops_the_robot(page_rig: PageRig) -> None:
    """What the system needs to end it is not the server's; that is told beside."""
    told: list[str] = []

    def trial(side: str) -> Ended:
        port = free_port()
        with ALONE:
            gateway = page_rig.start_gateway(port)
            page = page_rig.page(port)
            ready_to_hold(page)
            _jogs(page, side)
            # Its exit code comes later, by way of the process that forked it.
            end = os.pidfd_open(gateway.pid)
            began = time.monotonic()
            gateway.kill()
            select.select([end], [], [], 10)
            dead = time.monotonic()
            page.rig.tap.wait_for_rest(at_rest=RAMP_IS_OVER)
        os.close(end)
        gateway.end(10)
        found = _ends(page, began)
        page.let_all_go()
        told.append(f"{1000 * (found.at - began):.1f}")
        return replace(found, began=dead, at=max(dead, found.at))

    trials = HoldTrials("the gateway is killed, from its death on", TICK)
    trials.run(trial, lambda: None)
    tell(f"the gateway is killed, from the kill on: {', '.join(told)} ms")
    trials.judge({"stop"})
