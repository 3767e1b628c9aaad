"""Questions on the display (a choice by digit, a text, a stored program), and typed targets.

Owns the effect of each key on a question. A program's name with a space is selected and never
typed: the space bar stops the robot. Owns the parsing of a typed target, and the goal that follows
from it and the present position. The angles of the tool are those of the pose page: rotations about
x, y, z of base, A first. Values are separated by `;` because the space bar is the stop. The decimal
separator is a dot in every locale; a comma is refused, not guessed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from openpendant.simplemsg.pendant import State

from ..motions import quaternion_of, roll_pitch_yaw
from .cell_view import CellView
from .commands import (
    Command,
    MakeProgram,
    MoveJoints,
    MoveToPose,
    OpenProgram,
    TeachPosition,
)

LONGEST_TEXT = 64


class TextPurpose(Enum):
    """Purpose of a typed text; the value is the prompt."""

    STEP = "Step: 2mm or 1.5deg"
    TARGET = "Go to: x=300;a=180"
    RECORDING = "Name of recording?"
    POSITION = "Name of position?"


@dataclass(frozen=True, slots=True)
class Choice:
    """A question that a digit answers; any other key means no.

    Attributes:
        options: by digit, the shown text and the result: a command, or another question.
    """

    title: str
    options: Mapping[str, tuple[str, Command | Choice]]

    def struck(self, key: str) -> Command | Choice | None:
        """Return the result of a key; None for no."""
        return self.options[key][1] if key in self.options else None


@dataclass(frozen=True, slots=True)
class EnteredText:
    """A text that was completed with Enter."""

    wanted: TextPurpose
    text: str


@dataclass(frozen=True, slots=True)
class TextEntry:
    """A text that is being typed."""

    wanted: TextPurpose
    text: str = ""

    def struck(self, key: str) -> TextEntry | EnteredText | Choice | Command | None:
        """Return what a key makes of it; None where it is given up."""
        if key == "escape":
            return None
        if key == "enter":
            return EnteredText(self.wanted, self.text)
        if key == "backspace":
            return replace(self, text=self.text[:-1])
        if len(key) == 1 and key.isprintable() and len(self.text) < LONGEST_TEXT:
            return replace(self, text=self.text + key)
        return self


@dataclass(frozen=True, slots=True)
class PositionName(TextEntry):
    """The name of a position that is being typed: where the robot stands gets it.

    Attributes:
        taken: positions of the cell, which are moved after a question only.
        revision: of the positions, as they were listed.
    """

    taken: tuple[str, ...] = ()
    revision: int = 0

    def struck(self, key: str) -> PositionName | Choice | TeachPosition | None:
        """Return what a key makes of it; None where it is given up, or has no name."""
        if key != "enter":
            answer = TextEntry.struck(self, key)
            return answer if isinstance(answer, PositionName) else None
        if not self.text:
            return None
        taught = TeachPosition(self.text, self.revision)
        return moving_position(taught) if self.text in self.taken else taught


def moving_position(taught: TeachPosition) -> Choice:
    """Return the question to confirm that a position of the cell is moved to here."""
    return Choice(f"{taught.name} to here?", {"1": ("yes", taught)})


@dataclass(frozen=True, slots=True)
class ProgramChoice:
    """A choice among the stored programs, and a new program with the typed name.

    Attributes:
        names: all programs; None until the server's answer.
        selected: the offer that Enter takes, from 0.
    """

    names: tuple[str, ...] | None = None
    text: str = ""
    selected: int = 0

    def listed(self, names: Iterable[str]) -> ProgramChoice:
        """Return this choice with the programs of the server's answer."""
        return replace(self, names=tuple(names), selected=0)

    @property
    def matches(self) -> tuple[str, ...]:
        """The programs whose name contains the typed text, ignoring spaces and case."""
        typed = self.text.lower()
        found = [name for name in self.names or () if typed in name.lower().replace(" ", "")]
        rank = {self.text: 0}
        return tuple(
            sorted(found, key=lambda name: (rank.get(name, 1), not name.lower().startswith(typed)))
        )

    @property
    def new(self) -> str:
        """The typed name if no program has it; else empty."""
        return "" if self.names is None or self.text in self.names else self.text

    @property
    def offers(self) -> tuple[str, ...]:
        """The offers that Enter can take: the matches, then the new name."""
        return (*self.matches, *([self.new] if self.new else []))

    def struck(self, key: str) -> ProgramChoice | Choice | OpenProgram | None:
        """Return what a key makes of it; None where it is given up."""
        if key == "escape":
            return None
        if key == "enter":
            return self._taken()
        if key in ("up", "down"):
            last = max(0, len(self.offers) - 1)
            by = 1 if key == "down" else -1
            return replace(self, selected=max(0, min(self.selected + by, last)))
        if key == "backspace":
            return replace(self, text=self.text[:-1], selected=0)
        if len(key) == 1 and key.isprintable() and len(self.text) < LONGEST_TEXT:
            return replace(self, text=self.text + key, selected=0)
        return self

    def _taken(self) -> Choice | OpenProgram | None:
        offers = self.offers
        if self.selected < len(self.matches):
            return OpenProgram(offers[self.selected])
        if offers:
            return creation(self.new)
        # Before the list is here, the server tells whether there is such a program.
        return OpenProgram(self.text) if self.text else None


def creation(name: str) -> Choice:
    """Return the question to confirm a new program."""
    return Choice(f"Create {name}?", {"1": ("yes", MakeProgram(name))})


_LENGTHS, _ANGLES = "xyz", "abc"
_TOOL_AXES = _LENGTHS + _ANGLES

_STEEPEST = math.radians(89.5)
"""From this |B| on, A and C turn about nearly the same axis, and neither alone says anything."""


class NotATarget(ValueError):
    """A text that names no target; the message says what is accepted."""


def read_target(text: str, cell: CellView) -> MoveJoints | MoveToPose:
    """Read a target: joints such as `3=-45` (degrees or mm), or the tool in base, `z=400;a=180`.

    Args:
        cell: the present position; axes that are not typed keep it.

    Raises:
        NotATarget: the text names no target, or the robot's position is not known.
    """
    accepted = (
        f"1 to {cell.dof}, or x, y, z in mm and a, b, c in degrees, then = and a number,"
        " more after ; as in 3=-45, z=400, x=300;a=180"
    )
    if "," in text:
        raise NotATarget(f"{text!r} is no target; accepted: a dot for decimals, as in 3=-45.5")
    values: dict[str, float] = {}
    for part in text.split(";"):
        name, _, number = part.partition("=")
        value = _number(number)
        if value is None:
            raise NotATarget(f"{part or 'nothing'!r} is no target; accepted: {accepted}")
        if not _is_tool_axis(name) and not _is_joint(name, cell.dof):
            raise NotATarget(f"no axis {name!r}; accepted: {accepted}")
        if name in values:
            raise NotATarget(f"{name} is named twice; accepted: each axis once")
        values[name] = value
    if all(map(_is_tool_axis, values)):
        return _tool_goal(values, cell)
    if any(map(_is_tool_axis, values)):
        raise NotATarget(f"{text!r} mixes joints and tool; accepted: either of them")
    return _joint_goal(values, cell)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _is_tool_axis(name: str) -> bool:
    return len(name) == 1 and name in _TOOL_AXES


def _is_joint(name: str, dof: int) -> bool:
    # No more digits than a number of joints has, or `01` would be another name of joint 1.
    return name.isascii() and name.isdigit() and name == str(int(name)) and 1 <= int(name) <= dof


def _joint_goal(values: dict[str, float], cell: CellView) -> MoveJoints:
    if cell.positions is None:
        raise NotATarget("no target: the joint values are not known")
    goal, told = list(cell.positions), []
    for name, value in values.items():
        joint = int(name) - 1
        linear = cell.joints[joint]["unit"] == "m"
        goal[joint] = value / 1000 if linear else math.radians(value)
        told.append(f"{name} to {value:g}{' mm' if linear else '°'}")
    return MoveJoints(tuple(goal), f"joint {', '.join(told)}")


def _tool_goal(values: dict[str, float], cell: CellView) -> MoveToPose:
    state = cell.state
    if state is None or not cell.knows_tool:
        raise NotATarget("no target: the tool's pose is not known")
    x, y, z = (
        values[axis] / 1000 if axis in values else here
        for axis, here in zip(_LENGTHS, state.tool_position, strict=True)
    )
    told = ", ".join(
        f"{axis} to {value:g}{' mm' if axis in _LENGTHS else '°'}" for axis, value in values.items()
    )
    return MoveToPose((x, y, z), _orientation(values, state), f"tool, {told}")


def _orientation(values: dict[str, float], state: State) -> tuple[float, float, float, float]:
    """Return the orientation with the typed angles, and the other angles as shown."""
    typed = [axis for axis in _ANGLES if axis in values]
    if not typed:
        x, y, z, w = state.tool_orientation
        return x, y, z, w
    shown = roll_pitch_yaw(state.tool_orientation)
    if len(typed) < len(_ANGLES) and abs(shown[1]) > _STEEPEST:
        raise NotATarget(
            f"at B = {math.degrees(shown[1]):.1f}° A and C are not told apart;"
            " accepted: all of a, b, c"
        )
    a, b, c = (
        math.radians(values[axis]) if axis in values else here
        for axis, here in zip(_ANGLES, shown, strict=True)
    )
    return quaternion_of(a, b, c)
