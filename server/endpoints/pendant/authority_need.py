"""Need of the motion authority: which management requests are its holder's alone, and when.

Owns what the words of `NeedsAuthority` mean in a cell: when the robot moves, what it carries, which
tool is selected and which program is under way. The declaration of an operation says which of them
holds for it. Who holds the authority, the cell knows. A program sets outputs and takes objects for
the holder who runs it and asks nobody here.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from openpendant.simplemsg.pendant.management.declaration import NeedsAuthority, Request
from openpendant.simplemsg.pendant.management.scene import (
    AddObject,
    ImportScene,
    MoveObject,
    RemoveObject,
)

from ...cell.interlocks import permission
from ...cell.robot_cell import RobotCell
from ...environment import CellEnvironment
from ...programs.execution.program_executor import ProgramExecutor
from ...refusal import Refusal
from ...scene.imports import SceneImport, is_any_held


class AuthorityNeed:
    """The need of one cell's motion authority."""

    def __init__(
        self, cell: RobotCell, executor: ProgramExecutor, environment: CellEnvironment | None
    ) -> None:
        """Judge by a cell as it is when asked; without an environment nothing can be selected."""
        self._cell = cell
        self._executor = executor
        self._environment = environment

    def fault(self, asked: Request[Any], session: int, now: int) -> Refusal | None:
        """Return why a request is not carried out for a connection; names who is in control."""
        refusal = permission(self._cell.authority, session, now)
        if refusal is None:
            return None
        when = self._when(asked)
        if when is None:
            return None
        needs = f"{asked.op} needs the motion authority{when}"
        if not refusal.text:
            return Refusal(refusal.code, f"{needs}; nobody is in control: take it first")
        return Refusal(refusal.code, f"{needs}; {refusal.text}: take it once it is free")

    def _when(self, asked: Request[Any]) -> str | None:
        """Return what a request needs the authority for, in words; None where it needs none."""
        name = getattr(asked, "name", None)
        match asked.AUTHORITY:
            case NeedsAuthority.NEVER:
                return None
            case NeedsAuthority.WHILE_MOVING:
                return self._while_moving()
            case NeedsAuthority.MOVING_OR_CARRIED:
                moving = self._while_moving()
                is_carried = moving is None and self.changes_tool_or_load(asked)
                return " for what the robot carries" if is_carried else moving
            case NeedsAuthority.SELECTED_TOOL:
                is_selected = self.changes_tool_or_load(asked)
                return f" for {name!r}, the selected tool" if is_selected else None
            case NeedsAuthority.PROGRAM_UNDER_WAY:
                is_in_run = name is not None and self._executor.is_in_run(name)
                return f" for {name!r}, which is under way" if is_in_run else None
        return ""

    def changes_tool_or_load(self, asked: Request[Any]) -> bool:
        """Return True for a change of the tool that is selected now, or of what the robot carries.

        What does so by its declaration (`ALWAYS`) is none of them.
        """
        match asked.AUTHORITY:
            case NeedsAuthority.MOVING_OR_CARRIED:
                return concerns_carried(asked, self._carried())
            case NeedsAuthority.SELECTED_TOOL:
                return getattr(asked, "name", None) == self._selected()
        return False

    def _while_moving(self) -> str | None:
        busy = self._cell.under_way()
        return f" while {busy}" if busy else None

    def _selected(self) -> str | None:
        environment = self._environment
        return None if environment is None else environment.world.frames.selected_tool

    def _carried(self) -> Collection[str]:
        environment = self._environment
        objects = () if environment is None else environment.world.scene.objects
        return {each.name for each in objects if each.link is not None}


def concerns_carried(asked: Request[Any], carried: Collection[str]) -> bool:
    """Return True if a change of the scene takes, changes or leaves an object that a link carries.

    A content that is no scene is refused by whoever reads it.

    Args:
        carried: names of what links of the robot carry now.
    """
    match asked:
        case AddObject():
            return asked.object.get("link") is not None
        case RemoveObject() | MoveObject():
            return asked.name in carried
        case SceneImport():
            return bool(carried) or asked.is_any_held
        case ImportScene():
            return bool(carried) or is_any_held(asked.content)
    return True  # a new kind of change, until it is said here what it does
