import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.motion.description.robot import serial_robot
from openpendant.server.events.pending import Pending
from openpendant.server.kinematics.question_rates import BURST, PER_SECOND
from openpendant.server.positions.position_book import PositionBook
from openpendant.server.positions.position_document import positions_to_json
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.store_errors import DiskFull
from openpendant.simplemsg.pendant.management.positions import MOST_POSITIONS
from openpendant.simplemsg.verdicts import VerdictCode as V

KIND = DocumentKind.POSITIONS
HOME = robot().home_position
PARK = [0.3, -1.2, 1.4, -1.5, -1.6, 0.2]
SINGULAR = [0.3, -1.2, 1.4, -1.5, 0.0, 0.2]
"""The wrist's outer axes are parallel."""


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    made.report()
    yield made
    made.store.close()


def named(cell: SurroundedCell) -> dict[str, dict[str, Any]]:
    return {each["name"]: each for each in cell.ask("positions.list")["positions"]}


def save(cell: SurroundedCell, name: str, joints: list[float] | None = None) -> Any:
    revision = cell.positions.revision
    fields = {} if joints is None else {"joints": joints}
    return cell.ask("positions.save", name=name, expected_revision=revision, **fields)


def test_the_robots_own_positions_are_there_from_the_start(cell: SurroundedCell) -> None:
    listed = cell.ask("positions.list")
    assert (listed["revision"], listed["problem"]) == (0, "")
    assert [each["name"] for each in listed["positions"]] == ["home", "zero"]
    home = listed["positions"][0]
    assert (home["kind"], home["joints"]) == ("robot", list(HOME))
    assert (home["legal"], home["why"]) == (True, "")
    assert home["condition"] == pytest.approx(5.4758, abs=1e-3)
    place, _ = cell.mathematics.tool_pose(HOME)
    assert home["pose"]["position"] == pytest.approx(list(place), abs=1e-9)


def test_promise_40_to_list_them_counts_as_a_question(cell: SurroundedCell) -> None:
    for _ in range(BURST):
        cell.ask("positions.list")
    code, text = cell.refused("positions.list")
    assert code is V.TOO_OFTEN
    assert f"{PER_SECOND} questions a second" in text


def test_a_position_is_kept_by_name_and_found_after_a_restart(
    cell: SurroundedCell, tmp_path: Path
) -> None:
    assert save(cell, "park", PARK) == {"revision": 1, "warning": None}
    cell.store.close()
    again = SurroundedCell(tmp_path)
    assert again.positions.position_named("park") == tuple(PARK)
    assert named(again)["park"]["kind"] == "user"
    assert named(again)["park"]["joints"] == PARK
    again.store.close()


def test_a_position_without_joints_is_where_the_robot_stands(cell: SurroundedCell) -> None:
    cell.reports(3)
    save(cell, "here")
    assert cell.positions.position_named("here") == pytest.approx(HOME, abs=1e-7)


def test_nobody_can_say_where_a_robot_stands_that_is_not_heard_of(cell: SurroundedCell) -> None:
    cell.now += 10_000_000_000
    assert cell.refused("positions.save", name="here", expected_revision=0)[0] is V.FEEDBACK_STALE


def test_a_position_of_the_same_name_is_moved(cell: SurroundedCell) -> None:
    save(cell, "park", PARK)
    moved = [*PARK[:5], 0.7]
    assert save(cell, "park", moved)["revision"] == 2
    assert cell.positions.position_named("park") == tuple(moved)


def test_a_renamed_position_is_found_by_its_new_name_alone(cell: SurroundedCell) -> None:
    save(cell, "park", PARK)
    renamed = {"name": "park", "new_name": "rest", "expected_revision": 1}
    assert cell.ask("positions.rename", **renamed) == {"revision": 2}
    assert cell.positions.position_named("rest") == tuple(PARK)
    found = cell.positions.position_named("park")
    assert isinstance(found, Refusal)
    assert found.code is V.UNKNOWN_POSITION


def test_a_deleted_position_is_gone(cell: SurroundedCell) -> None:
    save(cell, "park", PARK)
    assert cell.ask("positions.delete", name="park", expected_revision=1) == {"revision": 2}
    assert sorted(named(cell)) == ["home", "zero"]


@pytest.mark.parametrize(
    ("op", "fields"),
    [
        ("positions.save", {"name": "rest", "joints": PARK}),
        ("positions.rename", {"name": "park", "new_name": "rest"}),
        ("positions.delete", {"name": "park"}),
    ],
)
def test_the_later_of_two_changes_is_refused_with_both_revisions(
    cell: SurroundedCell, op: str, fields: dict[str, Any]
) -> None:
    save(cell, "park", PARK)
    code, text = cell.refused(op, expected_revision=0, **fields)
    assert code is V.REVISION_CONFLICT
    assert "from revision 0" in text
    assert "kept is 1" in text
    assert sorted(named(cell)) == ["home", "park", "zero"]


@pytest.mark.parametrize(
    "name", ["", "home", "zero", "vrm", "../x", "a\\b", "..", " park", "a\nb", "p" * 33, "ä" * 17]
)
def test_a_name_that_is_none_is_refused(cell: SurroundedCell, name: str) -> None:
    save(cell, "park", PARK)
    saved = {"name": name, "joints": PARK, "expected_revision": 1}
    assert cell.refused("positions.save", **saved)[0] is V.BAD_ARGUMENT
    renamed = {"name": "park", "new_name": name, "expected_revision": 1}
    assert cell.refused("positions.rename", **renamed)[0] is V.BAD_ARGUMENT
    assert cell.positions.revision == 1


def test_the_refusal_of_an_unprintable_name_says_the_bound_of_positions(
    cell: SurroundedCell,
) -> None:
    _, text = cell.refused("positions.save", name="a\nb", joints=PARK, expected_revision=0)
    assert text.endswith("U+000A as character 2; accepted: 1 to 32 bytes of printable characters")


def test_a_name_of_32_bytes_is_one(cell: SurroundedCell) -> None:
    assert save(cell, "ä" * 16, PARK)["revision"] == 1


def test_a_name_of_the_robots_file_is_not_given_again() -> None:
    puma = serial_robot("puma560")
    book = PositionBook("cell", puma.named_positions, puma.limits, Pending())
    fault = book.saved_as("qn", puma.home_position)
    assert isinstance(fault, Refusal)
    assert (fault.code, "of the robot's file" in fault.text) == (V.BAD_ARGUMENT, True)


@pytest.mark.parametrize("op", ["positions.delete", "positions.rename"])
def test_a_position_of_the_robots_file_is_not_changed(cell: SurroundedCell, op: str) -> None:
    fields = {"new_name": "rest"} if op == "positions.rename" else {}
    code, text = cell.refused(op, name="home", expected_revision=0, **fields)
    assert (code, "of the robot's file" in text) == (V.BAD_ARGUMENT, True)


@pytest.mark.parametrize("op", ["positions.delete", "positions.rename"])
def test_an_unknown_position_is_refused_with_the_nearest(cell: SurroundedCell, op: str) -> None:
    save(cell, "park", PARK)
    fields = {"new_name": "rest"} if op == "positions.rename" else {}
    code, text = cell.refused(op, name="prak", expected_revision=1, **fields)
    assert (code, "the nearest is 'park'" in text) == (V.UNKNOWN_POSITION, True)


def test_a_position_is_not_renamed_over_another(cell: SurroundedCell) -> None:
    save(cell, "park", PARK)
    save(cell, "rest", [*PARK[:5], 0.7])
    renamed = {"name": "park", "new_name": "rest", "expected_revision": 2}
    code, text = cell.refused("positions.rename", **renamed)
    assert (code, "is there already" in text) == (V.NAME_TAKEN, True)
    assert cell.positions.position_named("park") == tuple(PARK)


@pytest.mark.parametrize(
    ("joints", "code"),
    [
        (PARK[:5], V.WRONG_JOINT_COUNT),
        ([*PARK, 0.0], V.WRONG_JOINT_COUNT),
        ([*PARK[:5], 6.4], V.OUT_OF_RANGE),
        ([*PARK[:5], 1e300], V.OUT_OF_RANGE),
        ([0.0] * 11, V.BAD_ARGUMENT),
    ],
)
def test_joints_that_are_none_of_the_robot_are_refused(
    cell: SurroundedCell, joints: list[float], code: V
) -> None:
    saved = {"name": "park", "joints": joints, "expected_revision": 0}
    assert cell.refused("positions.save", **saved)[0] is code


def full_book(cell: SurroundedCell) -> None:
    """Have the store keep as many positions as there may be, each with the longest numbers."""
    kept = {
        f"{number:03d}{'é' * 14}x": tuple(-0.10000000000000001 - number / 777 for _ in PARK)
        for number in range(MOST_POSITIONS)
    }
    body = positions_to_json(kept)
    cell.store.save(KIND, "cell", body, expected_revision=0, author="ann")
    cell.perform(cell.positions.load())


def test_more_than_a_hundred_positions_are_refused_and_one_of_them_can_be_moved(
    cell: SurroundedCell,
) -> None:
    full_book(cell)
    code, text = cell.refused("positions.save", name="more", joints=PARK, expected_revision=1)
    assert (code, "up to 100" in text) == (V.TOO_LARGE, True)
    first = next(iter(cell.positions.of_cell))
    assert save(cell, first, PARK)["revision"] == 2


def test_a_hundred_positions_fit_one_answer_and_no_turn_of_them_is_long(
    cell: SurroundedCell,
) -> None:
    full_book(cell)
    listed = cell.ask("positions.list")
    assert len(listed["positions"]) == MOST_POSITIONS + 2
    assert len(cell.turns) > 5
    of_ten_joints = len(json.dumps(listed)) + 102 * 4 * 22
    assert of_ten_joints < 64 << 10


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (SINGULAR, "the arm is singular there"),
        ([*PARK[:4], 0.01, 0.2], "near a singularity: condition"),
        ([*PARK[:5], 2 * math.pi - 0.01], "wrist_3_joint is 0.573° from its limit"),
        ([0.0, -1.57, 2.9, -1.5, -1.6, 0.0], "touch there"),
    ],
)
def test_what_one_should_know_is_said_when_a_position_is_saved(
    cell: SurroundedCell, joints: list[float], words: str
) -> None:
    assert words in save(cell, "park", joints)["warning"]


def test_an_object_of_the_scene_makes_a_position_illegal_until_it_goes(
    cell: SurroundedCell,
) -> None:
    save(cell, "park", PARK)
    assert named(cell)["park"]["legal"]
    place, _ = cell.mathematics.tool_pose(PARK)
    ball = {
        "name": "ball",
        "shape": {"type": "sphere", "radius": 0.05},
        "position": list(place),
    }
    cell.ask("scene.add", object=ball, expected_revision=0)
    park = named(cell)["park"]
    assert (park["legal"], "ball touch there" in park["why"]) == (False, True)
    cell.ask("scene.remove", name="ball", expected_revision=1)
    assert named(cell)["park"]["legal"]


def test_two_who_ask_alike_meanwhile_are_both_answered(cell: SurroundedCell) -> None:
    full_book(cell)
    for _ in range(2):
        cell.send("positions.list")
    cell.until(lambda: len(cell.answers) == 2)
    assert cell.answers[0] == cell.answers[1]


def test_a_change_that_was_not_saved_is_not_in_force(cell: SurroundedCell) -> None:
    cell.refuse_with = DiskFull("no room")
    saved = {"name": "park", "joints": PARK, "expected_revision": 0}
    assert cell.refused("positions.save", **saved)[0] is V.DISK_FULL
    cell.refuse_with = None
    assert sorted(named(cell)) == ["home", "zero"]
    assert save(cell, "park", PARK)["revision"] == 1


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('{"schema": "openpendant-positions/2", "positions": []}', "schema"),
        (positions_to_json({"park": (0.0,) * 4}), "has 4 joints; the robot has 6"),
        (positions_to_json({"home": (0.0,) * 6}), "positions.0.name"),
        (positions_to_json({"park": (2e3,) * 6}), "positions.0.joints.0"),
    ],
)
def test_a_document_that_is_none_is_told_and_a_change_takes_its_place(
    cell: SurroundedCell, body: str, words: str
) -> None:
    cell.store.save(KIND, "cell", body, expected_revision=0, author="ann")
    cell.perform(cell.positions.load())
    listed = cell.ask("positions.list")
    assert words in listed["problem"]
    assert (listed["revision"], len(listed["positions"])) == (1, 2)
    assert save(cell, "park", PARK)["revision"] == 2
    assert cell.ask("positions.list")["problem"] == ""


def test_nobody_can_say_which_positions_there_are_before_the_store_has(
    cell: SurroundedCell,
) -> None:
    asked = cell.positions.load()
    assert cell.refused("positions.list")[0] is V.STORE_BUSY
    found = cell.positions.position_named("park")
    assert isinstance(found, Refusal)
    assert found.code is V.STORE_BUSY
    assert cell.positions.position_named("home") == HOME
    saved = {"name": "park", "joints": PARK, "expected_revision": 0}
    assert cell.refused("positions.save", **saved)[0] is V.STORE_BUSY
    cell.perform(asked)
    assert sorted(named(cell)) == ["home", "zero"]


@pytest.mark.parametrize(
    ("name", "words"),
    [("hmoe", "the nearest is 'home'"), ("xyz", "known: home, zero, vrm, qn"), ("", "known: home")],
)
def test_an_unknown_name_is_refused_with_the_nearest_spelling(name: str, words: str) -> None:
    puma = serial_robot("puma560")
    book = PositionBook("cell", puma.named_positions, puma.limits, Pending())
    found = book.position_named(name)
    assert isinstance(found, Refusal)
    assert (found.code, words in found.text) == (V.UNKNOWN_POSITION, True)


def test_a_position_that_a_limit_excludes_is_refused_with_the_joint() -> None:
    arm = serial_robot("kuka_iiwa14")
    own = {"far": (0.0,) * 6 + (9.0,)}
    book = PositionBook("cell", own, arm.limits, Pending())
    found = book.position_named("far")
    assert isinstance(found, Refusal)
    assert (found.code, found.joint) == (V.OUT_OF_RANGE, 6)
