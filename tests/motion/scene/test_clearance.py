"""What proves a way free, alone: bodies at known distances, and ways that just pass them or not.

A way is free where nothing comes nearer than 1 mm on it. Then whole robots, among bodies.
"""

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.bodies_on_rails import BodiesOnRails, always, standing_at
from rigs.motion.loaded_robots import arm

from openpendant.motion.planning.path_check import first_contact
from openpendant.motion.pose import Array
from openpendant.motion.scene.clearance import MARGIN, MOST, ClearPath
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Cylinder, Mesh, Scene, SceneObject, Sphere

START = (0.0, 0.0)


def is_sure(bodies: BodiesOnRails, goal: tuple[float, float], start: tuple[float, float]) -> bool:
    return ClearPath(bodies.model).is_sure(start, goal)


def test_bodies_are_kept_a_millimetre_apart() -> None:
    assert MARGIN == 0.001


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("end", "sure"), [(4.9985, True), (4.9995, False), (5.5, False)])
def test_what_comes_nearer_than_the_margin_is_unproved(side: float, end: float, sure: bool) -> None:
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


# One with coupled joints, one on a rail, one of four joints and two plain arms of six.
ROBOTS = ["abb_irb2400", "rail_kr5_arc", "mitsubishi_rh6frh5520", "ur5", "puma560"]
HELD = SceneObject("rod", Cylinder(0.02, 0.3), (0.0, 0.0, 0.2))
AROUND = (
    SceneObject("table", Box((3.0, 3.0, 0.1)), (0.0, 0.0, -0.4)),
    SceneObject("post", Cylinder(0.05, 1.0), (0.7, 0.5, 0.5)),
    SceneObject("ball", Sphere(0.15), (-0.6, 0.3, 0.6)),
)


def model_of(robot: str, scene: str) -> CollisionModel:
    kinematics = arm(robot)
    objects: tuple[SceneObject, ...] = {"nothing": (), "around": AROUND, "held": (HELD,)}[scene]
    if scene == "held":
        tool = kinematics.robot.tool_link
        return CollisionModel(kinematics, Scene((HELD.at(HELD.pose, "base", tool),)))
    return CollisionModel(kinematics, Scene(objects))


def moves_of(model: CollisionModel, random: np.random.Generator, count: int) -> list[Array]:
    """Return (2, n) straight moves of all lengths; some follow one another, some go back."""
    kinematics = model.kinematics
    moves: list[Array] = []
    at = np.array(kinematics.robot.home_position)
    for _ in range(count):
        way = random.normal(size=kinematics.dof)
        way *= random.choice([0.02, 0.2, 0.7, 2.0]) / np.abs(way).max()
        goal = np.clip(at + way, kinematics.lower, kinematics.upper)
        moves.append(np.array((at, goal)))
        at = (at, goal, np.array(kinematics.robot.home_position))[random.integers(3)]
    return moves


@pytest.mark.parametrize("count", counts(15, 400))
@pytest.mark.parametrize("scene", ["nothing", "around", "held"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_way_surely_free_is_free_to_the_full_check(robot: str, scene: str, count: int) -> None:
    model = model_of(robot, scene)
    proof = ClearPath(model)
    for move in moves_of(model, np.random.default_rng(5), count):
        if proof.is_sure(*move):
            assert first_contact(model, move) is None


@pytest.mark.parametrize("count", counts(8, 250))
@pytest.mark.parametrize("robot", ROBOTS)
def test_bodies_keep_the_margin_all_along_a_way_that_is_surely_free(robot: str, count: int) -> None:
    model = model_of(robot, "around")
    proof = ClearPath(model)
    for move in moves_of(model, np.random.default_rng(6), count):
        if proof.is_sure(*move):
            shares = np.linspace(0.0, 1.0, 101)[:, np.newaxis]
            for place in move[0] + shares * (move[1] - move[0]):
                assert model.clearances(place).min() > MARGIN - 1e-6


@pytest.mark.parametrize("robot", ROBOTS)
def test_most_short_moves_among_free_ones_are_proved(robot: str) -> None:
    model = model_of(robot, "nothing")
    proof = ClearPath(model)
    random = np.random.default_rng(7)
    proved = free = 0
    home = np.array(model.kinematics.robot.home_position)
    for _ in range(40):
        moved = home + random.uniform(-0.3, 0.3, len(home))
        goal = np.clip(moved, model.kinematics.lower, model.kinematics.upper)
        if first_contact(model, [home, goal]) is None:
            free += 1
            proved += proof.is_sure(home, goal)
    assert proved >= 0.9 * free > 0


class Counted(CollisionModel):
    """Counts looks and distances."""

    looks = 0
    distances = 0

    def clearances_of(self, pairs: object, joint_position: Array) -> list[float]:
        found = super().clearances_of(pairs, joint_position)  # type: ignore[arg-type]  # as given
        self.looks += 1
        self.distances += len(found)
        return found


def counted(*objects: SceneObject) -> Counted:
    return Counted(arm("ur5"), Scene(objects))


def test_no_more_distances_are_computed_than_are_allowed() -> None:
    model = counted(*AROUND)
    proof = ClearPath(model)
    for move in moves_of(model, np.random.default_rng(8), 60):
        model.looks = model.distances = 0
        proof.is_sure(*move)
        assert model.distances + 8 * model.looks <= MOST


def test_a_scene_of_too_many_objects_is_not_looked_at() -> None:
    places = [(3.0 + number, 0.0, 0.0) for number in range(100)]
    balls = [SceneObject(f"ball at {place[0]}", Sphere(0.01), place) for place in places]
    model = counted(*balls)
    home = model.kinematics.robot.home_position
    assert not ClearPath(model).is_sure(home, (home[0] + 0.01, *home[1:]))
    assert model.looks == 0


def test_a_way_past_an_object_that_is_near_is_not_proved_nor_one_from_within() -> None:
    model = counted()
    home = np.array(model.kinematics.robot.home_position)
    tool = model.kinematics.forward(home).position
    x, y, z = (tool + np.array((0.0, 0.0, 0.1))).tolist()
    inside = CollisionModel(model.kinematics, Scene((SceneObject("ball", Sphere(0.3), (x, y, z)),)))
    goal = home + np.eye(6)[0] * 0.3
    assert ClearPath(model).is_sure(home, goal)
    assert not ClearPath(inside).is_sure(home, goal)


def test_a_position_that_is_not_a_number_is_not_proved() -> None:
    model = counted(*AROUND)
    proof = ClearPath(model)
    home = model.kinematics.robot.home_position
    assert proof.is_sure(home, home)
    assert not proof.is_sure(home, (float("nan"), *home[1:]))
    assert not ClearPath(model).is_sure((float("nan"), *home[1:]), home)


def test_nothing_is_sure_of_a_mesh(tmp_path_factory: pytest.TempPathFactory) -> None:
    file = tmp_path_factory.mktemp("meshes") / "corner.stl"
    file.write_text(
        "solid corner\nfacet normal 0 0 1\nouter loop\n"
        "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid corner\n"
    )
    model = counted(SceneObject("corner", Mesh(str(file)), (9.0, 0.0, 0.0)))
    home = model.kinematics.robot.home_position
    assert not ClearPath(model).is_sure(home, home)
    assert model.looks == 0
