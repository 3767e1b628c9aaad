"""The fullest scene that a robot may have, the most frames, and a cell with both."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import MAX_ALLOWED, Box, Scene, SceneObject
from openpendant.server.refusal import Refusal
from openpendant.server.shell.robot_kinematics import MOST_PAIRS
from openpendant.server.store.documents import DocumentKind

SHAPES = 8
"""Shapes of a UR5 that move."""

LINKS = tuple(link for link in robot().collision if link != "base_link")

CHECKED = MOST_PAIRS // SHAPES
UNCHECKED = MAX_ALLOWED // len(LINKS)
"""Objects that no link is checked against, as many as pairs may be allowed for."""

FRAMES = 960


def box(number: int, *, z: float = 0.0) -> SceneObject:
    place = (0.6 + 0.1 * (number % 20), 0.1 * (number // 20), z)
    turn = (0.5, 0.5, 0.5, 0.5) if number % 2 else (0.6, 0.0, 0.8, 0.0)
    return SceneObject(f"box {number}", Box((0.03, 0.02, 0.01 + 1e-6 * number)), place, turn)


def full(*, room: int = 0, z: float = 0.0) -> Scene:
    """Return the fullest scene of a UR5, but for room for some objects that are checked."""
    count = CHECKED - room + UNCHECKED
    allowed = {
        (min(link, f"box {number}"), max(link, f"box {number}"))
        for number in range(CHECKED - room, count)
        for link in LINKS
    }
    return Scene(tuple(box(number, z=z) for number in range(count)), frozenset(allowed))


def chain() -> FrameTree:
    """Return user frames of which each hangs from the one before."""
    tree, parent = FrameTree(), "base"
    for number in range(FRAMES):
        tree = tree.add(f"frame {number}", Pose.from_values((0.1, 0.2, 0.3), (0, 0, 0, 1)), parent)
        parent = f"frame {number}"
    return tree


class FullCell(SurroundedCell):
    """A cell in the fullest scene and with the most frames."""

    def __init__(self, folder: Path, *, room: int = 1) -> None:
        super().__init__(folder, reads_apart=True)
        self.report()
        self.put(full(room=room))
        self.frames(lambda _: chain())

    def put(self, scene: Scene) -> FullCell:
        """Replace the scene."""
        world = self.around.world
        revision = world.revisions[DocumentKind.SCENE]
        self._change(
            lambda told: world.change_scene(lambda _: scene, revision, "ann", self.now, told)
        )
        return self

    def frames(self, change: Callable[[FrameTree], FrameTree]) -> None:
        world, kind = self.around.world, DocumentKind.FRAMES
        revision = world.revisions[kind]
        self._change(
            lambda told: world.change_frames(kind, change, revision, "ann", self.now, told)
        )

    def _change(self, event: Callable[[Any], Any]) -> None:
        told: list[int | Refusal] = []

        def take(revision: int | Refusal, now: int) -> list[Any]:
            told.append(revision)
            return []

        self.turns = []
        self.turn(lambda: event(take))
        self.until(lambda: bool(told))
        assert isinstance(told[0], int), told

    def with_box_at_the_flange(self) -> FullCell:
        """Have a scene in which there is room to carry box 0, which is where the flange is."""
        return self.put(full(room=70).move("box 0", self.mathematics.flange(robot().home_position)))

    def rearrange(self, change: Callable[..., Any], name: str) -> FullCell:
        """Take an object or put it down, as a program does."""
        self.report()
        told: list[Refusal | None] = []
        self.turns = []
        self.turn(lambda: change(name, self.now, told.append))
        self.until(lambda: bool(told))
        assert told == [None]
        return self
