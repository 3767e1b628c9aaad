"""Lobby: which cells a server has, for a pendant that has not chosen one yet.

Owns what is told of each cell, how much of it to whom, and how often. All cells of a server have
one lobby, which asks each for what it is doing; before its hello a connection belongs to none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from openpendant.simplemsg.pendant import PROTOCOL_VERSION
from openpendant.simplemsg.pendant.management.cell import ServedCell, ServedCells
from openpendant.simplemsg.verdicts import VerdictCode

from ...access.admission import Admission
from ...access.lockout import SECOND_NS
from ...events.replies import NAME_BYTES, cut
from ...refusal import Refusal

LOBBY_PERIOD_NS = SECOND_NS
"""A connection may ask once in so long."""

ROBOT_BYTES = DISPLAY_BYTES = 64
"""So much of a robot's name, and of its manufacturer and model, is told: 128 cells fit a frame."""


@dataclass(frozen=True, slots=True)
class CellGlance:
    """What a cell is doing now.

    Attributes:
        holder: name of who has the motion authority; empty where nobody has it.
        is_emulated: the controller is known to be emulated.
    """

    holder: str
    is_moving: bool
    is_emulated: bool


@dataclass(frozen=True, slots=True)
class LobbyCell:
    """One cell.

    Attributes:
        display: manufacturer and model of its robot.
        glance: returns what it is doing now.
    """

    cell: str
    robot: str
    display: str
    glance: Callable[[], CellGlance]


class CellLobby:
    """All cells of a server, and who asked for them when."""

    def __init__(self) -> None:
        """Know no cell yet."""
        self._cells: list[LobbyCell] = []
        # What of each never changes, cut to what fits: to cut it again for each asker is dear.
        self._fixed: list[ServedCell] = []
        # When each connection was answered last [ns], in that order.
        self._answered: dict[int, int] = {}

    def join(self, cell: LobbyCell) -> None:
        """Take a cell up, behind those that are here."""
        self._cells.append(cell)
        robot, display = cut(cell.robot, ROBOT_BYTES), cut(cell.display, DISPLAY_BYTES)
        self._fixed.append({"cell": cell.cell, "robot": robot, "display": display})

    @property
    def names(self) -> list[ServedCell]:
        """The names of all cells and of their robots."""
        return [{"cell": each.cell, "robot": each.robot} for each in self._cells]

    def rate_fault(self, session: int, now: int) -> Refusal | None:
        """Return why a connection is not answered so soon again; count the answer where it is."""
        for each, at in list(self._answered.items()):
            if now - at < LOBBY_PERIOD_NS:
                break
            del self._answered[each]
        if session in self._answered:
            seconds = (self._answered[session] + LOBBY_PERIOD_NS - now) / SECOND_NS
            text = f"a lobby is answered once a second; wait {seconds:.2f} s"
            return Refusal(VerdictCode.TOO_OFTEN, text, value=seconds)
        self._answered[session] = now
        return None

    def describe(self, login: Admission, session: int, address: str, server: str) -> ServedCells:
        """Return what a connection is told of the cells.

        Args:
            address: where it comes from, which decides what it may see without a login.
            server: name and version of the program.
        """
        may_look = login.grant_of(session) is not None or login.visitors.may_look_on(address)
        connections = Counter(visitor.cell for visitor in login.visitors)
        needs_login = login.needs_login(address)
        cells: list[ServedCell] = []
        for each, fixed in zip(self._cells, self._fixed, strict=True):
            glance = each.glance()
            told: ServedCell = {
                **fixed,
                "emulated": glance.is_emulated,
                "login_needed": needs_login,
            }
            if may_look:
                told["holder"] = cut(glance.holder, NAME_BYTES)
                told["moving"] = glance.is_moving
                told["connections"] = connections[each.cell]
            cells.append(told)
        return {"server": server, "version": PROTOCOL_VERSION, "joins": False, "cells": cells}
