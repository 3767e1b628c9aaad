"""A person at the page who has a robot carry a workpiece past a wall: what he presses and types."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence

from browser.page_rig import Page

Place = tuple[float, float, float]

HAND_DOWN = (180.0, 0.0, 0.0)
"""Roll, pitch and yaw of a tool that points down [°]."""

_VERDICT = "document.querySelector('.verdict').innerText"
_WHERE = "document.querySelector('.run-progress strong').innerText"
_OBJECTS = "document.querySelectorAll('.object').length"


class Demonstrator:
    """Uses the tasks Scene, Plan and Teach of a page that holds control."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def press(self, words: str, part: str) -> None:
        """Press the button with these words in a part of the page, once it is on."""
        found = (
            f"[...document.querySelectorAll({json.dumps(part + ' button')})]"
            ".find(b => b.offsetParent !== null"
            f" && [b.innerText.trim(), b.ariaLabel].includes({json.dumps(words)}))"
        )
        self.page.wait(f"{found} && {found}.ariaDisabled !== 'true'", within=15)
        self.page.run(f"{found}.click()")

    def task(self, name: str) -> None:
        """Choose a task of the rail."""
        self.page.run(f"document.querySelector('[data-task={name}]').click()")
        self.page.wait(f"document.querySelector('.panel .{name}') !== null")

    def type(self, part: str, values: Sequence[object]) -> None:
        """Type one value after the other into the boxes of a part of the page."""
        boxes = f"document.querySelectorAll({json.dumps(part + ' input')})"
        self.page.wait(f"{boxes}.length >= {len(values)}")
        self.page.run(
            f"const boxes = {boxes};"
            f"{json.dumps([str(each) for each in values])}.forEach((value, index) => {{"
            "boxes[index].value = value; boxes[index].dispatchEvent(new Event('change')); })"
        )

    def mode(self, word: str) -> None:
        """Set the mode of which the chip says a word."""
        if word not in self.page.text(".chips"):
            self.page.tap_key("KeyM", "m")
        self.page.wait(f"document.querySelector('.chips').innerText.includes('{word}')")

    # Scene.

    def put(self, name: str, place: Place, size: Place) -> None:
        """Put a box into the cell [m]."""
        self.task("scene")
        self.page.wait("document.querySelector('.scene header').innerText.includes('of this cell')")
        count = int(self.page.run(f"return {_OBJECTS}"))
        self.press("Add: Box", ".scene")
        self.page.wait(f"{_OBJECTS} === {count + 1}")
        self.page.wait("document.querySelector('.object.selected')?.innerText.includes('box')")
        turned = (0, 0, 0)
        numbers = [*_millimetres(place), *turned, *_millimetres(size)]
        self.type(".object-editor .three", numbers)
        self.type(".object-editor header", [name])
        self.press("Save the scene", ".scene")
        self.page.wait("document.querySelector('.object-editor .acts button').ariaDisabled")

    def leave(self, name: str) -> None:
        """Let a held object go where it is."""
        self.task("scene")
        found = (
            f"[...document.querySelectorAll('.object')].find(o => o.innerText.includes('{name}'))"
        )
        self.page.wait(f"{found}?.innerText.includes('held by')")
        self.page.run(f"{found}.click()")
        self.press("Detach here", ".scene")
        self.page.wait(f"{found}.innerText.includes('stands')")

    # Plan.

    def plan(self, way: str, place: Place, seed: int = 0) -> str:
        """Plan a way of the tool that points down to a place in base [m]; return the verdict."""
        page = self.page
        self.task("plan")
        page.wait("document.querySelector('.plan select')?.options.length > 1")
        page.run(
            f"document.querySelector('[data-way={way}]').click();"
            "const goal = document.querySelector('.plan select');"
            "goal.value = ''; goal.dispatchEvent(new Event('change'))"
        )
        self.type(".reach", [*_millimetres(place), *HAND_DOWN])
        page.wait("document.querySelector('.reach .told').innerText.includes('reaches it')")
        if way == "free":
            page.run(
                "const planner = document.querySelector('[aria-label=Planner]');"
                "planner.value = 'RRTConnect';"
                f"document.querySelector('[aria-label^=Seed]').value = '{seed}'"
            )
        page.run("document.querySelector('.plan .acts button').click()")
        # Until the next picture the verdict is that of the plan before.
        page.run("return new Promise(drawn => requestAnimationFrame(() => setTimeout(drawn)))")
        told = f"/can(not)? run/.test({_VERDICT}) && !{_VERDICT}.includes('Planning')"
        page.wait(told, within=30)
        return page.text(".verdict")

    def execute(self) -> None:
        """Execute the plan that is shown, and wait until its motion is over."""
        page = self.page
        press = "document.querySelector('.execute').click()"
        began = f"/is executed|was executed/.test({_VERDICT})"
        page.wait("document.querySelector('.execute').ariaDisabled !== 'true'")
        page.run(press)
        page.wait(f"{began} || document.querySelector('.execute.asks') !== null")
        if not page.run(f"return {began}"):
            # An earlier connection of the page counts as somebody who looks on.
            time.sleep(0.5)
            page.run(press)
        page.wait(f"{_VERDICT}.includes('was executed')", 40)

    def go(self, way: str, place: Place) -> None:
        """Plan and execute."""
        verdict = self.plan(way, place)
        assert "This plan can run" in verdict, verdict
        self.execute()

    # Teach.

    def new_program(self, name: str) -> None:
        """Begin a program."""
        self.task("teach")
        self.page.wait("document.querySelector('.new-program')")
        self.page.run("document.querySelector('.programs-button').click()")
        self.type(".new-program", [name])
        self.press("Create", ".teach")
        self.page.wait(f"document.querySelector('.program-name').innerText === '{name}'")

    def save_point(self) -> None:
        """Save where the robot stands as the next point of the program."""
        self.task("teach")
        self.press("Save point here", ".teach")

    def write(self, change: str) -> None:
        """Change the text of the program by an expression of `text`, and save it."""
        self.press("Text", ".teach")
        area = "document.querySelector('.text-view textarea')"
        self.page.wait(f"{area}.value.includes('point P2')")
        self.page.run(
            f"const area = {area}; const text = area.value; area.value = {change};"
            "area.dispatchEvent(new Event('input'))"
        )
        self.press("Save", ".text-view")
        self.page.wait("document.querySelector('.text-acts button').ariaDisabled === 'true'")
        self.press("Table", ".teach")

    def break_before(self, words: str) -> None:
        """Set a breakpoint at the line that has some words."""
        rows = "[...document.querySelectorAll('.program-row')]"
        row = f"{rows}.find(r => r.innerText.includes('{words}'))"
        self.page.wait(f"{row}")
        self.page.run(f"{row}.querySelector('.break').click()")
        self.page.wait(f"{row}.querySelector('.break').ariaPressed === 'true'")

    def run_to_breakpoint(self) -> None:
        """Run the program until it stands before its breakpoint."""
        self.press("Run", ".teach")
        self.page.wait(f"{_WHERE}.startsWith('Before line')", 40)

    def resume(self) -> None:
        """Let the program go on to its end."""
        self.press("Resume", ".teach")
        self.page.wait(f"{_WHERE} === 'Ready'", 40)


def _millimetres(metres: Sequence[float]) -> list[str]:
    return [f"{1000 * each:.3f}" for each in metres]
