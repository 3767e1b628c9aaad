import pickle

import pytest

from openpendant.motion import errors
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pickled_pieces import A_PIECE, LongTuple, PickledPieces, unpickled
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import MAX_ALLOWED, MAX_OBJECTS, Scene, SceneObject, Sphere
from openpendant.motion.scene.scene_transfer import SceneInTransfer
from openpendant.motion.steps import Stepwise, at_once


def balls(count: int) -> tuple[SceneObject, ...]:
    return tuple(SceneObject(f"ball {number}", Sphere(0.1)) for number in range(count))


def pieces(values: tuple[str, ...], before: PickledPieces[str] | None) -> PickledPieces[str]:
    steps = PickledPieces.steps(values, before)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            made = end.value
            assert isinstance(made, PickledPieces)
            return made


def test_a_piece_that_stays_is_not_pickled_again() -> None:
    values = tuple(f"value {number}" for number in range(3 * A_PIECE))
    before = pieces(values, None)
    after = pieces((*values[: 2 * A_PIECE], "other", "last"), before)
    assert unpickled(after.pickles) == (*values[: 2 * A_PIECE], "other", "last")
    assert all(a is b for a, b in zip(before.pickles[:2], after.pickles[:2], strict=True))
    assert before.pickles[2] != after.pickles[2]


@pytest.mark.parametrize("count", [0, 1, A_PIECE, A_PIECE + 1, 200])
def test_a_scene_is_the_same_behind_a_pipe(count: int) -> None:
    scene = Scene(balls(count), frozenset({("ball 0", "hand")} if count else ()), 7)
    assert pickle.loads(pickle.dumps(scene)) == scene
    other = scene.add(SceneObject("new", Sphere(0.2)))
    for _ in other.pickle_steps(scene):
        pass
    assert pickle.loads(pickle.dumps(other)) == other


def test_a_tree_of_frames_is_the_same_behind_a_pipe() -> None:
    tree = FrameTree()
    for number in range(100):
        pose = Pose.from_values((0.1 * number, 0.2, 0.3), (0.1, 0.2, 0.3, 0.9))
        tree = tree.add(f"frame {number}", pose)
    tree = tree.add_tool("hand", Pose.identity()).select_tool("hand")
    again = pickle.loads(pickle.dumps(tree))
    assert list(again.frames) == list(tree.frames)
    assert again.selected_tool == "hand"
    assert repr(again) == repr(tree)


def test_a_scene_has_no_more_objects_and_pairs_than_a_file_may_have() -> None:
    full = Scene(balls(MAX_OBJECTS))
    with pytest.raises(errors.BadArgument, match="at most 1,000"):
        full.add(SceneObject("one more", Sphere(0.1)))
    pairs = frozenset(("ball 0", f"link {number}") for number in range(MAX_ALLOWED))
    allowed = Scene(balls(1), pairs)
    with pytest.raises(errors.BadArgument, match="at most 2,000"):
        allowed.allow("ball 0", "one more")


def efforts(steps: Stepwise[object]) -> list[float]:
    return list(steps)


@pytest.mark.parametrize("count", [0, 1, A_PIECE, A_PIECE + 1, 200])
def test_a_long_tuple_arrives_in_the_steps_that_it_has_where_it_was_made(count: int) -> None:
    values = balls(count)
    here = LongTuple(values, 2.0)
    there = pickle.loads(pickle.dumps(here))
    again = pickle.loads(pickle.dumps(there))
    for each in (here, there, again):
        assert at_once(each.steps()) == values
        assert efforts(each.steps()) == efforts(here.steps())
        assert len(each) == count
    assert sum(efforts(here.steps())) == 2.0 * count


class Loud:
    unpickled = 0

    def __init__(self, number: int) -> None:
        self.number = number
        Loud.unpickled += 1

    def __reduce__(self) -> tuple[type, tuple[int]]:
        return Loud, (self.number,)


def test_nothing_of_a_long_tuple_is_unpickled_before_its_step() -> None:
    there = pickle.loads(pickle.dumps(LongTuple(tuple(map(Loud, range(3 * A_PIECE))), 1.0)))
    Loud.unpickled = 0
    for number, _ in enumerate(there.steps()):
        assert Loud.unpickled == number * A_PIECE


def test_a_pose_arrives_with_every_bit_and_cannot_be_written_to() -> None:
    pose = Pose.from_values((0.1, -0.0, 1e-300), (0.1, 0.2, -0.3, 0.9))
    again = pickle.loads(pickle.dumps(pose))
    for name in ("position", "quaternion"):
        assert getattr(again, name).tobytes() == getattr(pose, name).tobytes()
        assert not getattr(again, name).flags.writeable
    assert repr(again) == repr(pose)


def test_what_a_scene_has_in_common_with_the_one_before_is_the_same_object() -> None:
    before = Scene(balls(150), frozenset({("ball 0", "hand")}), 3)
    moved = before.move("ball 7", Pose.from_values((1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    sent = moved.add(SceneObject("new", Sphere(0.2)))
    transfer = pickle.loads(pickle.dumps(SceneInTransfer.of(sent)))
    arrived = at_once(transfer.arrived(before))
    assert arrived == sent
    same = [one is other for one, other in zip(arrived.objects, before.objects, strict=False)]
    assert [number for number, is_same in enumerate(same) if not is_same] == [7]
