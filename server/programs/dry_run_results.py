"""What a dry run asks a planner, and what it finds: plain values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from openpendant.motion.scene import Scene

from ..refusal import Refusal
from .motion_blocks import MotionBlock
from .points import JointVector
from .statements import Attach, Detach, Statement

ENDLESS_PASSES = 2
"""Passes of an endless loop: into it, and from its end to its beginning."""

ToolSample: TypeAlias = tuple[float, float, float, float]
"""Time from the start of the block [s] and the tool's place x, y, z in the base frame [m]."""


@dataclass(frozen=True, slots=True)
class BlockPlan:
    """What the planner says of a block that can be run.

    Attributes:
        duration: of the block [s].
        end: (n,) where the robot stands afterwards [rad or m].
        path: samples of the tool's way, in order.
    """

    duration: float
    end: JointVector
    path: tuple[ToolSample, ...] = ()


@dataclass(frozen=True, slots=True)
class BlockRefused:
    """What the planner says of a block that cannot be run.

    Attributes:
        place: the move at fault, by its place in the block.
        refusal: why.
    """

    place: int
    refusal: Refusal


PlanBlock: TypeAlias = Callable[[JointVector, MotionBlock, Scene | None], BlockPlan | BlockRefused]
"""Plans a block from where the robot stands, in a scene; None to check nothing."""

Rearrange: TypeAlias = Callable[[Scene, Attach | Detach, JointVector], Scene | Refusal]
"""Returns the scene after an object changed hands where the robot stands, or why it cannot."""


@dataclass(frozen=True, slots=True)
class MoveVerdict:
    """What was found about one statement that moves.

    Attributes:
        program: name of its program.
        index: its number, from 0.
        point: the point that it goes to.
        refusal: why it cannot be run; None where it can.
        zone_used: whether its zone joins it with the next move, wherever it was walked.
    """

    program: str
    index: int
    point: str
    refusal: Refusal | None
    zone_used: bool


@dataclass(frozen=True, slots=True)
class HandOver:
    """What was found about one statement that changes the scene.

    Attributes:
        program: name of its program.
        index: its number, from 0.
        statement: what changes hands, and how.
        refusal: why it cannot; None where it can.
    """

    program: str
    index: int
    statement: Attach | Detach
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class StatementVerdict:
    """What was found about one statement that neither moves nor changes the scene.

    Attributes:
        program: name of its program.
        index: its number, from 0.
        statement: the statement.
        refusal: why a run ends there; None where it goes on.
    """

    program: str
    index: int
    statement: Statement
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class DryRun:
    """What a walk through a program found.

    Attributes:
        duration: of the first walk, waits included, inputs answered at once [s].
        endless: whether a loop of the program never ends; the duration is then of
            `ENDLESS_PASSES` passes.
        complete: whether the walks took every branch to its end.
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
    moves: tuple[MoveVerdict, ...]
    not_walked: tuple[tuple[str, int], ...]
    hand_overs: tuple[HandOver, ...] = ()
    statements: tuple[StatementVerdict, ...] = ()
    unchecked: tuple[tuple[str, int], ...] = ()

    @property
    def refusals(self) -> tuple[MoveVerdict | HandOver | StatementVerdict, ...]:
        """The statements that cannot be run."""
        found: list[MoveVerdict | HandOver | StatementVerdict] = [*self.moves, *self.hand_overs]
        found += self.statements
        return tuple(verdict for verdict in found if verdict.refusal is not None)


@dataclass(frozen=True, slots=True)
class PointVerdict:
    """Whether a point can be reached.

    Attributes:
        point: its name.
        refusal: why it cannot; None where it can.
    """

    point: str
    refusal: Refusal | None
