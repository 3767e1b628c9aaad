import pickle

import pytest

from openpendant.motion import errors
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pickled_pieces import A_PIECE, PickledPieces, unpickled
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import MAX_ALLOWED, MAX_OBJECTS, Scene, SceneObject, Sphere


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
