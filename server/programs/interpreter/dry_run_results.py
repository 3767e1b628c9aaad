"""Questions of a dry run to a planner, and its findings: plain values.

An `index` is the number of a statement in its program, from 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

from openpendant.motion.scene.scene import Scene
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant.management.program_values import JointVector
from openpendant.simplemsg.pendant.management.statements import Attach, Detach, Statement

from ...refusal import Refusal
from .motion_blocks import MotionBlock

ENDLESS_PASSES = 2
"""Passes of an endless loop: into it, and from its end to its beginning."""

ToolSample: TypeAlias = tuple[float, float, float, float]
"""Time from the start of the block [s] and the tool's place x, y, z in the base frame [m]."""


@dataclass(frozen=True, slots=True)
class BlockPlan:
    """Planner's answer for a block that can be run.

    Attributes:
        duration: of the block [s].
        end: (n,) where the robot stands afterwards [rad or m].
        motion: its samples, where they are wanted.
    """

    duration: float
    end: JointVector
    path: tuple[ToolSample, ...] = ()
    motion: Trajectory | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class BlockRefused:
    """Planner's answer for a block that cannot be run.

    Attributes:
        place: the move at fault, by its place in the block.
    """

    place: int
    refusal: Refusal


PlanBlock: TypeAlias = Callable[[JointVector, MotionBlock, Scene | None], BlockPlan | BlockRefused]
"""Plans a block from where the robot stands, in a scene; None to check nothing."""

Rearrange: TypeAlias = Callable[[Scene, Attach | Detach, JointVector], Scene | Refusal]
"""Returns the scene after an object changed hands where the robot stands, or why it cannot."""


@dataclass(frozen=True, slots=True)
class MoveFinding:
    """Finding for one statement that moves.

    Attributes:
        zone_used: True if its zone joins it with the next move, wherever it was walked.
    """

    program: str
    index: int
    point: str
    refusal: Refusal | None
    zone_used: bool


@dataclass(frozen=True, slots=True)
class HandOver:
    """Finding for one statement that changes the scene."""

    program: str
    index: int
    statement: Attach | Detach
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class StatementFinding:
    """Finding for one statement that neither moves nor changes the scene."""

    program: str
    index: int
    statement: Statement
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class DryRunResult:
    """Findings of a walk through a program.

    Attributes:
        duration: of the first walk, waits included, inputs answered at once [s].
        endless: True if a loop of the program never ends; the duration is then of
            `ENDLESS_PASSES` passes.
        complete: True if the walks took every branch to its end.
        path: the tool's way in the first walk; times from the start of the run [s].
        moves: a verdict for every statement that was walked, in order of program and number.
        not_walked: the moves that no walk came to, as program and number.
        hand_overs: the statements that were walked and change the scene, in order of program and
            number.
        statements: likewise those with signals or flags, and loops.
        unchecked: of those with signals the ones that nobody knows enough for, as program and
            number.
    """

    duration: float
    endless: bool
    complete: bool
    path: tuple[ToolSample, ...]
    moves: tuple[MoveFinding, ...]
    not_walked: tuple[tuple[str, int], ...]
    hand_overs: tuple[HandOver, ...] = ()
    statements: tuple[StatementFinding, ...] = ()
    unchecked: tuple[tuple[str, int], ...] = ()

    @property
    def refusals(self) -> tuple[MoveFinding | HandOver | StatementFinding, ...]:
        """Statements that cannot be run."""
        found: list[MoveFinding | HandOver | StatementFinding] = [*self.moves, *self.hand_overs]
        found += self.statements
        return tuple(verdict for verdict in found if verdict.refusal is not None)


@dataclass(frozen=True, slots=True)
class PointFinding:
    """Finding for one point."""

    point: str
    refusal: Refusal | None
