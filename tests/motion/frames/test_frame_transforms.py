import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.motion.errors import BadArgument, NotFinite
from openpendant.motion.frames.frame_tree import (
    BASE,
    FrameTree,
    transform_point,
    transform_twist,
    transform_vector,
)
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.pose import Array, Pose

coordinates = st.floats(-2.0, 2.0)
vectors = st.tuples(coordinates, coordinates, coordinates)
twists = st.tuples(*[coordinates] * 6)
poses = st.builds(
    Pose.from_rpy, vectors, st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3))
)

Rule = Callable[[Pose, tuple[float, ...]], Array]


@given(poses, vectors)
def test_a_point_shifts_and_turns_a_vector_only_turns(
    pose: Pose, values: tuple[float, ...]
) -> None:
    matrix = pose.to_matrix()
    np.testing.assert_allclose(
        transform_point(pose, values), (matrix @ [*values, 1.0])[:3], rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(
        transform_vector(pose, values), (matrix @ [*values, 0.0])[:3], rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("rule", [transform_point, transform_vector])
@given(first=poses, second=poses, values=vectors)
def test_two_transforms_in_turn_are_their_product(
    rule: Rule, first: Pose, second: Pose, values: tuple[float, ...]
) -> None:
    once = rule(first.compose(second), values)
    np.testing.assert_allclose(once, rule(first, tuple(rule(second, values))), rtol=0, atol=1e-12)


@given(poses, poses, twists)
def test_a_twist_goes_by_the_product_too_and_comes_back(
    first: Pose, second: Pose, values: tuple[float, ...]
) -> None:
    once = transform_twist(first.compose(second), values)
    np.testing.assert_allclose(
        once, transform_twist(first, transform_twist(second, values)), rtol=0, atol=1e-11
    )
    back = transform_twist(first.inverse(), transform_twist(first, values))
    np.testing.assert_allclose(back, values, rtol=0, atol=1e-11)


@given(poses, twists, vectors)
def test_a_twist_tells_the_same_velocity_of_every_point_in_both_frames(
    pose: Pose, values: tuple[float, ...], point: tuple[float, ...]
) -> None:
    twist = np.array(values)
    here = twist[:3] + np.cross(twist[3:], point)
    moved = transform_twist(pose, twist)
    there = moved[:3] + np.cross(moved[3:], transform_point(pose, point))
    np.testing.assert_allclose(there, transform_vector(pose, here), rtol=0, atol=1e-11)


def test_a_twist_is_what_a_small_motion_does() -> None:
    pose = Pose.from_rpy((0.3, -0.2, 0.5), (0.4, 0.1, -0.7))
    twist = np.array([0.1, 0.2, -0.3, 0.5, -0.4, 0.2])
    step = 1e-6
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = rotation_of_vector(step * twist[3:]), step * twist[:3]
    matrix = pose.to_matrix()
    seen = (matrix @ motion @ np.linalg.inv(matrix) - np.eye(4)) / step
    found = [*seen[:3, 3], seen[2, 1], seen[0, 2], seen[1, 0]]
    assert transform_twist(pose, twist) == pytest.approx(found, abs=1e-5)


def test_a_point_of_the_table_is_found_in_the_bin() -> None:
    quarter = Pose.from_rpy((1.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2))
    tree = FrameTree().add("table", quarter).add("bin", Pose.from_rpy((0, 0, 0.5), (0, 0, 0)))
    in_bin = transform_point(tree.transform("table", "bin"), (0.2, 0.0, 0.0))
    assert in_bin == pytest.approx([1.0, 0.2, -0.5])
    assert transform_point(tree.transform("table", BASE), (0.2, 0.0, 0.0)) == pytest.approx(
        [1.0, 0.2, 0.0]
    )


@pytest.mark.parametrize("rule", [transform_point, transform_vector, transform_twist])
def test_what_is_no_vector_is_refused(rule: Rule) -> None:
    count = 6 if rule is transform_twist else 3
    with pytest.raises(BadArgument, match=f"{count} numbers"):
        rule(Pose.identity(), (0.0,) * (count - 1))
    with pytest.raises(NotFinite):
        rule(Pose.identity(), (0.0,) * (count - 1) + (math.nan,))
