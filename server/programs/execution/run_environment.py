"""Run environment of programs: inputs, outputs and objects of the scene.

The executor uses it; a cell with signals or a scene supplies one. `BareEnvironment` is that of a
cell with neither: it refuses by name, so that no program waits for a signal that does not exist.
"""

from __future__ import annotations

from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...refusal import Refusal
from ..interpreter.run_events import (
    AttachToTool,
    DetachFromTool,
    Event,
    InputValue,
    QueryInput,
    RequestAborted,
    RequestDone,
    WriteOutput,
)
from ..interpreter.signal_offers import Offer, OfferedSignals


class RunEnvironment(Protocol):
    """Signals and objects of one cell; each call returns a refusal if it is not possible."""

    @property
    def offered_signals(self) -> Offer:
        """Signals that there are."""

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Return the value of an input."""

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect] | Refusal:
        """Set an output."""

    def attach(self, scene_object: str, now: int) -> list[Effect] | Refusal:
        """Attach an object to the tool."""

    def detach(self, scene_object: str, now: int) -> list[Effect] | Refusal:
        """Detach an object where it is."""


class BareEnvironment:
    """Environment of a cell without signals and without a scene."""

    @property
    def offered_signals(self) -> Offer:
        """None of either kind."""
        return OfferedSignals(inputs=0, outputs=0)

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Refuse: there is no such input."""
        return Refusal(VerdictCode.NO_SIGNAL, f"input {signal}: this cell has no inputs")

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect] | Refusal:
        """Refuse: there is no such output."""
        return Refusal(VerdictCode.NO_SIGNAL, f"output {signal}: this cell has no outputs")

    def attach(self, scene_object: str, now: int) -> list[Effect] | Refusal:
        """Refuse: there is no such object."""
        return _no_object(scene_object)

    def detach(self, scene_object: str, now: int) -> list[Effect] | Refusal:
        """Refuse: there is no such object."""
        return _no_object(scene_object)


def answered(
    environment: RunEnvironment,
    action: QueryInput | WriteOutput | AttachToTool | DetachFromTool,
    now: int,
) -> tuple[Event, list[Effect]]:
    """Carry out a program's request; return the event for its runner, and the effects."""
    done: bool | list[Effect] | Refusal
    match action:
        case QueryInput(_, signal):
            done = environment.input(signal, now)
        case WriteOutput(_, signal, value):
            done = environment.set_output(signal, value, now)
        case AttachToTool(_, scene_object):
            done = environment.attach(scene_object, now)
        case DetachFromTool(_, scene_object):
            done = environment.detach(scene_object, now)
    if isinstance(done, Refusal):
        return RequestAborted(action.request, done), []
    if isinstance(done, bool):
        return InputValue(action.request, done), []
    return RequestDone(action.request), done


def _no_object(name: str) -> Refusal:
    return Refusal(VerdictCode.UNKNOWN_OBJECT, f"object {name!r}: this cell has no scene")
