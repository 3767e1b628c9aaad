"""The preview of a program: a dry run with samples, to be looked at and never executed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from rigs.cells.planning_pendants import PlansCell
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = "0 -1.5707963267948966 1.5707963267948966 -1.5707963267948966 -1.5707963267948966 0"
PROGRAM = f"""openpendant-program/1
program "main" robot ur5
point a joints 0.3 -1.5 1.5 -1.5 -1.5 0 rad
point b joints {HOME} rad
move PTP a
wait 0.5 s
move PTP b
"""


@pytest.fixture
def cell() -> Iterator[PlansCell]:
    made = PlansCell()
    saved = made.operator.ask("programs.save", name="main", body=PROGRAM, expected_revision=0)
    assert "code" not in saved, saved
    yield made
    assert made.controller.referee.total == 0


def older(cell: PlansCell) -> Pendant:
    """Return a pendant of version 2."""
    pendant = cell.stranger()
    pendant.hello(version=2)
    return pendant


def dry_run(cell: PlansCell, **fields: Any) -> dict[str, Any]:
    return cell.ask_later(cell.operator, "programs.dry_run", name="main", **fields)


def test_without_samples_it_names_no_plan(cell: PlansCell) -> None:
    assert "plan" not in dry_run(cell)
    assert cell.operator.ask("plans.show")["plans"] == []


def test_its_motions_are_read_one_behind_the_other(cell: PlansCell) -> None:
    told = dry_run(cell, samples=True)
    rows = cell.samples(told["plan"])
    assert rows[0][1:7] == pytest.approx(cell.home, abs=1e-6)
    assert [0.3, -1.5, 1.5, -1.5, -1.5, 0.0] in [row[1:7] for row in rows]
    assert rows[-1][1:7] == pytest.approx([float(each) for each in HOME.split()])
    assert rows[-1][0] == pytest.approx(told["duration"] - 0.5, abs=0.02)
    (head,) = cell.operator.ask("plans.show")["plans"]
    assert (head["kind"], head["label"], head["state"]) == ("program", "main", "ready")


def test_it_is_never_executed(cell: PlansCell) -> None:
    plan = dry_run(cell, samples=True)["plan"]
    assert cell.execute(plan) is V.NOT_STANDING
    cell.wait(100)
    assert cell.handed == []
    assert cell.state_of(plan) == "ready"


def test_it_outlives_what_makes_a_plan_stale_and_expires_as_one(cell: PlansCell) -> None:
    plan = dry_run(cell, samples=True)["plan"]
    cell.operator.move(*cell.turned(0.2))
    cell.let_finish()
    assert cell.state_of(plan) == "ready"
    for _ in range(600):
        cell.wait(100)
    assert cell.state_of(plan) == "expired"


def test_one_that_cannot_be_walked_has_none(cell: PlansCell) -> None:
    away = PROGRAM.replace("joints 0.3", "joints 9.3")
    cell.operator.ask("programs.save", name="main", body=away, expected_revision=1)
    told = dry_run(cell, samples=True)
    assert (told["plan"], told["refused"] > 0) == (None, True)


def test_one_for_which_there_is_no_room_is_refused(cell: PlansCell) -> None:
    for maker in (cell.other("a"), cell.other("b")):
        for _ in range(4):
            cell.plan(maker)
    assert dry_run(cell, samples=True)["code"] == V.TOO_MANY_PLANS


def test_a_grasp_that_misses_has_a_code_that_whoever_asks_knows(cell: PlansCell) -> None:
    cell.add_box("cube", (2.0, 2.0, 2.0))
    body = PROGRAM + 'attach "cube"\n'
    saved = cell.operator.ask("programs.save", name="main", body=body, expected_revision=1)
    assert "code" not in saved, saved
    for pendant, code in ((cell.operator, V.NOTHING_GRIPPED), (older(cell), V.UNKNOWN_OBJECT)):
        (missed,) = cell.ask_later(pendant, "programs.dry_run", name="main")["scene"]
        assert (missed["code"], "reach" in missed["text"]) == (code, True)
