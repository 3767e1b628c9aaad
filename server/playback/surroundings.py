"""What a program does beside moving: inputs, outputs, objects of the scene.

The desk asks it; whoever joins a cell with signals or a scene supplies one. `BareSurroundings` is
that of a cell with neither: it refuses by name, so that no program waits for what never comes.
"""

from __future__ import annotations

from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..programs.run_messages import (
    Aborted,
    AttachObject,
    DetachObject,
    Done,
    Event,
    InputValue,
    QueryInput,
    WriteOutput,
)
from ..refusal import Refusal
from ..world.offered_signals import Offer, OfferedSignals


class Surroundings(Protocol):
    """Signals and objects of one cell; each call returns a refusal where it cannot be."""

    @property
    def offered_signals(self) -> Offer:
        """Which signals there are."""

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Return the value of an input."""

    def set_output(self, signal: int, value: bool, now: int) -> list[Outgoing] | Refusal:
        """Give an output a value."""

    def attach(self, scene_object: str, now: int) -> list[Outgoing] | Refusal:
        """Let the tool carry an object."""

    def detach(self, scene_object: str, now: int) -> list[Outgoing] | Refusal:
        """Leave an object where it is."""


class BareSurroundings:
    """A cell without signals and without a scene."""

    @property
    def offered_signals(self) -> Offer:
        """None of either kind."""
        return OfferedSignals(inputs=0, outputs=0)

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Refuse: there is no such input."""
        return Refusal(VerdictCode.NO_SIGNAL, f"input {signal}: this cell has no inputs")

    def set_output(self, signal: int, value: bool, now: int) -> list[Outgoing] | Refusal:
        """Refuse: there is no such output."""
        return Refusal(VerdictCode.NO_SIGNAL, f"output {signal}: this cell has no outputs")

    def attach(self, scene_object: str, now: int) -> list[Outgoing] | Refusal:
        """Refuse: there is no such object."""
        return _no_object(scene_object)

    def detach(self, scene_object: str, now: int) -> list[Outgoing] | Refusal:
        """Refuse: there is no such object."""
        return _no_object(scene_object)


def answered(
    surroundings: Surroundings,
    action: QueryInput | WriteOutput | AttachObject | DetachObject,
    now: int,
) -> tuple[Event, list[Outgoing]]:
    """Do what a program asks for; return what its runner is to be told, and what follows."""
    done: bool | list[Outgoing] | Refusal
    match action:
        case QueryInput(_, signal):
            done = surroundings.input(signal, now)
        case WriteOutput(_, signal, value):
            done = surroundings.set_output(signal, value, now)
        case AttachObject(_, scene_object):
            done = surroundings.attach(scene_object, now)
        case DetachObject(_, scene_object):
            done = surroundings.detach(scene_object, now)
    if isinstance(done, Refusal):
        return Aborted(action.request, done), []
    if isinstance(done, bool):
        return InputValue(action.request, done), []
    return Done(action.request), done


def _no_object(name: str) -> Refusal:
    return Refusal(VerdictCode.UNKNOWN_OBJECT, f"object {name!r}: this cell has no scene")
