"""Teach and playback from the page: three points, run, step, pause, edits, others' changes."""

import asyncio
import json
from collections.abc import Iterator
from itertools import count
from typing import Any

import pytest

from browser.page_rig import ROBOT, Page
from browser.wcag import broken_rules
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.sync_client import SyncPendantClient

ROWS = "[...document.querySelectorAll('.program-row')].filter(row => !row.hidden)"
WHERE = "document.querySelector('.run-progress strong').innerText"
NUMBERS = count(1)


class Teacher:
    """What a person does in Teach."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.number = next(NUMBERS)
        self.name = f"taught {self.number}"

    def press(self, words: str, where: str = ".teach") -> None:
        """Press the button with these words, once it is on."""
        found = (
            f"[...document.querySelectorAll({json.dumps(where + ' button')})]"
            ".find(b => b.offsetParent !== null"
            f" && [b.innerText.trim(), b.ariaLabel].includes({json.dumps(words)}))"
        )
        self.page.wait(f"{found} && {found}.ariaDisabled !== 'true'")
        self.page.run(f"{found}.click()")

    def open_new(self) -> None:
        self.page.run("document.querySelector('[data-task=teach]').click()")
        self.page.wait("document.querySelector('.new-program')")
        self.page.run("document.querySelector('.programs-button').click()")
        self.page.wait("document.querySelector('.new-program').offsetParent !== null")
        name = json.dumps(self.name)
        self.page.run(f"document.querySelector('.new-program input').value = {name}")
        self.press("Create")
        self.page.wait("document.querySelector('.program-grid')?.offsetParent !== null")
        self.page.wait(f"document.querySelector('.program-name').innerText === {name}")

    def open_kept(self) -> None:
        """Open a program of three points that another client has saved."""
        _keep_three_points(self.page.rig.server, self.name, -1 if self.number % 2 else 1)
        self.page.run("document.querySelector('[data-task=teach]').click()")
        entries = "[...document.querySelectorAll('.programs .entry')]"
        entry = f"{entries}.find(each => each.innerText.split('\\n')[0] === '{self.name}')"
        self.page.wait("document.querySelector('.programs-button')")
        self.page.run("document.querySelector('.programs-button').click()")
        self.page.wait(entry)
        self.page.run(f"{entry}.click()")
        self.page.wait(f"{ROWS}.length === 3")

    def save_point(self) -> None:
        rows = self.row_count()
        self.press("Save point here")
        self.page.wait(f"{ROWS}.length === {rows + 1}")

    def jog(self, digit: str) -> None:
        """Jog an axis for a while; every other teacher the other way, far from the limits.

        A machine that lets the page sleep ends the enabling: that is not what is tried here, so
        whoever teaches presses again.
        """
        page = self.page
        shift = 8 if self.number % 2 else 0
        for tries_left in (2, 1, 0):
            page.key(False, "KeyV", "v")
            page.key(True, "KeyV", "v")
            page.wait("document.querySelector('.enabling.on')")
            page.key(True, f"Digit{digit}", digit, shift)
            try:
                page.wait("document.querySelector('.chips').innerText.includes('Jogging')", 3)
                break
            except AssertionError as error:
                page.key(False, f"Digit{digit}", digit, shift)
                if not tries_left or "silent" not in str(error):
                    raise
        page.run("return new Promise(done => setTimeout(done, 700))")
        page.key(False, f"Digit{digit}", digit, shift)
        page.stands()

    def row_count(self) -> int:
        return int(self.page.run(f"return {ROWS}.length"))

    def points(self) -> list[str]:
        found: list[str] = self.page.run(
            f"return {ROWS}.map(row => row.querySelector('.point').innerText)"
        )
        return found

    def choose(self, index: int) -> None:
        self.page.run(f"{ROWS}[{index}].click()")
        self.page.wait(f"{ROWS}[{index}].ariaSelected === 'true'")

    def marks(self) -> list[str]:
        found: list[str] = self.page.run(f"return {ROWS}.map(row => row.dataset.mark)")
        return found

    def automatic(self) -> None:
        self.page.let_all_go()
        self.page.tap_key("KeyM", "m")
        self.page.wait("document.querySelector('.chips').innerText.includes('Automatic')")

    def speed(self, percent: int) -> None:
        """Press the chip of the speed until it says so."""
        chip = "[...document.querySelectorAll('.chip')].find(c => c.innerText.includes('Speed'))"
        for _ in range(4):
            before = self.page.run(f"return {chip}.innerText")
            if f"{percent} %" in before and f"1{percent} %" not in before:
                return
            self.page.run(f"{chip}.click()")
            self.page.wait(f"{chip}.innerText !== {json.dumps(before)}")

    def at_rest(self) -> None:
        self.page.wait(f"{WHERE} === 'Ready'", 30)

    def text(self, part: str) -> str:
        return self.page.text(part)


@pytest.fixture
def beginner(page: Page) -> Iterator[Teacher]:
    """Somebody in T1 who has nothing taught yet."""
    yield Teacher(page)
    page.run("document.querySelector('[data-task=jog]').click()")


@pytest.fixture
def teacher(beginner: Teacher) -> Teacher:
    """Somebody in T1 at a program of three points, at the last of which the robot stands."""
    beginner.open_kept()
    return beginner


def _keep_three_points(server: int, name: str, side: int) -> None:
    """Save a program as another client: from two points aside to where the robot stands."""
    with SyncPendantClient.connect(port=server, client="teacher") as other:
        next(other.states())
        here = other.joints()
        asides = ((side * 1.0, 0.0), (side * 0.5, 0.2), (0.0, 0.0))
        points = [
            (here[0] + base, *here[1:4], here[4] + wrist, *here[5:]) for base, wrist in asides
        ]
        told = [f"joints {' '.join(map(str, each))} rad" for each in points]
        lines = [
            "openpendant-program/1",
            f'program "{name}" robot {ROBOT}',
            *(f"point P{number} {each}" for number, each in enumerate(told, 1)),
            *(f"move PTP P{number}" for number in range(1, 4)),
            "",
        ]
        other.programs.save(name, "\n".join(lines), 0)


def _others(page: Page, act: Any) -> None:
    """Have another pendant do something."""

    async def acted() -> None:
        address = ("127.0.0.1", page.rig.server)
        async with await PendantClient.connect(*address, client="another") as other:
            await act(other)

    asyncio.run(acted())


def test_three_points_are_three_rows_in_the_order_of_their_saving(beginner: Teacher) -> None:
    beginner.page.hold_enabling()
    beginner.open_new()
    beginner.save_point()
    for digit in ("1", "3"):
        beginner.jog(digit)
        beginner.save_point()
    assert beginner.points() == ["P1", "P2", "P3"]


def test_a_run_marks_the_line_that_it_is_in_and_comes_to_its_end(teacher: Teacher) -> None:
    teacher.automatic()
    teacher.press("Run")
    teacher.page.wait("document.querySelector('.program-row.current')")
    teacher.at_rest()
    assert teacher.page.run("return document.querySelector('.program-row.current')") is None


def test_a_run_in_t1_says_that_enabling_has_to_be_held_and_runs_once_it_is(
    teacher: Teacher,
) -> None:
    page = teacher.page
    page.run("document.querySelector('.run-key.go').click()")
    page.wait("document.querySelector('.banner.note').innerText.includes('To run in T1, hold V')")
    page.key(True, "KeyV", "v")
    teacher.press("Run")
    page.wait("document.querySelector('.program-row.current')")
    page.let_all_go()
    teacher.at_rest()


def test_a_step_stops_before_the_next_line_and_a_step_back_before_its_own(teacher: Teacher) -> None:
    teacher.automatic()
    first = int(teacher.page.run(f"return {ROWS}[0].querySelector('.line-number').innerText"))
    for way, line in (("Step", first + 1), ("Step", first + 2), ("Back", first + 1)):
        teacher.press(way)
        teacher.page.wait(f"{WHERE} === 'Before line {line}'")
    teacher.press("End")
    teacher.at_rest()


def test_a_paused_run_stands_until_it_is_resumed(teacher: Teacher) -> None:
    teacher.automatic()
    teacher.speed(25)
    place = "return document.querySelector('.tool-place').textContent"
    begun = teacher.page.run(place)
    teacher.press("Run")
    moved = f"document.querySelector('.tool-place').textContent !== {json.dumps(begun)}"
    teacher.page.wait(moved)
    teacher.press("Pause")
    teacher.page.wait(f"{WHERE}.startsWith('Before')")
    at = teacher.page.run(place)
    teacher.page.run("return new Promise(done => setTimeout(done, 500))")
    assert teacher.page.run(place) == at
    teacher.press("Resume")
    teacher.speed(100)
    teacher.at_rest()
    assert teacher.page.run(place) != at


def test_an_edit_is_taken_back_and_done_again(teacher: Teacher) -> None:
    teacher.choose(1)
    teacher.press("Delete line")
    teacher.page.wait(f"{ROWS}.length === 2")
    teacher.press("Undo")
    teacher.page.wait(f"{ROWS}.length === 3")
    assert teacher.points() == ["P1", "P2", "P3"]
    teacher.press("Redo")
    teacher.page.wait(f"{ROWS}.length === 2")


def test_a_point_is_inserted_before_the_chosen_line(teacher: Teacher) -> None:
    teacher.choose(1)
    teacher.press("Insert before")
    teacher.page.wait(f"{ROWS}.length === 4")
    assert teacher.points() == ["P1", "P4", "P2", "P3"]


def test_a_point_that_is_touched_up_lies_where_the_robot_stands(teacher: Teacher) -> None:
    page = teacher.page
    numbers = "document.querySelector('.point-numbers').innerText"
    teacher.choose(2)
    stands_at = page.run(f"return {numbers}")
    teacher.choose(0)
    page.wait(f"{numbers} !== {json.dumps(stands_at)}")
    teacher.press("Touch up here", ".line-card")
    # With the place of the tool in front, which was not kept with the other point.
    page.wait(f"{numbers}.endsWith({json.dumps(stands_at)})")
    assert page.run(f"return {numbers}").startswith("X\n")


def test_a_point_gets_another_name_in_all_its_lines(teacher: Teacher) -> None:
    page = teacher.page
    teacher.choose(1)
    teacher.press("Rename", ".line-card")
    page.run("document.querySelector('.line-card .rename input').value = 'above'")
    teacher.press("Apply", ".line-card")
    page.wait(f"{ROWS}[1].querySelector('.point').innerText === 'above'")
    assert teacher.points() == ["P1", "above", "P3"]


def test_a_line_moves_down_by_its_key(teacher: Teacher) -> None:
    teacher.choose(0)
    teacher.page.run("document.querySelector('.program-grid').focus()")
    teacher.page.key(True, "ArrowDown", "ArrowDown", 1)
    teacher.page.key(False, "ArrowDown", "ArrowDown", 1)
    teacher.page.wait(f"{ROWS}[0].querySelector('.point').innerText === 'P2'")
    assert teacher.points() == ["P2", "P1", "P3"]


def test_a_dry_run_colours_the_lines_until_they_are_edited(teacher: Teacher) -> None:
    assert teacher.marks() == ["unchecked"] * 3
    teacher.press("Dry run")
    teacher.page.wait(f"{ROWS}.every(row => row.dataset.mark === 'good')")
    teacher.choose(2)
    teacher.press("Delete line")
    teacher.page.wait(f"{ROWS}.length === 2")
    assert teacher.marks() == ["unchecked"] * 2


def test_a_breakpoint_pauses_before_its_line(teacher: Teacher) -> None:
    teacher.page.run(f"{ROWS}[1].querySelector('.break').click()")
    teacher.page.wait(f"{ROWS}[1].querySelector('.break').ariaPressed === 'true'")
    line = teacher.page.run(f"return {ROWS}[1].querySelector('.line-number').innerText")
    teacher.automatic()
    teacher.press("Run")
    teacher.page.wait(f"{WHERE} === 'Before line {line}'")
    teacher.press("End")
    teacher.at_rest()


def test_going_to_a_point_ends_where_the_button_is_let_go(teacher: Teacher) -> None:
    page = teacher.page
    teacher.choose(0)
    page.key(True, "KeyV", "v")
    go = "document.querySelector('.line-acts .go')"
    page.wait(f"{go}.ariaDisabled !== 'true'")
    page.run(f"{go}.scrollIntoView()")
    at = page.run(f"const b = {go}.getBoundingClientRect(); return [b.x + 20, b.y + 20]")
    page.mouse("mousePressed", (at[0], at[1]))
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    page.mouse("mouseReleased", (at[0], at[1]))
    page.wait("document.querySelector('.chips').innerText.includes('Ready')")


def test_what_another_pendant_changes_is_shown(teacher: Teacher) -> None:
    async def add(other: PendantClient) -> None:
        kept = (await other.programs.list())["programs"]
        revision = next(each["revision"] for each in kept if each["name"] == teacher.name)
        edit: Any = {"edit": "insert", "statements": [{"statement": "wait", "duration": 1.0}]}
        await other.programs.edit(teacher.name, revision, edit)

    _others(teacher.page, add)
    teacher.page.wait(f"{ROWS}.length === 4")


def test_a_text_with_a_fault_is_not_saved_and_its_line_is_marked(teacher: Teacher) -> None:
    page = teacher.page
    teacher.press("Text")
    area = "document.querySelector('.text-view textarea')"
    page.wait(f"{area}.value.includes('P3')")
    page.run(f"{area}.value += 'move LIN P1 spede 3 %'; {area}.dispatchEvent(new Event('input'))")
    lines = page.run(f"return {area}.value.split('\\n').length")
    teacher.press("Save", ".text-view")
    page.wait("document.querySelector('.text-told').innerText.includes('spede')")
    assert page.text(".margin .wrong") == str(lines)


def test_a_recording_is_made_listed_played_and_deleted(teacher: Teacher) -> None:
    page = teacher.page
    teacher.press("Recordings")
    name = json.dumps(f"arc of {teacher.name}")
    page.run(f"document.querySelector('.recordings input').value = {name}")
    teacher.press("Record")
    page.key(True, "KeyV", "v")
    page.wait("document.querySelector('.under-way').offsetParent !== null")
    teacher.jog("2")
    teacher.press("Stop recording")
    entries = "[...document.querySelectorAll('.recordings li')]"
    entry = f"{entries}.find(e => e.innerText.includes({name}))"
    page.wait(entry)
    teacher.automatic()
    page.wait(f"[...{entry}.querySelectorAll('button')][0].ariaDisabled !== 'true'")
    page.run(f"{entry}.querySelector('button').click()")
    page.wait("document.querySelector('.chips').innerText.includes('Moving')")
    page.wait("document.querySelector('.chips').innerText.includes('Ready')", 60)
    page.run(f"{entry}.querySelector('.danger').click()")
    page.run(f"{entry}.querySelector('.asked .danger').click()")
    page.wait(f"!{entry}")


@pytest.mark.parametrize("view", ["Table", "Text", "Points", "Recordings"])
def test_teaching_breaks_no_rule_of_wcag_2_2_aa(teacher: Teacher, view: str) -> None:
    page = teacher.page
    teacher.press("Dry run")
    page.wait(f"{ROWS}.every(row => row.dataset.mark === 'good')")
    teacher.press(view)
    assert broken_rules(page) == {}


@pytest.mark.parametrize("size", [(1366, 820), (1024, 600)], ids=["full", "small"])
def test_a_program_table_has_room_and_a_picture_of_it_is_kept(
    teacher: Teacher, size: tuple[int, int]
) -> None:
    page = teacher.page
    width, height = size
    shape = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    page.cdp("Emulation.setDeviceMetricsOverride", **shape)
    try:
        teacher.press("Dry run")
        page.wait(f"{ROWS}.every(row => row.dataset.mark === 'good')")
        page.picture(f"teach-{width}x{height}")
        room = page.run("return document.querySelector('.program-grid').clientHeight")
        assert room >= (320 if height >= 820 else 190)
    finally:
        page.cdp("Emulation.clearDeviceMetricsOverride")
