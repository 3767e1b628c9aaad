"""Turns of what is built in steps: how much of the work is done in each turn of the event loop.

Steps are counted by their effort, not timed, so that a journal that is run again has the same
turns.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any, TypeVar

from openpendant.motion.errors import MotionError
from openpendant.motion.scene.scene import Scene
from openpendant.motion.steps import Stepwise

from ..events.pending import Steps, Turn
from ..refusal import Refusal, refusal_of

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import BuildStep

_Made = TypeVar("_Made")

FIRST_EFFORT = 1_600.0
"""Most that is built in the turn of the request [µs], so that a few objects take no other."""

TURN_EFFORT = 900.0
"""Most that is built in each other turn [µs]; a longer step has one for itself.

By the effort that the steps announce, which is counted: a rerun of a journal makes the same turns.
As it is an estimate, both are well below the 2 ms that a turn may take.
"""


class Turns:
    """Turns of one build: how much of its work is done in each.

    Attributes:
        spent: effort of the work done in this turn [µs].
    """

    def __init__(self, spent: float = 0.0, most: float = FIRST_EFFORT) -> None:
        """Begin a turn.

        Args:
            spent: effort of what was done in it before [µs].
            most: effort that it may take [µs]; each later one `TURN_EFFORT`.
        """
        self.spent, self._most = spent, most

    def spend(self, effort: float) -> Steps[None]:
        """Wait for the next tick where a step would make this turn too long."""
        if self.spent and self.spent + effort > self._most:
            yield Turn.NEXT
            self.spent, self._most = 0.0, TURN_EFFORT
        self.spent += effort

    def make(self, steps: Stepwise[_Made]) -> Steps[_Made]:
        """Take steps; return what they return."""
        while True:
            try:
                effort = next(steps)
            except StopIteration as end:
                made: _Made = end.value
                return made
            yield from self.spend(effort)

    def find(self, steps: Stepwise[_Made]) -> Steps[_Made | Refusal]:
        """Take steps as `make` does; return why it cannot be made where they say so."""
        try:
            return (yield from self.make(steps))
        except MotionError as error:
            return refusal_of(error)

    def take(
        self, steps: Generator[BuildStep, None, Any], *, until_fits: bool = False
    ) -> Steps[Any]:
        """Take steps, all or until it is known that the scene fits; return what they return."""
        while True:
            try:
                step = next(steps)
            except StopIteration as end:
                return end.value
            yield from self.spend(step.effort)
            if step.fits and until_fits:
                return None


def until_it_fits(
    scene: Scene, before: Scene, steps: Generator[BuildStep, None, Any], turns: Turns
) -> Steps[Refusal | None]:
    """Find out whether a scene fits, and make it ready for planning; return why it does not."""
    try:
        yield from turns.take(steps, until_fits=True)
    except MotionError as error:
        return refusal_of(error)
    for effort in scene.pickle_steps(before):
        yield from turns.spend(effort)
    return None


def dropped(built: Any) -> Steps[None]:
    """Drop what is no longer in force, a part in each turn: to be freed takes as long as to build.

    A jog that comes to rest with it keeps it that long.
    """
    parts = built.parts_to_drop()
    while parts:
        yield Turn.LAST
        del parts[-1]
