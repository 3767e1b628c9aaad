"""Position service: requests of pendants on named positions.

Owns the answers, and what is looked at in a position: is it inside the limits, does anything touch
there, how near is a singularity. Contacts are searched in steps of about a millisecond, one turn of
them in a tick; other work goes in between. What was found of a position is kept until the scene is
another, and requests that ask alike meanwhile get one answer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

from openpendant.motion.errors import for_a_screen
from openpendant.simplemsg.pendant.management import positions as op
from openpendant.simplemsg.pendant.management.declaration import Changed

from ..cell.robot_cell import RobotCell
from ..cell.standing import standing_at
from ..events.effects import Effect
from ..events.management_requests import ReplyTo, handles
from ..events.pending import Pending, Steps, Turn
from ..kinematics.question_rates import QuestionRates
from ..planning.jobs import JointVector
from ..refusal import Refusal
from ..scene.building_turns import TURN_EFFORT, Turns
from ..scene.robot_environment import RobotEnvironment
from .position_book import PositionBook

if TYPE_CHECKING:
    from openpendant.motion.scene.scene import Scene

LARGEST_CONDITION = 100.0
"""Greatest condition number of a position that is saved without a warning."""

NEAR_LIMIT: Mapping[bool, float] = {False: math.radians(1.0), True: 1e-3}
"""Least distance from a limit without a warning, by prismatic: 1° or 1 mm [rad or m]."""

_LOOK = 150.0  # µs: pose and condition of a position
_LONGEST_WHY = 100  # characters, so that a hundred positions fit a reply
_DIGITS = 9  # of a pose: nanometres


_Rows: TypeAlias = list[op.NamedPosition]


class PositionService:
    """Position service of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        positions: PositionBook,
        view: RobotEnvironment,
        pending: Pending,
        rates: QuestionRates,
    ) -> None:
        """Join what it asks.

        Args:
            rates: of all cells of the server; to list positions is a question on kinematics.
        """
        self._cell = cell
        self._rates = rates
        self._positions = positions
        self._view = view
        self._pending = pending
        self._contacts: dict[JointVector, str] = {}
        self._looked_in: Scene | None = None
        self._waiting: dict[tuple[int, int], list[ReplyTo[op.NamedPositions]]] = {}

    # To tell.

    @handles(op.ListPositions)
    def _list(
        self, asked: op.ListPositions, reply: ReplyTo[op.NamedPositions], now: int
    ) -> list[Effect]:
        book = self._positions
        refusal = self._rates.take(reply.session, 1, now) or book.being_read
        if refusal is not None:
            return reply.refuse(refusal)
        key = book.revision, id(self._view.scene)
        if key in self._waiting:
            self._waiting[key].append(reply)
            return []
        self._waiting[key] = [reply]
        problem = "" if book.problem is None else book.problem.sentence

        def told(rows: _Rows, at: int) -> list[Effect]:
            found: op.NamedPositions = {
                "positions": rows,
                "revision": key[0],
                "problem": problem,
            }
            return [item for each in self._waiting.pop(key) for item in each.answer(found)]

        return self._pending.run(self._rows(), told, now)

    def _rows(self) -> Steps[_Rows]:
        book, rows = self._positions, _Rows()
        named = [(name, at, True) for name, at in book.of_robot.items()]
        named += [(name, at, False) for name, at in sorted(book.of_cell.items())]
        turns = Turns()
        for name, joints, is_robots in named:
            if turns.spent >= TURN_EFFORT / 2:
                yield Turn.LAST
                turns = Turns(most=TURN_EFFORT)
            yield from turns.spend(_LOOK)
            place, turn = self._view.tool_pose(joints)
            condition = self._view.condition(joints)
            why = yield from self._why_not(joints, turns)
            rows.append(
                {
                    "name": name,
                    "kind": "robot" if is_robots else "user",
                    "joints": list(joints),
                    "pose": {
                        "position": [_rounded(value) for value in place],
                        "orientation": [_rounded(value) for value in turn],
                    },
                    "condition": None if condition is None else float(f"{condition:.4g}"),
                    "legal": not why,
                    "why": why[:_LONGEST_WHY],
                }
            )
        return rows

    def _why_not(self, joints: JointVector, turns: Turns) -> Steps[str]:
        """Return why the robot may not stand somewhere; empty where it may."""
        fault = self._positions.limit_fault(joints)
        if fault is not None:
            return fault.sentence
        return (yield from self._touching(joints, turns))

    def _touching(self, joints: JointVector, turns: Turns) -> Steps[str]:
        """Return which bodies touch at a position inside the limits, in words."""
        scene = self._view.scene
        if self._looked_in is not scene:
            self._contacts, self._looked_in = {}, scene
        known = self._contacts.get(joints)
        if known is None:
            nearest = yield from turns.take(self._view.nearest_steps(joints))
            is_free = nearest is None or not nearest.touching
            known = "" if is_free else f"{nearest.first} and {nearest.second} touch there"
            if self._looked_in is scene:
                self._contacts[joints] = known
        return known

    # To change.

    @handles(op.SavePosition)
    def _save(
        self, asked: op.SavePosition, reply: ReplyTo[op.SavedPosition], now: int
    ) -> list[Effect]:
        fault = self._positions.conflict(asked.expected_revision)
        joints = fault or self._joints(asked.joints, now)
        if isinstance(joints, Refusal):
            return reply.refuse(joints)
        before = self._positions.saved_as(asked.name, joints)
        if isinstance(before, Refusal):
            return reply.refuse(before)

        def looked(touching: str, at: int) -> list[Effect]:
            # Somebody else may have been faster while this one was looked at.
            changed = self._positions.conflict(asked.expected_revision)
            kept = changed or self._positions.saved_as(asked.name, joints)
            if isinstance(kept, Refusal):
                return reply.refuse(kept)
            warning = self._warning(joints, touching)

            def told(revision: int | Refusal, then: int) -> list[Effect]:
                if isinstance(revision, Refusal):
                    return reply.refuse(revision)
                return reply.answer({"revision": revision, "warning": warning})

            return self._positions.keep(kept, reply.name, reply.session, told)

        return self._pending.run(self._touching(joints, Turns()), looked, now)

    def _joints(self, asked: Sequence[float] | None, now: int) -> JointVector | Refusal:
        """Return the joints to be kept: those asked for, or where the robot stands."""
        if asked is None:
            return standing_at(self._cell, "a position", now)
        slots = self._cell.slots
        return slots.count_fault(len(asked)) or slots.position(asked)

    def _warning(self, joints: JointVector, touching: str) -> str | None:
        """Return what somebody should know who saves a position; None for nothing."""
        found = [touching] if touching else []
        condition = self._view.condition(joints)
        if condition is None:
            found.append("the arm is singular there")
        elif condition > LARGEST_CONDITION:
            found.append(f"near a singularity: condition {condition:.0f}")
        limits = self._cell.limits
        for index, value in enumerate(joints):
            room = min(value - limits.lower[index], limits.upper[index] - value)
            if room < NEAR_LIMIT[limits.prismatic[index]]:
                shown = for_a_screen(room, limits.unit(index))
                found.append(f"{limits.names[index]} is {shown} from its limit")
        return "; ".join(found) or None

    @handles(op.RenamePosition)
    def _rename(self, asked: op.RenamePosition, reply: ReplyTo[Changed], now: int) -> list[Effect]:
        kept = self._positions.renamed(asked.name, asked.new_name)
        return self._change(asked.expected_revision, kept, reply)

    @handles(op.DeletePosition)
    def _delete(self, asked: op.DeletePosition, reply: ReplyTo[Changed], now: int) -> list[Effect]:
        kept = self._positions.without(asked.name)
        return self._change(asked.expected_revision, kept, reply)

    def _change(
        self,
        expected: int,
        kept: Mapping[str, JointVector] | Refusal,
        reply: ReplyTo[Changed],
    ) -> list[Effect]:
        positions = self._positions.conflict(expected) or kept
        if isinstance(positions, Refusal):
            return reply.refuse(positions)

        def told(revision: int | Refusal, now: int) -> list[Effect]:
            if isinstance(revision, Refusal):
                return reply.refuse(revision)
            return reply.answer({"revision": revision})

        return self._positions.keep(positions, reply.name, reply.session, told)


def _rounded(value: float) -> float:
    """Return a number of a pose as it is told, without the sign of a zero."""
    return round(value, _DIGITS) + 0.0
