"""The tour of the page: it moves the robot only when asked, says what it does, and ends at once."""

import json

import pytest

from browser.page_rig import Page

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(240)]

STEPS = "[...document.querySelectorAll('.tour-steps li')]"
BEGIN, END = "document.querySelector('.tour .begin')", "document.querySelector('.tour .end')"


@pytest.fixture
def tour(page: Page) -> Page:
    """A page in control in Automatic that shows the tour, which it was asked for in the menu."""
    page.tap_key("KeyM", "m")
    page.wait("document.querySelector('.chips').innerText.includes('Automatic')")
    page.run("document.querySelector('.brand').click()")
    page.wait("document.querySelector('.card .take-tour')?.offsetParent")
    page.run("document.querySelector('.card .take-tour').click()")
    page.wait(f"{BEGIN}?.offsetParent")
    page.rig.tap.wait_for_rest()
    page.rig.tap.forget()
    return page


def _begins(page: Page) -> None:
    page.wait(f"{BEGIN}.ariaDisabled !== 'true'")
    page.run(f"{BEGIN}.click()")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")


def _stays_at_rest(page: Page) -> None:
    page.rig.tap.wait_for_rest()
    page.rig.tap.stays_at_rest(1.5)


def _told(page: Page, words: str, within: float = 10) -> None:
    page.wait(
        f"document.querySelector('.tour .told').innerText.includes({json.dumps(words)})", within
    )


def test_it_shows_every_joint_a_line_and_a_circle_and_says_so(tour: Page) -> None:
    _begins(tour)
    assert tour.text(".tour [aria-current]").startswith("Joint Base alone")
    _told(tour, "That was the tour", within=120)
    told = [" ".join(each.split()) for each in tour.run(f"return {STEPS}.map(s => s.innerText)")]
    assert [each.rsplit(" ", 2)[0] for each in told] == [
        *(f"Joint {name} alone" for name in JOINTS),
        "Back to where it began",
        "A straight line of the tool",
        "The same line back",
        "A path of 8 places of the tool, without a stop",
    ]


JOINTS = ["Base", "Lower-Arm", "Upper-Arm", "Wrist-Roll", "Wrist-Pitch", "Wrist-Twist"]


def test_nothing_moves_before_it_is_begun(tour: Page) -> None:
    _stays_at_rest(tour)


@pytest.mark.parametrize(
    "end",
    [
        pytest.param(f"{END}.click()", id="its button"),
        pytest.param("document.querySelector('[data-task=jog]').click()", id="another task"),
    ],
)
def test_it_ends_at_once_and_does_not_go_on(tour: Page, end: str) -> None:
    _begins(tour)
    tour.run(end)
    _stays_at_rest(tour)
    tour.wait("document.querySelector('.frame').dataset.state === 'control'")


def test_stop_ends_it_and_after_the_reset_it_does_not_go_on(tour: Page) -> None:
    _begins(tour)
    tour.tap_key("Space", " ")
    _told(tour, "The tour ended")
    tour.reset_stop()
    _stays_at_rest(tour)


def test_without_control_it_only_says_what_it_needs(tour: Page) -> None:
    tour.run("document.querySelector('.main-act').click()")
    tour.wait("document.querySelector('.chips').innerText.includes('Nobody')")
    assert "First take control" in tour.text(".tour .needs")
    tour.run(f"{BEGIN}.click()")
    tour.wait("document.querySelector('.checklist').offsetParent")
    _stays_at_rest(tour)
    assert "Nobody" in tour.text(".chips")


def test_in_t1_it_ends_where_the_enabling_device_is_let_go(tour: Page) -> None:
    tour.tap_key("KeyM", "m")
    tour.wait("document.querySelector('.chips').innerText.includes('T1')")
    assert "keep the enabling device held" in tour.text(".tour .needs")
    assert tour.run(f"return {BEGIN}.ariaDisabled") == "true"
    tour.key(True, "KeyV", "v")
    _begins(tour)
    tour.key(False, "KeyV", "v")
    _told(tour, "The tour ended")
    _stays_at_rest(tour)
