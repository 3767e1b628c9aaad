"""What proves a way free, alone: bodies at known distances, and ways that just pass them or not.

A way is free where nothing comes nearer than 1 mm on it.
"""

import pytest
from rigs.motion.bodies_on_rails import BodiesOnRails, always, standing_at

from openpendant.motion.scene.clearance import MARGIN, ClearPath

START = (0.0, 0.0)


def is_sure(bodies: BodiesOnRails, goal: tuple[float, float], start: tuple[float, float]) -> bool:
    return ClearPath(bodies.model).is_sure(start, goal)


def test_bodies_are_kept_a_millimetre_apart() -> None:
    assert MARGIN == 0.001


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("end", "sure"), [(4.9985, True), (4.9995, False), (5.5, False)])
def test_what_comes_nearer_than_the_margin_is_not_proved(
    side: float, end: float, sure: bool
) -> None:
    """A body 5 m ahead, of which half of the way stays clear."""
    assert is_sure(BodiesOnRails(standing_at(side * 5.0)), (side * end, 0.0), START) is sure


def test_a_way_that_one_look_proves_takes_one_look() -> None:
    bodies = BodiesOnRails(standing_at(5.0))
    assert is_sure(bodies, (4.9985, 0.0), START)
    assert bodies.looked_at == [[0]]


@pytest.mark.parametrize("place", [1.3, 2.2, 5.7])
def test_a_body_in_either_half_of_the_way_is_found(place: float) -> None:
    """Far enough from the middle of it, at 3.5 m, to be missed by one look."""
    assert not is_sure(BodiesOnRails(standing_at(place)), (6.0, 0.0), (1.0, 0.0))


def test_both_joints_together_lead_into_a_body() -> None:
    bodies = BodiesOnRails(standing_at(5.0))
    assert is_sure(bodies, (4.0, 1.99), START)
    assert not is_sure(bodies, (4.0, 2.01), START)


def test_a_joint_that_moves_another_of_the_model_farther_than_itself_counts_so() -> None:
    assert is_sure(BodiesOnRails(standing_at(5.0), gain=2.0), (2.49, 0.0), START)
    assert not is_sure(BodiesOnRails(standing_at(5.0), gain=2.0), (2.6, 0.0), START)


@pytest.mark.parametrize("order", [(3.0, 50.0), (50.0, 3.0)])
def test_every_pair_is_looked_at(order: tuple[float, float]) -> None:
    assert not is_sure(BodiesOnRails(*map(standing_at, order)), (4.0, 0.0), START)


@pytest.mark.parametrize("place", [0, 1])
def test_every_pair_that_one_look_does_not_prove_is_looked_at_again(place: int) -> None:
    distances = [always(1.5), always(1.5)]
    distances[place] = standing_at(3.0)
    assert not is_sure(BodiesOnRails(*distances), (4.0, 0.0), START)


def test_pairs_that_one_look_proved_are_not_looked_at_again() -> None:
    bodies = BodiesOnRails(standing_at(50.0), always(0.4))
    assert is_sure(bodies, (1.0, 0.0), START)
    assert bodies.looked_at == [[0, 1], [1], [1]]


class TestTheLastLook:
    """Made at 0, of a body 1.001 m ahead: what goes no farther than 1 m from there is proved."""

    @pytest.fixture
    def bodies(self) -> BodiesOnRails:
        return BodiesOnRails(standing_at(50.0), standing_at(1.001))

    @pytest.fixture
    def proof(self, bodies: BodiesOnRails) -> ClearPath:
        proof = ClearPath(bodies.model)
        assert proof.is_sure(START, START)
        bodies.looked_at.clear()
        return proof

    @pytest.mark.parametrize(
        ("start", "goal"),
        [
            ((0.0, 0.0), (0.999, 0.0)),
            ((-0.999, 0.0), (0.999, 0.0)),
            ((0.5, 0.0), (0.5, 0.99)),
            ((0.0, 0.0), (0.0, -1.99)),
        ],
    )
    def test_proves_what_is_near_without_another(
        self,
        bodies: BodiesOnRails,
        proof: ClearPath,
        start: tuple[float, float],
        goal: tuple[float, float],
    ) -> None:
        assert proof.is_sure(start, goal)
        assert bodies.looked_at == []

    @pytest.mark.parametrize(
        ("start", "goal"),
        [
            ((0.0, 0.0), (1.0005, 0.0)),
            ((-3.0, 0.0), (3.0, 0.0)),
            ((1.0, 0.0), (1.1, 0.0)),
            ((0.6, 0.0), (0.6, 0.9)),
        ],
    )
    def test_proves_nothing_that_comes_to_the_body(
        self, proof: ClearPath, start: tuple[float, float], goal: tuple[float, float]
    ) -> None:
        assert not proof.is_sure(start, goal)

    def test_is_kept_from_where_it_was_made(self) -> None:
        bodies = BodiesOnRails(standing_at(1.001))
        proof = ClearPath(bodies.model)
        assert proof.is_sure((-1.0, 0.0), (-0.5, 0.0))
        assert not proof.is_sure((0.0, 0.0), (1.1, 0.0))
        assert proof.is_sure((-0.5, 0.0), (-0.9, 0.0))
        assert len(bodies.looked_at[0]) == 1

    def test_of_a_model_whose_joints_go_farther_than_the_robots_reaches_less_far(self) -> None:
        proof = ClearPath(BodiesOnRails(standing_at(1.001), gain=2.0).model)
        assert proof.is_sure(START, START)
        assert not proof.is_sure(START, (0.6, 0.0))
        assert proof.is_sure(START, (0.499, 0.0))


def test_where_nothing_can_touch_all_is_sure() -> None:
    assert is_sure(BodiesOnRails(), (9.0, 9.0), START)
