import math

import numpy as np
import pytest
from hypothesis import given
from rigs.motion.stewart_poses import (
    PLATFORM,
    platform_robot,
    pose_of_shares,
    poses_inside,
    random_poses,
)

from openpendant.motion.errors import PlatformLimit
from openpendant.motion.kinematics.stewart.platform import StewartKinematics
from openpendant.motion.kinematics.stewart.workspace import PlatformRule
from openpendant.motion.pose import Pose

WORKSPACE = PLATFORM.workspace
HOME = PLATFORM.legs.home


def test_home_uses_nothing_of_the_workspace() -> None:
    assert WORKSPACE.usage(HOME) == 0.0
    assert WORKSPACE.coordinates(HOME).tolist() == [0.0] * 6


@pytest.mark.parametrize("coordinate", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_each_coordinate_alone_goes_to_its_bound_and_no_further(
    coordinate: int, sign: float
) -> None:
    share = sign * np.eye(6)[coordinate]
    lengths = WORKSPACE.check(pose_of_shares(share))
    assert ((lengths >= PLATFORM.lower) & (lengths <= PLATFORM.upper)).all()
    with pytest.raises(PlatformLimit) as refusal:
        WORKSPACE.check(pose_of_shares(1.001 * share))
    error = refusal.value
    assert (error.rule, error.limit) == (PlatformRule.WORKSPACE, 1.0)
    assert error.value == pytest.approx(1.001)
    assert error.joint == ""
    assert error.index == -1


def test_together_the_coordinates_share_the_bounds() -> None:
    third = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 1.0]) / 3.0
    WORKSPACE.check(pose_of_shares(third))
    with pytest.raises(PlatformLimit, match=r"workspace sum limit is 1, the pose needs 1\.2"):
        WORKSPACE.check(pose_of_shares(1.2 * third))


@given(poses_inside)
def test_inside_the_workspace_every_leg_is_in_its_stroke_and_its_cones(pose: Pose) -> None:
    assert WORKSPACE.check(pose) == pytest.approx(PLATFORM.legs.lengths(pose), abs=1e-15)
    assert max(swing.max() for swing in WORKSPACE.swings(pose)) < WORKSPACE.cone


@given(poses_inside)
def test_coordinates_are_read_back(pose: Pose) -> None:
    again = WORKSPACE.pose(WORKSPACE.coordinates(pose))
    assert again.position_distance(pose) < 1e-15
    assert again.rotation_distance(pose) < 1e-12


def test_a_leg_too_short_or_too_long_is_named_with_its_length() -> None:
    for limits, shares, length in (
        ({"max_length": 0.28}, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 0.28),
        ({"min_length": 0.25}, [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], 0.25),
    ):
        workspace = StewartKinematics(platform_robot(leg=limits)).workspace
        with pytest.raises(PlatformLimit) as refusal:
            workspace.check(pose_of_shares(shares), fraction=0.5)
        error = refusal.value
        assert error.rule == PlatformRule.STROKE
        assert error.joint == f"leg_{error.index + 1}"
        assert (error.limit, error.unit, error.fraction) == (length, "m", 0.5)
        needed = PLATFORM.legs.lengths(pose_of_shares(shares))
        assert error.value == pytest.approx(needed[error.index])
        assert "50.0% of the path" in str(error)


@pytest.mark.parametrize(
    ("shares", "rule"),
    [
        ([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], PlatformRule.BASE_CONE),
        ([0.0, 0.0, 0.0, 0.9, 0.0, 0.0], PlatformRule.PLATFORM_CONE),
    ],
)
def test_a_joint_that_would_swing_out_of_its_cone_is_named(
    shares: list[float], rule: PlatformRule
) -> None:
    pose = pose_of_shares(shares)
    base, platform = WORKSPACE.swings(pose)
    if rule is PlatformRule.BASE_CONE:
        swings, cone = base, base.max() - 0.01
    else:
        swings, cone = platform, (base.max() + platform.max()) / 2.0
    assert cone < swings.max()
    narrow = StewartKinematics(platform_robot(leg={"anchor_cone_rad": float(cone)})).workspace
    with pytest.raises(PlatformLimit) as refusal:
        narrow.check(pose)
    error = refusal.value
    assert error.rule == rule
    assert error.unit == "rad"
    assert error.value == pytest.approx(swings.max())
    assert error.joint == f"leg_{error.index + 1}"


def test_a_swing_is_the_angle_between_the_leg_now_and_at_home() -> None:
    up = pose_of_shares([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    then, now = (PLATFORM.legs.vectors(p.rotation, p.position)[0] for p in (HOME, up))
    cosine = then @ now / np.linalg.norm(then) / np.linalg.norm(now)
    base, platform = WORKSPACE.swings(up)
    assert base[0] == pytest.approx(math.acos(cosine))
    assert platform == pytest.approx(base)


def test_turning_the_platform_alone_swings_the_joints_on_it_farther() -> None:
    base, platform = WORKSPACE.swings(pose_of_shares([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]))
    assert platform.max() > base.max()


def test_the_workspace_stays_away_from_singularity() -> None:
    holdings = [WORKSPACE.holding(pose) for pose in random_poses(300)]
    assert min(holding.least for holding in holdings) > 0.5
    assert max(holding.condition for holding in holdings) < 5.0


def test_turned_by_a_quarter_the_platform_gives_way() -> None:
    # The classic singularity of such platforms: yaw of 90 degrees (Fichter 1986).
    quarter = Pose.from_rpy(HOME.position, (0.0, 0.0, math.pi / 2.0))
    holding = WORKSPACE.holding(quarter)
    assert holding.least < 1e-6
    assert holding.condition > 1e6
    jacobian = PLATFORM.legs.jacobian(quarter)
    twist = holding.loosest / [1.0, 1.0, 1.0, 0.12, 0.12, 0.12]
    assert jacobian @ twist == pytest.approx([0.0] * 6, abs=1e-6)
