"""The walks of events through the server: how they are counted, their budgets, and their page."""

import gc
import json
import sys
import threading
from collections.abc import Callable
from types import FrameType, SimpleNamespace

import pytest
from walks import walk_report
from walks.motion_page import PAGE, page
from walks.tracer import ROOMS, Tracer, Walk, WalkFailed, any_frame, product_file
from walks.walk_report import Bounds, bounds, problems
from walks.walk_table import ROUTES, go, gone

from openpendant.server.shell import app


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
    assert shown["budget"] == {"calls": 23, "files": 10}


def test_an_unknown_walk_is_refused_with_the_names_of_all(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert walk_report.main(["a9"]) == 2
    assert "no walk 'a9'; there are a1, a2, b1, b2, idle" in capsys.readouterr().err


def test_the_page_is_what_the_walks_give() -> None:
    written = PAGE.read_text(encoding="utf-8")
    assert written == page(), "`make reference` writes the page anew"


def test_each_folder_of_a_walk_has_its_row_and_its_function_a_summary() -> None:
    text = page()
    for file in gone("a1").files:
        assert f"| `{file.rpartition('/')[0]}/` |" in text
    assert " |  |" not in text, "a function without a docstring"


def test_the_page_fits_a_screen() -> None:
    assert len(page().splitlines()) <= 100


CELL = """
def handle(planner):
    checked(1)
    checked(2)
    return plan(planner, [checked(each) for each in (3, 4)])

def checked(value):
    return value

def numbers():
    yield 1
    yield 2

def sums():
    return sum(numbers()) + sum(each for each in numbers())

def failing():
    try:
        refuse()
    except ValueError:
        checked(1)
"""

PLANS = """
def plan(planner, values):
    planner(values)
    return told()

def told():
    return "told"

def refuse():
    raise ValueError
"""


@pytest.fixture
def product() -> SimpleNamespace:
    """Both files, as if they had been imported."""
    plans: dict[str, object] = {}
    exec(compile(PLANS, "/product/plans.py", "exec"), plans)
    cell = dict(plans)
    exec(compile(CELL, "/product/cell.py", "exec"), cell)
    return SimpleNamespace(**{name: each for name, each in cell.items() if callable(each)})


def file_of(path: str) -> str | None:
    return path.removeprefix("/product/") if path.startswith("/product/") else None


def traced(
    call: Callable[[], object],
    *leads_to: Callable[[FrameType], bool],
    begins: Callable[[FrameType], bool] = any_frame,
    returns: bool = False,
) -> Walk:
    with Tracer(begins, leads_to, returns=returns, file_of=file_of) as tracer:
        call()
    return tracer.walk


def named(name: str) -> Callable[[FrameType], bool]:
    return lambda frame: frame.f_code.co_name == name


def planner(values: object) -> None:
    """Stand for a library: it does not count."""


def test_calls_files_hops_and_depth(product: SimpleNamespace) -> None:
    walk = traced(lambda: product.handle(planner))
    assert walk.calls == 7  # handle, checked four times, plan, told
    assert list(walk.files.items()) == [("cell.py", 5), ("plans.py", 2)]
    assert list(walk.functions.items()) == [
        (("cell.py", "handle"), 1),
        (("cell.py", "checked"), 4),
        (("plans.py", "plan"), 1),
        (("plans.py", "told"), 1),
    ]
    assert walk.hops == 1
    assert walk.depth == 3


def test_a_generator_is_one_call_however_often_it_is_resumed(product: SimpleNamespace) -> None:
    assert traced(product.sums).functions == {("cell.py", "sums"): 1, ("cell.py", "numbers"): 2}


def test_what_is_raised_and_caught_leaves_the_stack_right(product: SimpleNamespace) -> None:
    walk = traced(product.failing)
    assert walk.functions == {
        ("cell.py", "failing"): 1,
        ("plans.py", "refuse"): 1,
        ("cell.py", "checked"): 1,
    }
    assert (walk.hops, walk.depth) == (1, 2)


def test_a_walk_ends_with_the_effect_that_it_leads_to(product: SimpleNamespace) -> None:
    walk = traced(lambda: product.handle(planner), named("planner"))
    assert ("plans.py", "plan") in walk.functions
    assert ("plans.py", "told") not in walk.functions


def test_a_walk_may_go_on_behind_its_effects(product: SimpleNamespace) -> None:
    walk = traced(lambda: product.handle(planner), named("planner"), returns=True)
    assert ("plans.py", "told") in walk.functions


def test_a_walk_begins_where_it_is_said_to(product: SimpleNamespace) -> None:
    def two_events() -> None:
        product.failing()
        product.handle(planner)
        product.failing()

    walk = traced(two_events, begins=named("handle"))
    assert ("cell.py", "failing") not in walk.functions
    assert walk.calls == 7


def test_only_the_first_event_is_walked(product: SimpleNamespace) -> None:
    def twice() -> None:
        product.checked(1)
        product.checked(2)

    assert traced(twice).calls == 1


def test_a_walk_that_misses_its_effect_fails(product: SimpleNamespace) -> None:
    with pytest.raises(WalkFailed, match=r"did not come to its end, but to plans.py: told"):
        traced(lambda: product.handle(planner), named("store"))
    with pytest.raises(WalkFailed, match="did not come to its end"):
        traced(lambda: product.handle(planner), named("planner"), named("store"), returns=True)


def test_an_effect_after_the_event_does_not_count_for_it(product: SimpleNamespace) -> None:
    def first_the_event_then_the_effect() -> None:
        product.checked(1)
        planner(1)

    with pytest.raises(WalkFailed, match="did not come to its end"):
        traced(first_the_event_then_the_effect, named("planner"))


def test_a_walk_that_nothing_begins_fails(product: SimpleNamespace) -> None:
    with pytest.raises(WalkFailed, match="did not begin"):
        traced(lambda: product.handle(planner), begins=named("tick"))


def test_other_threads_do_not_count(product: SimpleNamespace) -> None:
    def in_a_thread() -> None:
        product.checked(1)
        thread = threading.Thread(target=product.handle, args=(planner,))
        thread.start()
        thread.join()

    assert traced(in_a_thread).calls == 1


def test_what_others_left_behind_is_not_finished_within_a_walk(product: SimpleNamespace) -> None:
    unfinished = product.numbers()
    next(unfinished)
    garbage: list[object] = [unfinished]
    garbage.append(garbage)
    thresholds = gc.get_threshold()

    def collecting(values: object) -> None:
        gc.set_threshold(1, 1, 1)
        assert len([[each] for each in range(2_000)]) == 2_000

    del unfinished, garbage
    try:
        walk = traced(lambda: product.handle(collecting))
    finally:
        gc.set_threshold(*thresholds)
    assert ("cell.py", "numbers") not in walk.functions
    assert walk.calls == 7


def test_the_thread_is_left_as_it_was(product: SimpleNamespace) -> None:
    before = sys.getprofile(), gc.isenabled()
    with pytest.raises(ZeroDivisionError), Tracer(file_of=file_of):
        raise ZeroDivisionError
    assert (sys.getprofile(), gc.isenabled()) == before


def test_files_are_named_by_their_room() -> None:
    path = app.App.tick.__code__.co_filename
    assert product_file(path) == "server/shell/app.py"
    assert "controller_emulator" not in ROOMS
    assert product_file(path.replace("/server/", "/controller_emulator/")) is None
    assert product_file(__file__) is None
