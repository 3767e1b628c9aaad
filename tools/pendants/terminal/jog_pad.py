"""The jog keys of the pendant: in which frame, by steps or held, how far.

Owns what a jog key asks for, and that it asks for nothing where the display is stale and keeps
nothing for later. Whether the robot may move is the server's decision.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import Activity

from .cell_view import CellView
from .commands import JOINTS, Command, Pulse, Step
from .jog_keys import Axes, JogKeys, JogKind
from .keyboard import AxisKey
from .messages import Messages
from .step_size import StepSize

_TOOL_AXES = 6
_STANDING = (Activity.IDLE, Activity.PAUSED)


class JogPad:
    """The jog keys of one pendant.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
        kind: whether a key makes a step or is held.
        step: size of a step.
    """

    def __init__(self, cell: CellView, messages: Messages) -> None:
        """Begin with steps of the joints.

        Args:
            cell: what is known of the cell.
            messages: takes what there is to say.
        """
        self.frame = JOINTS
        self.kind = JogKind.STEP
        self.step = StepSize()
        self._cell = cell
        self._messages = messages
        self._keys = JogKeys()

    def key(self, key: AxisKey, now: int) -> list[Command]:
        """Take a jog key; a step leaves with a later `tick`."""
        axes = self._cell.dof if self.frame == JOINTS else _TOOL_AXES
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
        return [Pulse(self.frame, held, deadline)]

    def tick(self, now: int) -> list[Command]:
        """Let a step leave once no other key can join it."""
        axes = self._keys.gathered(now)
        if not axes or not self.is_fresh(now):
            return []
        if self._cell.state is None or self._cell.state.activity not in _STANDING:
            self._messages.add("still moving: the key did nothing")
            return []
        return [Step(self.frame, self._increments(axes))]

    def is_fresh(self, now: int) -> bool:
        """Tell whether a motion may be asked for on what is shown; say so where not."""
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

    def _is_length(self, axis: int) -> bool:
        return self._cell.joints[axis]["unit"] == "m" if self.frame == JOINTS else axis < 3

    def turn_frame(self, by: int) -> None:
        """Choose the next frame, or the one before."""
        frames = (JOINTS, *self._cell.frames)
        self.let_go()
        self.frame = frames[(frames.index(self.frame) + by) % len(frames)]

    def check_frame(self) -> None:
        """Go back to the joints where the cell has no such frame any more."""
        if self.frame not in self._cell.frames:
            self.frame = JOINTS

    def toggle_kind(self) -> None:
        """Change between steps and held keys."""
        self.let_go()
        self.kind = JogKind.HOLD if self.kind is JogKind.STEP else JogKind.STEP

    def let_go(self) -> None:
        """Forget every key."""
        self._keys.let_go()
