"""What an event may cost on its way through the server: bounds that only fall."""

import json

import pytest
from walks import walk_report
from walks.tracer import Walk
from walks.walk_bounds import Bounds, bounds, problems
from walks.walk_table import ROUTES, go, gone


@pytest.mark.parametrize("name", ROUTES)
def test_a_walk_keeps_to_its_bounds(name: str) -> None:
    assert problems(gone(name), bounds()[name]) == []


def test_a_walk_is_the_same_in_every_run() -> None:
    assert go("b2") == gone("b2")


def test_each_walk_has_its_bounds() -> None:
    assert list(bounds()) == list(ROUTES)


@pytest.mark.parametrize(
    ("calls", "said"),
    [
        (101, ["101 calls, more than the bound of 100"]),
        (100, []),
        (90, []),
        (89, ["89 calls: lower the bound of 100 in bounds.toml to that"]),
    ],
)
def test_a_count_may_be_at_its_bound_or_a_tenth_below(calls: int, said: list[str]) -> None:
    assert problems(Walk({"server/core/cell_core.py": calls}), Bounds(100, 1, 50, 1)) == said


def test_files_are_bounded_as_calls_are() -> None:
    walk = Walk(dict.fromkeys(map(str, range(11)), 1))
    assert problems(walk, Bounds(11, 10, 0, 0)) == ["11 files, more than the bound of 10"]
    assert problems(walk, Bounds(11, 13, 0, 0)) == [
        "11 files: lower the bound of 13 in bounds.toml to that"
    ]


def test_a_walk_is_shown_file_by_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert walk_report.main(["b1"]) == 0
    walk, lines = gone("b1"), capsys.readouterr().out.splitlines()
    assert lines[0] == "b1  jog beat in"
    assert lines[1].startswith(f"{walk.calls} calls of {len(walk.functions)} functions in ")
    assert "data_received" in lines[4]
    files = [line for line in lines[2:] if line and not line.startswith("      ")]
    assert len(files) == len(walk.files)
    assert sum(int(line.split()[0]) for line in files) == walk.calls


def test_a_walk_is_shown_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert walk_report.main(["b1", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["calls"] == sum(each["calls"] for each in shown["path"])
    assert shown["files"] == len(shown["path"])
    assert shown["budget"] == {"calls": 22, "files": 10}


def test_an_unknown_walk_is_refused_with_the_names_of_all(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert walk_report.main(["a9"]) == 2
    assert "no walk 'a9'; there are a1, a2, b1, b2, idle" in capsys.readouterr().err
