"""Jog keys of the pendant: frame, steps or held keys, step sizes and speeds.

Owns the command of each jog key, that a stale display gives none and that none is queued; how long
a key counts as held, which keys count as struck together, and the ladders of step sizes and speeds.
The server decides if the robot may move.

A terminal reports when a key goes down and never when it comes up. No axis is asked to move longer
than `PULSE_NS` after its own last key stroke: each stroke makes a pulse that ends by itself, and
the auto-repeat of a held key makes the next one in time. Sizes are SI inside; the user sees
millimetres and degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from openpendant.simplemsg.pendant import Activity, State

from .cell_view import CellView
from .commands import JOINTS, ChangeSpeed, Command, PulseJog, StepJog
from .keyboard import AxisKey, Intent
from .messages import Messages

_LENGTHS_MM = (0.1, 1.0, 5.0, 10.0)
_ANGLES_DEG = (0.05, 0.5, 2.5, 5.0)
_LARGEST_MM, _LARGEST_DEG = 100.0, 45.0


class NotASize(ValueError):
    """A text that names no step size; the message says what is accepted."""


@dataclass(frozen=True, slots=True)
class StepSize:
    """Size of one increment."""

    millimetres: float = _LENGTHS_MM[1]
    degrees: float = _ANGLES_DEG[1]

    @property
    def metres(self) -> float:
        """The length [m]."""
        return self.millimetres / 1000

    @property
    def radians(self) -> float:
        """The angle [rad]."""
        return math.radians(self.degrees)

    def changed(self, by: int) -> StepSize:
        """Return the next larger or smaller size of the ladder; at its ends, the same size."""
        return StepSize(
            _neighbour(_LENGTHS_MM, self.millimetres, by), _neighbour(_ANGLES_DEG, self.degrees, by)
        )

    def typed(self, text: str) -> StepSize:
        """Return the sizes after one of them was typed, such as `2mm` or `1.5deg`.

        Raises:
            NotASize: the text names no size.
        """
        for unit, largest in (("mm", _LARGEST_MM), ("deg", _LARGEST_DEG)):
            if not text.endswith(unit):
                continue
            try:
                size = float(text.removesuffix(unit))
            except ValueError:
                break
            if 0.0 < size <= largest:
                length = size if unit == "mm" else self.millimetres
                return StepSize(length, size if unit == "deg" else self.degrees)
        if "," in text:
            raise NotASize(f"{text!r} is no step; accepted: a dot for decimals, as in 2.5mm")
        accepted = f"up to {_LARGEST_MM:g}mm or {_LARGEST_DEG:g}deg, above 0, with the unit"
        raise NotASize(f"{text or 'nothing'!r} is no step; accepted: {accepted}")


def _neighbour(ladder: tuple[float, ...], size: float, by: int) -> float:
    if by > 0:
        return next((each for each in ladder if each > size), ladder[-1])
    return next((each for each in reversed(ladder) if each < size), ladder[0])


PULSE_NS = 250_000_000
"""A key counts as held for so long after its last stroke; the server's longest deadline."""

_SHORTEST_NS = 50_000_000
"""The server's shortest deadline: a key with less left takes no part in a pulse."""

CHORD_NS = 80_000_000
"""Keys struck within this time of the first make one step together."""

Axes = tuple[tuple[int, int], ...]


class JogKind(Enum):
    """Kind of jog that a key starts."""

    STEP = "step"
    HOLD = "hold"


@dataclass(slots=True)
class JogKeys:
    """The jog keys that count as held, or that are collected for one step."""

    _struck: dict[int, tuple[int, int]] = field(default_factory=dict)
    _gathered: dict[int, int] = field(default_factory=dict)
    _since: int = 0

    def pulse(self, key: AxisKey, now: int) -> tuple[Axes, float]:
        """Take a stroke of a held key; return the axes to move, and for how long at most [s].

        The time is that until the first of their keys expires.
        """
        self._struck[key.axis] = (key.sign, now)
        left = {axis: PULSE_NS - (now - at) for axis, (_, at) in self._struck.items()}
        for axis in [axis for axis, rest in left.items() if rest < _SHORTEST_NS]:
            del self._struck[axis], left[axis]
        axes = tuple((axis, sign) for axis, (sign, _) in sorted(self._struck.items()))
        return axes, min(left.values()) / 1e9

    def gather(self, key: AxisKey, now: int) -> None:
        """Take a stroke for a step; the opposite direction of an axis replaces the first one."""
        if not self._gathered:
            self._since = now
        self._gathered[key.axis] = key.sign

    def gathered(self, now: int) -> Axes:
        """Return the axes of a step once the time to join it is over; empty before."""
        if not self._gathered or now - self._since < CHORD_NS:
            return ()
        axes, self._gathered = tuple(sorted(self._gathered.items())), {}
        return axes

    def let_go(self) -> None:
        """Forget every key."""
        self._struck.clear()
        self._gathered.clear()


TOOL_AXES = ("X", "Y", "Z", "A", "B", "C")
"""Of the tool in a frame: lengths, and rotations about x, y, z."""

_STANDING = (Activity.IDLE, Activity.PAUSED)


class JogPad:
    """The jog keys of one pendant.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
    """

    def __init__(self, cell: CellView, messages: Messages) -> None:
        """Start with steps of the joints."""
        self.frame = JOINTS
        self.kind = JogKind.STEP
        self.step = StepSize()
        self._cell = cell
        self._messages = messages
        self._keys = JogKeys()

    def key(self, key: AxisKey, now: int) -> list[Command]:
        """Take a jog key; a later `tick` returns the step."""
        axes = self._cell.dof if self.frame == JOINTS else len(TOOL_AXES)
        if not self.is_fresh(now):
            return []
        if key.axis >= axes:
            frame = self.frame or "joints"
            self._messages.add(f"no axis {key.axis + 1} in {frame}; accepted: 1 to {axes}")
            return []
        if self.kind is JogKind.STEP:
            self._keys.gather(key, now)
            return []
        held, deadline = self._keys.pulse(key, now)
        return [PulseJog(self.frame, held, deadline)]

    def tick(self, now: int) -> list[Command]:
        """Return the step once the time to join it is over."""
        axes = self._keys.gathered(now)
        if not axes or not self.is_fresh(now):
            return []
        if self._cell.state is None or self._cell.state.activity not in _STANDING:
            self._messages.add("still moving: the key did nothing")
            return []
        return [StepJog(self.frame, self._increments(axes))]

    def is_fresh(self, now: int) -> bool:
        """Return True if the shown values are new enough to start a motion; else say so."""
        if not self._cell.is_connected:
            self._messages.add(f"no link: {self._cell.absence}")
            return False
        if self._cell.is_stale(now):
            self._messages.add("STALE: no motion on values that may be old")
            return False
        return True

    def _increments(self, axes: Axes) -> tuple[tuple[int, float], ...]:
        return tuple(
            (axis, sign * (self.step.metres if self._is_length(axis) else self.step.radians))
            for axis, sign in axes
        )

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the axes that the keys move: numbers of joints, or as on the pose page."""
        if self.frame == JOINTS:
            return tuple(str(number) for number in range(1, self._cell.dof + 1))
        return TOOL_AXES

    def choose_frame(self, frame: str) -> None:
        """Select a frame that the cell has; of one that it has no more, say so."""
        if frame not in self._cell.frames:
            self._messages.add(
                f"no frame {frame} to jog in; accepted: {', '.join(self._cell.frames)}"
            )
            return
        self.let_go()
        self.frame = frame

    def _is_length(self, axis: int) -> bool:
        return self._cell.joints[axis]["unit"] == "m" if self.frame == JOINTS else axis < 3

    def turn_frame(self, by: int) -> None:
        """Select the next frame, or the previous one."""
        frames = (JOINTS, *self._cell.frames)
        self.let_go()
        self.frame = frames[(frames.index(self.frame) + by) % len(frames)]

    def check_frame(self) -> None:
        """Select the joints if the cell no longer has the selected frame."""
        if self.frame not in self._cell.frames:
            self.frame = JOINTS

    def toggle_kind(self) -> None:
        """Switch between steps and held keys."""
        self.let_go()
        self.kind = JogKind.HOLD if self.kind is JogKind.STEP else JogKind.STEP

    def let_go(self) -> None:
        """Forget every key."""
        self._keys.let_go()


_OVERRIDES = (0.01, 0.03, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
_CAPS = (0.01, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0)  # m/s


def speed_asked(intent: Intent, state: State) -> ChangeSpeed:
    """Return the speed that a key asks for, starting from the cell's speed."""
    match intent:
        case Intent.SLOWER | Intent.FASTER:
            return ChangeSpeed(_next_of(_OVERRIDES, state.override, intent is Intent.FASTER))
    wanted = _next_of(_CAPS, state.tool_speed_cap, intent is Intent.CAP_UP)
    return ChangeSpeed(state.override, wanted)


def _next_of(ladder: tuple[float, ...], value: float, up: bool) -> float:
    """Return the next rung of a ladder; a float32 value may be slightly off its rung."""
    slack = 1e-6
    if up:
        return next((rung for rung in ladder if rung > value + slack), ladder[-1])
    return next((rung for rung in reversed(ladder) if rung < value - slack), ladder[0])
