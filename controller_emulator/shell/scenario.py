"""Timed operator events, read from a file: the actions of a person at the controller.

Owns the file format:

    [[event]]
    at = 2.5                    # seconds after the emulator is ready
    action = "emergency_stop"   # or "reset"

Knows no controller; it says what is due.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.simplemsg.pendant import OperatorAction

from ..float32 import NANOSECONDS
from .settings import from_validation, read_toml


class ScenarioEvent(BaseModel):
    """One timed action of the operator."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    at: float = Field(ge=0, le=86_400, description="seconds after the emulator is ready")
    action: Literal["emergency_stop", "reset"]


class OperatorScenario(BaseModel):
    """All events of a run, in any order."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    event: tuple[ScenarioEvent, ...] = ()


def load_scenario(file: Path) -> OperatorScenario:
    """Read a scenario file.

    Raises:
        EmulatorSettingsError: it cannot be read, or an event is not understood.
    """
    content = read_toml(file)
    try:
        return OperatorScenario.model_validate(content)
    except ValidationError as error:
        known = tuple(ScenarioEvent.model_fields)
        raise from_validation(error, str(file), "scenario", known) from None


class ScenarioPlayer:
    """Player of a scenario: the events that are due at a time."""

    def __init__(self, scenario: OperatorScenario, now: int) -> None:
        """Start the scenario's clock."""
        self._due = sorted(
            (now + round(event.at * NANOSECONDS), OperatorAction[event.action.upper()])
            for event in scenario.event
        )

    def due(self, now: int) -> list[OperatorAction]:
        """Return the events whose time has come since the last call, in order."""
        count = sum(at <= now for at, _ in self._due)
        actions = [action for _, action in self._due[:count]]
        del self._due[:count]
        return actions
