"""Each management request that is recorded gets the same answer today, to the byte."""

import json
from collections import Counter
from pathlib import Path

from frozen.asked_cell import AskedCell
from frozen.bodies_to_ask import steps
from frozen.body_file import Answer, Question, Step, line_of, read_steps
from frozen.frozen_files import BODIES, SCHEMAS


def differing(file: Path) -> dict[str, str]:
    """Make the requests of a file; return those whose answers differ, and how."""
    cells: dict[str, AskedCell] = {}
    found = {}
    for name, step, then in read_steps(file):
        if name not in cells:
            cells[name] = AskedCell()
        now = cells[name].make(step)
        if isinstance(step, Question) and now != then:
            found[step.name] = f"then {_shown(then)}\n  now  {_shown(now)}"
    return found


def _shown(answer: Answer | None) -> str:
    assert answer is not None
    return f"{'done' if answer.done else 'refused'}: {answer.text}"


def questions() -> list[tuple[Question, Answer]]:
    return [
        (step, answer)
        for _, step, answer in read_steps(BODIES)
        if isinstance(step, Question) and answer is not None
    ]


def test_every_request_is_answered_as_it_was() -> None:
    found = differing(BODIES)
    assert not found, "\n".join(f"{name}:\n  {how}" for name, how in found.items())


def test_an_answer_that_differs_is_told_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "bodies.jsonl"
    steps: list[tuple[str, Step, Answer | None]] = [
        ("cell", Question("cells", "viewer", '{"op":"cells"}'), Answer(True, "{}")),
        ("cell", Question("no text", "viewer", {"hex": "ff"}), Answer(False, "{}")),
        ("cell", Question("sessions", "viewer", '{"op":"access.whoami"}'), Answer(True, "{}")),
    ]
    file.write_text("".join(line_of(*step) + "\n" for step in steps), "utf-8")
    found = differing(file)
    assert set(found) == {"cells", "no text", "sessions"}
    now = '{"cells":[{"cell":"cell","robot":"ur5"}]}'
    assert found["cells"] == f"then done: {{}}\n  now  done: {now}"


def test_every_operation_was_asked_for_and_refused() -> None:
    published = {file.name.removesuffix("-request.json") for file in SCHEMAS.glob("*-request.json")}
    done: set[str] = set()
    refused: set[str] = set()
    for question, answer in questions():
        if isinstance(question.body, str) and question.name.partition(":")[0] in published:
            (done if answer.done else refused).add(json.loads(question.body)["op"])
    # The last digits of what a calibration finds differ between machines.
    assert done == published - {"tools.calibrate"}
    assert refused == published


def test_requests_have_names_of_their_own() -> None:
    names = Counter(question.name for question, _ in questions())
    assert [name for name, count in names.items() if count > 1] == []
    assert len(names) > 400


def test_what_can_be_wrong_with_a_new_request_is_made_up_in_front_of_it(tmp_path: Path) -> None:
    file = tmp_path / "bodies.jsonl"
    new = {"cell": "cell", "id": "cells: right", "by": "viewer", "body": '{"op":"cells"}'}
    file.write_text(json.dumps(new) + "\n", "utf-8")
    assert [step for _, step in steps(file)] == [
        Question("cells: by who is visitor", "visitor", '{"op":"cells"}'),
        Question("cells: a key too many", "viewer", '{"op":"cells","colour":"red"}'),
        Question("cells: right", "viewer", '{"op":"cells"}'),
    ]
