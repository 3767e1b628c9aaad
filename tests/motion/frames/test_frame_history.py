import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.motion.nearness import assert_same_pose

from openpendant.motion.errors import BadArgument, FrameUnknown, NotInHistory
from openpendant.motion.frames.frame_history import FrameHistory
from openpendant.motion.frames.frame_tree import BASE, FLANGE, TOOL, FrameTree
from openpendant.motion.pose import Pose

MS = 1_000_000
S = 1_000_000_000
TABLE = Pose.from_rpy((0.0, 0.5, 0.0), (0.0, 0.0, math.pi / 2))
TCP = Pose.from_rpy((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))


def at(x: float, yaw: float = 0.0) -> Pose:
    return Pose.from_rpy((x, 0.0, 0.0), (0.0, 0.0, yaw))


def tree() -> FrameTree:
    return FrameTree().add("table", TABLE).add_tool("hand", TCP).select_tool("hand")


@pytest.fixture
def history() -> FrameHistory:
    """The flange at x = 0, 1, 2 m, turned by 0, 0.1, 0.3 rad, at 1, 2, 3 s."""
    history = FrameHistory(tree())
    for number, yaw in enumerate((0.0, 0.1, 0.3)):
        history.record((number + 1) * S, {FLANGE: at(float(number), yaw)})
    return history


@pytest.mark.parametrize(
    ("time", "x", "yaw"),
    [
        (1.0, 0.0, 0.0),
        (1.5, 0.5, 0.05),
        (2.0, 1.0, 0.1),
        (2.25, 1.25, 0.15),
        (3.0, 2.0, 0.3),
    ],
)
def test_between_samples_a_frame_goes_straight_and_turns_evenly(
    history: FrameHistory, time: float, x: float, yaw: float
) -> None:
    assert_same_pose(history.transform(FLANGE, BASE, int(time * S)), at(x, yaw))


def test_the_past_is_known_between_any_two_frames(history: FrameHistory) -> None:
    expected = TABLE.inverse().compose(at(0.5, 0.05)).compose(TCP)
    assert_same_pose(history.transform(TOOL, "table", 3 * S // 2), expected)
    assert_same_pose(history.transform("table", TOOL, 3 * S // 2), expected.inverse())


@pytest.mark.parametrize("time", [0, S - 1, 3 * S + 1, -5])
def test_a_time_outside_is_refused_with_its_bounds(history: FrameHistory, time: int) -> None:
    with pytest.raises(NotInHistory, match=r"1 to 3 s") as refusal:
        history.transform(TOOL, BASE, time)
    error = refusal.value
    assert (error.frame, error.time, error.oldest, error.newest) == (FLANGE, time, S, 3 * S)


def test_frames_that_do_not_move_are_known_at_any_time(history: FrameHistory) -> None:
    assert_same_pose(history.transform("table", BASE, -100 * S), TABLE)


def test_before_the_first_sample_nothing_is_known() -> None:
    history = FrameHistory(tree())
    assert history.covered(FLANGE) is None
    with pytest.raises(NotInHistory, match="no pose of 'flange' is known yet"):
        history.transform(TOOL, BASE)


def test_the_past_uses_the_tool_and_the_frames_of_that_time(history: FrameHistory) -> None:
    longer = Pose.from_rpy((0.0, 0.0, 0.4), (0.0, 0.0, 0.0))
    history.define(5 * S // 2, tree().move("hand", longer).remove("table"))
    assert_same_pose(history.transform(TOOL, BASE, 2 * S), at(1.0, 0.1).compose(TCP))
    assert_same_pose(history.transform(TOOL, BASE), at(2.0, 0.3).compose(longer))
    assert_same_pose(history.transform("table", BASE, 2 * S), TABLE)
    with pytest.raises(FrameUnknown, match="table"):
        history.transform("table", BASE)


def test_a_frame_of_one_time_is_seen_from_another(history: FrameHistory) -> None:
    was = history.transform_between_times(FLANGE, 1 * S, FLANGE, 3 * S)
    assert_same_pose(was, at(2.0, 0.3).inverse().compose(at(0.0)))


def test_the_span_is_covered_to_its_end_and_no_further() -> None:
    history = FrameHistory(tree(), span=S)
    for tick in range(0, 3000, 7):
        history.record(tick * MS, {FLANGE: at(float(tick))})
    newest = 2996 * MS
    assert history.covered(FLANGE) == (1995 * MS, newest)
    assert_same_pose(history.transform(FLANGE, BASE, newest - S), at(1996.0))
    with pytest.raises(NotInHistory):
        history.transform(FLANGE, BASE, newest - S - 2 * MS)


def test_the_number_of_samples_is_bounded() -> None:
    history = FrameHistory(tree(), span=100 * S, most_samples=10)
    for tick in range(100):
        history.record(tick, {FLANGE: at(0.0)})
    assert history.covered(FLANGE) == (90, 99)


@given(st.lists(st.integers(1, 400), min_size=2, max_size=60), st.data())
def test_every_time_of_the_span_is_known(gaps: list[int], data: st.DataObject) -> None:
    span = 1000
    history = FrameHistory(tree(), span=span)
    time = 0
    for gap in gaps:
        time += gap
        history.record(time, {FLANGE: at(time / 1e3)})
    covered = history.covered(FLANGE)
    assert covered is not None
    assert covered[0] <= max(gaps[0], time - span)
    asked = data.draw(st.integers(max(gaps[0], time - span), time))
    assert history.transform(FLANGE, BASE, asked).position[0] == pytest.approx(asked / 1e3)


@pytest.mark.parametrize("time", [2 * S, 3 * S])
def test_time_never_goes_back(history: FrameHistory, time: int) -> None:
    with pytest.raises(BadArgument, match="or later"):
        history.record(time, {FLANGE: at(9.0)})
    assert_same_pose(history.transform(FLANGE, BASE), at(2.0, 0.3))


def test_the_tree_of_an_earlier_time_is_refused(history: FrameHistory) -> None:
    history.define(5 * S, tree())
    with pytest.raises(BadArgument, match="or later"):
        history.define(4 * S, FrameTree())


def test_several_frames_are_taken_in_together_or_not_at_all() -> None:
    history = FrameHistory(FrameTree.of_robot(links=("link_1",)))
    history.record(S, {FLANGE: at(1.0), "link_1": at(0.5)})
    assert_same_pose(history.transform("link_1", FLANGE), at(-0.5))
    for bad, error in (("nowhere", FrameUnknown), (BASE, BadArgument)):
        with pytest.raises(error):
            history.record(2 * S, {FLANGE: at(7.0), bad: at(0.0)})
    assert history.covered(FLANGE) == (S, S)


def test_a_history_without_room_is_refused() -> None:
    with pytest.raises(BadArgument, match="span"):
        FrameHistory(tree(), span=0)
    with pytest.raises(BadArgument, match="most_samples"):
        FrameHistory(tree(), most_samples=1)
