"""What the tracer counts, on functions of two small files of a product that is not ours."""

import sys
import threading
from collections.abc import Callable
from types import FrameType, SimpleNamespace

import pytest
from walks.tracer import ROOMS, Tracer, Walk, WalkFailed, any_frame, product_file

from openpendant.server.shell import app

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


def test_the_thread_is_left_as_it_was(product: SimpleNamespace) -> None:
    before = sys.getprofile()
    with pytest.raises(ZeroDivisionError), Tracer(file_of=file_of):
        raise ZeroDivisionError
    assert sys.getprofile() is before


def test_files_are_named_by_their_room() -> None:
    path = app.App.tick.__code__.co_filename
    assert product_file(path) == "server/shell/app.py"
    assert "controller_emulator" not in ROOMS
    assert product_file(path.replace("/server/", "/controller_emulator/")) is None
    assert product_file(__file__) is None
