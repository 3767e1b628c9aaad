import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rigs.motion.nearness import assert_same_pose

from openpendant.motion.errors import BadArgument, NotFinite, PoorGeometry
from openpendant.motion.frames.frame_teaching import frame_from_four_points, frame_from_three_points
from openpendant.motion.frames.tool_calibration import tool_centre, tool_orientation
from openpendant.motion.pose import Array, Pose

coordinates = st.floats(-2.0, 2.0)
poses = st.builds(
    Pose.from_rpy,
    st.tuples(coordinates, coordinates, coordinates),
    st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)),
)
lengths = st.floats(0.05, 1.0)

ORIGIN, X, Y = (0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0)


def inside(frame: Pose, *point: float) -> list[float]:
    placed: list[float] = (frame.position + frame.rotation @ np.array(point)).tolist()
    return placed


@given(poses, lengths, st.floats(-0.5, 0.5), lengths)
def test_three_points_give_the_frame_back(frame: Pose, x: float, beside: float, y: float) -> None:
    assume(math.atan2(y, abs(beside)) > 0.1 and math.hypot(beside - x, y) > 0.02)
    on_x, on_y_side = inside(frame, x, 0.0, 0.0), inside(frame, beside, y, 0.0)
    taught = frame_from_three_points(frame.position, on_x, on_y_side)
    assert taught.pose.position_distance(frame) == 0.0
    assert taught.pose.rotation_distance(frame) < 1e-12
    assert taught.x_distance == pytest.approx(x)
    assert taught.y_distance == pytest.approx(y)
    assert taught.angle == pytest.approx(math.atan2(y, beside))


def test_the_third_point_decides_the_side_of_z() -> None:
    assert frame_from_three_points(ORIGIN, X, Y).pose.rotation[:, 2] == pytest.approx([0, 0, 1])
    below = frame_from_three_points(ORIGIN, X, (0.1, -0.2, 0.0))
    assert below.pose.rotation[:, 2] == pytest.approx([0, 0, -1])


def test_the_tilt_tells_what_a_touch_that_is_off_does_to_the_frame() -> None:
    taught = frame_from_three_points(ORIGIN, X, Y)
    error = 1e-4
    tilted = frame_from_three_points(ORIGIN, X, (0.0, 0.2, error)).pose
    told = error * taught.tilt_per_error
    assert taught.pose.rotation_distance(tilted) == pytest.approx(told, rel=1e-3)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ((ORIGIN, ORIGIN, Y), ["origin to on_x", "0 mm", "at least 10 mm"]),
        ((ORIGIN, X, ORIGIN), ["origin to on_y_side", "0 mm"]),
        ((ORIGIN, X, X), ["on_x to on_y_side", "0 mm"]),
        ((ORIGIN, (0.0099, 0.0, 0.0), Y), ["9.9 mm", "at least 10 mm"]),
        ((ORIGIN, X, (0.6, 0.0, 0.0)), ["angle at the origin", "0°", "at least 5°"]),
        ((ORIGIN, X, (-0.2, 0.0, 0.0)), ["angle at the origin", "180°", "at most 175°"]),
        ((ORIGIN, X, (0.5, 0.04, 0.0)), ["4.57°", "at least 5°"]),
        ((X, X, Y, (0, 0.5, 0)), ["first_on_x to second_on_x", "0 mm"]),
        ((X, (0.5, 0, 0), Y, Y), ["first_on_y to second_on_y", "0 mm"]),
        ((X, (0.5, 0, 0), Y, (0.5, 0.5, 0)), ["right angle", "59°", "at most 10°"]),
        ((X, (0.5, 0, 0), X, (0.5, 0, 0)), ["right angle", "90°", "at most 10°"]),
        ((X, (0.5, 0, 0), (0, 0.2, 0.1), (0, 0.5, 0.1)), ["100 mm", "at most 20 mm"]),
    ],
)
def test_points_that_give_no_frame_are_refused_with_numbers(
    points: tuple[tuple[float, ...], ...], words: list[str]
) -> None:
    """Of three points, and of two on each axis."""
    teach = frame_from_three_points if len(points) == 3 else frame_from_four_points
    with pytest.raises(PoorGeometry) as refusal:
        teach(*points)
    assert [word for word in words if word not in str(refusal.value)] == []


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_point_that_is_none_is_refused(place: int) -> None:
    points: list[tuple[float, ...]] = [ORIGIN, X, Y]
    points[place] = (math.nan, 0.0, 0.0)
    with pytest.raises(NotFinite):
        frame_from_three_points(*points)
    points[place] = (1.0, 0.0)
    with pytest.raises(BadArgument, match="3 numbers"):
        frame_from_three_points(*points)


@given(poses, lengths, lengths)
def test_two_points_on_each_axis_give_the_frame(frame: Pose, x: float, y: float) -> None:
    points = ((x, 0.0), (x + 0.3, 0.0), (0.0, y), (0.0, y + 0.2))
    taught = frame_from_four_points(*(inside(frame, *point, 0.0) for point in points))
    assert_same_pose(taught.pose, frame)
    assert taught.skew < 1e-12
    assert taught.gap < 1e-12


def test_what_the_axes_miss_the_right_angle_and_each_other_by_is_told() -> None:
    on_y = (0.0, 0.1, 0.002), (0.4 * math.tan(0.05), 0.5, 0.002)
    taught = frame_from_four_points((0.1, 0, 0), (0.5, 0, 0), *on_y)
    assert taught.skew == pytest.approx(0.05)
    assert taught.gap == pytest.approx(0.002)
    assert taught.pose.rotation == pytest.approx(np.eye(3), abs=1e-12)


TCP = np.array([0.012, -0.034, 0.156])
POINT = np.array([0.8, 0.1, 0.3])
# Straight down, tilted by 30 to 60 degrees to several sides: what a person would do.
TURNS = [
    (math.pi, 0.0, 0.0),
    (math.pi - 0.6, 0.0, 0.0),
    (math.pi, 0.7, 0.0),
    (math.pi + 0.5, -0.4, 1.0),
    (math.pi, -0.5, -0.8),
    (math.pi - 0.4, 0.5, 2.0),
]

tcps = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.5, 0.5))
Turns = list[tuple[float, float, float]]


def touching(tcp: Array, turns: Turns, noise: float = 0.0) -> list[Pose]:
    """Flange poses whose TCP is at POINT, each off by noise [m] in a random direction."""
    random = np.random.default_rng(7)
    poses = []
    for turn in turns:
        rotation = Pose.from_rpy((0, 0, 0), turn).rotation
        off = random.normal(size=3) * noise
        poses.append(Pose.from_matrix(rotation, POINT - rotation @ tcp + off))
    return poses


@given(tcps)
def test_four_clean_touches_give_the_tcp_exactly(tcp: tuple[float, ...]) -> None:
    found = tool_centre(touching(np.array(tcp), TURNS[:4]))
    assert found.position == pytest.approx(tcp, abs=1e-12)
    assert found.fixed_point == pytest.approx(POINT, abs=1e-12)
    assert found.max_residual < 1e-12


@pytest.mark.parametrize("noise", [1e-5, 1e-4, 5e-4])
def test_under_noise_the_tcp_is_found_as_closely_as_is_stated(noise: float) -> None:
    found = tool_centre(touching(TCP, TURNS, noise))
    error = float(np.linalg.norm(found.position - TCP))
    assert error <= 4.0 * found.uncertainty
    assert 0.2 * noise <= np.mean(found.residuals) <= found.max_residual <= 4.0 * noise
    assert noise / 10.0 <= found.uncertainty <= 3.0 * noise


def test_the_stated_uncertainty_is_that_of_many_trials() -> None:
    noise = 1e-4
    random = np.random.default_rng(3)
    clean = touching(TCP, TURNS)
    errors, stated = [], []
    for _ in range(200):
        poses = [Pose(p.position + random.normal(size=3) * noise, p.quaternion) for p in clean]
        found = tool_centre(poses)
        errors.append(found.position - TCP)
        stated.append(found.uncertainty**2)
    # The worst direction's variance, against the mean of the variances stated for it.
    measured = float(np.linalg.eigvalsh(np.cov(np.array(errors).T))[-1])
    assert measured == pytest.approx(float(np.mean(stated)), rel=0.3)


def test_more_touches_make_the_tcp_surer() -> None:
    more = [*TURNS, (math.pi, 0.2, 1.6), (math.pi + 0.7, 0.3, -1.7), (math.pi - 0.2, -0.7, 0.4)]
    surer, sure = (tool_centre(touching(TCP, each, 1e-4)) for each in (more, TURNS[:4]))
    assert surer.uncertainty < sure.uncertainty


@pytest.mark.parametrize("count", [0, 1, 3])
def test_fewer_than_four_poses_are_refused(count: int) -> None:
    with pytest.raises(BadArgument, match="4 or more"):
        tool_centre(touching(TCP, TURNS[:count]))


@pytest.mark.parametrize(
    ("turns", "words"),
    [
        ([*TURNS, TURNS[1]], r"\(2 and 7\) is 0°; accepted: at least 10°"),
        (
            [(math.pi, 0.05 * number, 0.0) for number in range(5)],
            r"smallest turn .* 2\.86°; accepted: at least 10°",
        ),
        ([(0.0, 0.0, 0.5 * number) for number in range(6)], r"one axis \(.*1\.00 of the flange\)"),
    ],
    ids=["a pose given twice", "poses too much alike", "turns about one axis alone"],
)
def test_poses_that_tell_no_centre_are_refused(turns: Turns, words: str) -> None:
    with pytest.raises(PoorGeometry, match=words):
        tool_centre(touching(TCP, turns))


def test_a_touch_that_missed_is_refused_and_counted() -> None:
    poses = touching(TCP, TURNS)
    poses[2] = Pose.from_matrix(poses[2].rotation, poses[2].position + np.array([0.0, 0.03, 0.0]))
    with pytest.raises(PoorGeometry, match=r"pose 3 .* mm; accepted: at most 5 mm"):
        tool_centre(poses)
    assert tool_centre(poses, greatest_residual=0.1).max_residual > 0.005


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan])
def test_a_residual_that_accepts_nothing_is_refused(bad: float) -> None:
    with pytest.raises(BadArgument, match="greatest_residual"):
        tool_centre(touching(TCP, TURNS), greatest_residual=bad)


def drawn(tool: Pose, along: tuple[float, float, float]) -> Pose:
    """The flange where POINT lies at `along` in the tool."""
    turn = Pose.from_rpy((0, 0, 0), (2.8, 0.2, 0.4))
    tip = turn.compose(tool)
    return Pose(POINT - tip.position - tip.rotation @ np.array(along), turn.quaternion)


TOOL = Pose.from_rpy(TCP, (0.3, 0.5, -0.4))


def test_three_points_show_the_whole_orientation() -> None:
    points = (0, 0, 0), (0, 0, 0.1), (0.08, 0, 0.02)
    found = tool_orientation(TCP, *(drawn(TOOL, point) for point in points))
    assert found.rotation_distance(TOOL) < 1e-12
    assert found.position.tolist() == TCP.tolist()


def test_two_points_show_z_and_keep_x_near_the_flanges() -> None:
    found = tool_orientation(TCP, drawn(TOOL, (0, 0, 0)), drawn(TOOL, (0, 0, 0.1)))
    assert found.rotation[:, 2] == pytest.approx(TOOL.rotation[:, 2], abs=1e-12)
    assert abs(found.rotation[1:, 0] @ np.cross([1, 0, 0], found.rotation[:, 2])[1:]) < 1e-12
    assert found.rotation[0, 0] > 0.7


def test_two_points_with_z_along_the_flanges_x_keep_x_near_its_y() -> None:
    sideways = Pose.from_rpy(TCP, (0.0, math.pi / 2, 0.0))
    found = tool_orientation(TCP, drawn(sideways, (0, 0, 0)), drawn(sideways, (0, 0, 0.1)))
    assert found.rotation == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), abs=1e-12)


@pytest.mark.parametrize(
    ("along_z", "along_x", "words"),
    [
        ((0, 0, 0.005), (0.1, 0, 0), ["along z", "5 mm", "at least 10 mm"]),
        ((0, 0, 0.1), (0.001, 0, 0), ["along x", "1 mm", "at least 10 mm"]),
        ((0, 0, 0.1), (0.01, 0, 0.1), ["angle", "5.71°", "at least 10°"]),
        ((0, 0, 0.1), (0, 0, -0.1), ["angle", "0°", "at least 10°"]),
    ],
)
def test_directions_that_show_nothing_are_refused_with_numbers(
    along_z: tuple[float, float, float], along_x: tuple[float, float, float], words: list[str]
) -> None:
    with pytest.raises(PoorGeometry) as refusal:
        tool_orientation(TCP, drawn(TOOL, (0, 0, 0)), drawn(TOOL, along_z), drawn(TOOL, along_x))
    assert [word for word in words if word not in str(refusal.value)] == []


def test_a_tcp_that_is_none_is_refused() -> None:
    pose = Pose.identity()
    with pytest.raises(NotFinite):
        tool_orientation((0.0, math.nan, 0.0), pose, pose)
    with pytest.raises(BadArgument, match="3 numbers"):
        tool_orientation((0.0, 0.0), pose, pose)
