"""A scene on its way from the process that read it to one that has no time to unpickle it at once.

Owns that what is the same as in the scene before is the same object, so that whoever compares or
writes the two needs not look into it.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..pickled_pieces import A_PIECE, LongTuple
from ..steps import Stepwise
from .scene import Pair, Scene, SceneObject

# About how long it takes on an ordinary machine [µs].
_PER_OBJECT = 5.0  # to unpickle one
_PER_PAIR = 0.5  # likewise
_PER_COMPARED = 1.5  # object
_PER_JOINED = 0.6  # object
_PER_ALLOWED = 0.4  # pair


@dataclass(frozen=True, slots=True)
class SceneInTransfer:
    """A sound scene as it travels.

    Attributes:
        objects: as of the scene.
        allowed: likewise.
        revision: likewise.
    """

    objects: LongTuple[SceneObject]
    allowed: LongTuple[Pair]
    revision: int

    @classmethod
    def of(cls, scene: Scene) -> SceneInTransfer:
        """Return a scene, ready to travel."""
        objects = LongTuple(scene.objects, _PER_OBJECT)
        return cls(objects, LongTuple(tuple(scene.allowed), _PER_PAIR), scene.revision)

    def arrived(self, before: Scene) -> Stepwise[Scene]:
        """Return the scene, in steps.

        Args:
            before: the scene whose objects are kept where they are the same.
        """
        yield _PER_JOINED * len(before.objects)
        known = {each.name: each for each in before.objects}
        arrived = yield from self.objects.steps()
        objects: list[SceneObject] = []
        for first in range(0, len(arrived), A_PIECE):
            some = arrived[first : first + A_PIECE]
            yield _PER_COMPARED * len(some)
            for each in some:
                same = known.get(each.name)
                objects.append(same if same is not None and same == each else each)
        allowed = yield from self.allowed.steps()
        yield _PER_JOINED * len(objects) + _PER_ALLOWED * len(allowed)
        return Scene(tuple(objects), frozenset(allowed), self.revision)
