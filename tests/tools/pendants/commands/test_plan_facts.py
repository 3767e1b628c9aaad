"""`openpendant plan`: where it plans, a plan's facts in words, and how samples are asked for."""

import asyncio
import csv
from typing import Any

import pytest

from openpendant.motion.cli import plan_command
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools import plan as routing
from openpendant.tools.completion import known_words
from openpendant.tools.help_text import run_for_help
from openpendant.tools.pendants.commands import plan
from openpendant.tools.pendants.connection_errors import NotUnderstood, Refused

JOINTS: Any = [
    {"name": "rail", "unit": "m", "display_name": "Rail"},
    {"name": "elbow", "unit": "rad"},
]
MADE: Any = {
    "plan": 7,
    "duration": 1.434,
    "samples": 144,
    "planner": "RRTConnect",
    "seed": 3,
    "plan_time": 0.25,
    "end": [0.5, 1.5707963267948966],
    "end_pose": {"position": [0.1, -0.2, 0.3], "orientation": [0, 0, 0, 1]},
    "certificate": {
        "worst": [{"joint": "rail", "quantity": "mean_velocity", "ratio": 0.5, "at": 0.2}]
    },
    "clearance": {"distance": 0.0341, "first": "elbow", "second": "pillar", "at": 0.7},
    "why": {"code": 30, "text": "the enabling device is not held"},
}


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (["--robot", "ur5"], "offline"),
        (["--cell", "left", "--to", "home"], "cell"),
        (["--server=10.0.0.1", "--to", "home"], "cell"),
        (["--robot", "ur5", "--scene", "--cellar"], "offline"),
    ],
)
def test_a_server_or_a_cell_among_the_options_says_where_it_plans(
    monkeypatch: pytest.MonkeyPatch, words: list[str], where: str
) -> None:
    went: list[str] = []
    for module, name in ((plan_command, "offline"), (plan, "cell")):
        monkeypatch.setattr(module, "main", lambda _, name=name: went.append(name))
    routing.main(words)
    assert went == [where]


def test_the_help_text_and_the_completed_words_are_of_both() -> None:
    _, text = run_for_help(routing.main, ["--help"])
    assert "--scene" in text
    assert "--execute" in text
    _, served = run_for_help(routing.main, ["--cell", "left", "--help"])
    assert "--scene" not in served
    assert {"--scene", "--cell", "--execute", "--csv"} <= set(known_words()["plan"])


def test_the_facts_of_a_plan_are_told_in_degrees_and_millimetres() -> None:
    assert list(plan.plan_in_words(MADE, JOINTS)) == [
        "plan 7: 1.43 s, 144 samples, by RRTConnect, seed 3 in 0.25 s",
        "ends at 500.0 mm, 90.00°",
        "tool then at X 100.0 Y -200.0 Z 300.0 mm, A 0.0 B 0.0 C 0.0°",
        "mean velocity at most 50% of its limit (Rail)",
        "comes as near as 34.1 mm: elbow and pillar, after 0.70 s",
        "would not be executed now: the enabling device is not held",
    ]


@pytest.mark.parametrize("why", [None, {"code": 4, "text": "not in control"}])
def test_nothing_is_told_of_obstacles_and_refusals_that_are_none(why: Any) -> None:
    lines = list(plan.plan_in_words(MADE | {"clearance": None, "why": why}, JOINTS))
    assert len(lines) == 4


class Asked:
    """A server's samples, in parts; the first question is one too many."""

    def __init__(self, rows: list[list[float]], most: int) -> None:
        self.rows, self.most, self.asked = rows, most, 0
        self.plans = self

    async def samples(self, number: int, *, first: int) -> Any:
        self.asked += 1
        assert self.asked < 20
        if self.asked == 1:
            raise Refused(V.TOO_OFTEN, "too often", -1, 0.01, 0.0)
        rows = self.rows[first : first + self.most]
        more = first + self.most < len(self.rows) or self.most == 0
        return {"rows": rows, "more": more, "total": len(self.rows)}


@pytest.mark.virtual_clock
async def test_samples_are_asked_for_until_all_are_there_no_oftener_than_is_answered() -> None:
    rows = [[0.01 * n, 0.0] for n in range(5)]
    asked: Any = Asked(rows, 2)
    began = asyncio.get_running_loop().time()
    assert await plan._samples(asked, 7) == rows
    # Four questions with a pause between them; the first one was refused.
    assert asked.asked == 4
    assert asyncio.get_running_loop().time() - began == pytest.approx(0.15)


@pytest.mark.virtual_clock
async def test_samples_that_do_not_end_are_not_waited_for() -> None:
    endless: Any = Asked([[0.0, 0.0]], 0)
    with pytest.raises(NotUnderstood):
        await plan._samples(endless, 7)


def test_numbers_of_a_spreadsheet_read_back_bit_for_bit() -> None:
    rows = [[0.0, 0.1 + 0.2, 1e-17, 0.0, 0.0, 0.0, 0.0]]
    header, numbers = csv.reader(plan.samples_as_csv(rows, JOINTS).splitlines())
    assert header[1:4] == ["rail position [m]", "elbow position [rad]", "rail velocity [m/s]"]
    assert [float(each) for each in numbers] == rows[0]
