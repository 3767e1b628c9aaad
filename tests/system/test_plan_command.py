"""`openpendant plan` at a served cell, as a script calls it, over sockets."""

import asyncio
import csv
import json
from pathlib import Path
from typing import Any

import pytest

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg.pendant import OperatingMode
from openpendant.tools.plan import main

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

CELL = {"has_store": True}
HOME = serial_robot("ur5").home_position
ASIDE = [HOME[0] + 0.4, *HOME[1:]]
FACTS = {"plan", "duration", "samples", "certificate", "clearance", "based_on", "executable", "why"}


async def types(
    cell: Any, capsys: pytest.CaptureFixture[str], *words: str
) -> tuple[int, list[dict[str, Any]], str]:
    """Return exit code, the JSON lines, and what went to standard error."""
    where = ["--server", f"127.0.0.1:{cell.ports['pendant']}", "--json"]
    code = await asyncio.to_thread(main, [*words, *where])
    said = capsys.readouterr()
    return code, [json.loads(line) for line in said.out.splitlines()], said.err


async def test_a_plan_is_made_and_told_and_nothing_moves(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant = await shared_cell.ready_pendant()
    before = pendant.joints()
    code, (told,), err = await types(shared_cell, capsys, "--goal", json.dumps(ASIDE))
    assert (code, err, told["event"]) == (0, "", "planned")
    assert told.keys() >= FACTS
    assert told["end"] == pytest.approx(ASIDE)
    await pendant.next_state()
    assert pendant.joints() == before
    # It ended with the connection of the command.
    assert [each["state"] for each in (await pendant.plans.show())["plans"]] == ["dropped"]


async def test_what_is_executed_ends_where_the_plan_ends(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant = await shared_cell.ready_pendant()
    words = ("--goal", json.dumps(ASIDE), "--execute")
    code, told, err = await types(shared_cell, capsys, *words)
    assert (code, err) == (0, "")
    assert [told[0]["event"], told[-1]["event"]] == ["planned", "completed"]
    assert told[-1]["motion_time"] == pytest.approx(told[0]["duration"], abs=1e-6)
    await pendant.next_state()
    assert pendant.joints() == pytest.approx(ASIDE, abs=1e-3)

    code, told, err = await types(shared_cell, capsys, "--to", "home", "--execute")
    assert (code, err) == (0, "")
    await pendant.next_state()
    assert pendant.joints() == pytest.approx(HOME, abs=1e-3)
    code, told, _ = await types(shared_cell, capsys, "--to", "home", "--execute")
    assert (code, told[-1]["event"]) == (0, "completed")


async def test_samples_are_written_as_a_spreadsheet_takes_them(
    shared_cell: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    await shared_cell.ready_pendant()
    file = tmp_path / "samples.csv"
    words = ("--goal", json.dumps(ASIDE), "--speed", "0.1", "--csv", str(file))
    code, (told,), _ = await types(shared_cell, capsys, *words)
    assert code == 0
    header, *rows = list(csv.reader(file.read_text("utf-8").splitlines()))
    assert header[:2] == ["time [s]", "shoulder_pan_joint position [rad]"]
    assert header[-1] == "wrist_3_joint acceleration [rad/s²]"
    assert len(rows) == told["samples"] > 100
    assert [float(each) for each in rows[-1][1:7]] == told["end"]


async def test_a_way_around_what_stands_in_the_cell_is_the_same_for_the_same_seed(
    shared_cell: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pendant = await shared_cell.ready_pendant()
    written = []
    goal = json.dumps([HOME[0] + 2.4, *HOME[1:]])
    between = await pendant.kinematics.fk(joints=[HOME[0] + 1.2, *HOME[1:]])
    x, y, _ = between["position"]
    async with pendant.control():
        await pendant.scene.add(
            {
                "name": "pillar",
                "shape": {"type": "box", "size": [0.08, 0.08, 1.5]},
                "position": [x, y, 0.5],
            },
            expected_revision=(await pendant.scene.show())["revision"],
        )
    code, _, err = await types(shared_cell, capsys, "--goal", goal)
    assert code == 1
    assert "PATH_IN_COLLISION" in err
    for number in range(2):
        file = tmp_path / f"{number}.csv"
        free = ("--way", "free", "--planner", "BuiltInRRTConnect", "--seed", "3")
        code, (told,), err = await types(
            shared_cell, capsys, "--goal", goal, *free, "--csv", str(file)
        )
        assert (code, err) == (0, "")
        assert (told["planner"], told["seed"]) == ("BuiltInRRTConnect", 3)
        assert told["clearance"]["distance"] > 0
        written.append(file.read_bytes())
    assert written[0] == written[1]
    async with pendant.control():
        now = (await pendant.scene.show())["revision"]
        await pendant.scene.remove("pillar", expected_revision=now)


async def test_an_execution_that_is_not_allowed_is_refused_with_its_remedy(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant = await shared_cell.ready_pendant()
    async with pendant.control():
        await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
    code, told, err = await types(
        shared_cell, capsys, "--goal", json.dumps(ASIDE), "--speed", "0.1", "--execute"
    )
    async with pendant.control():
        await pendant.set_mode(OperatingMode.AUTOMATIC)
    assert code == 1
    assert (told[0]["executable"], told[-1]["name"]) == (False, "NOT_ENABLED")
    assert "NOT_ENABLED" in err


@pytest.mark.parametrize(
    ("words", "ends", "told"),
    [
        (("--to", "nowhere"), 1, "UNKNOWN_POSITION"),
        (("--goal", "[0]"), 1, "WRONG_JOINT_COUNT"),
        (("--goal", "[0", "--degrees"), 2, "is no JSON"),
        (("--to", "home", "--way", "lin"), 2, "--to takes no --way"),
    ],
)
async def test_what_cannot_be_planned_has_its_exit_code_and_one_sentence(
    shared_cell: Any,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    ends: int,
    told: str,
) -> None:
    await shared_cell.ready_pendant()
    code, _, err = await types(shared_cell, capsys, *words)
    assert code == ends
    assert told in err
    assert len(err.splitlines()) == 1


async def test_a_file_that_cannot_be_written_is_named(
    shared_cell: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    await shared_cell.ready_pendant()
    words = ("--goal", json.dumps(ASIDE), "--csv", str(tmp_path / "missing" / "samples.csv"))
    code, _, err = await types(shared_cell, capsys, *words)
    assert code == 74
    assert "samples.csv: No such file" in err
