"""What a controller does in tests that nothing may go on after, without a person's doing at us."""

import dataclasses
from collections.abc import Callable

from rigs.cells.program_cell import ProgramCell

from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import OperatorAction


def press_emergency_stop(cell: ProgramCell) -> None:
    """At the controller, and reset it there."""
    cell.controller.operate(OperatorAction.EMERGENCY_STOP, cell.now)
    cell.pass_time(300)
    cell.controller.operate(OperatorAction.RESET, cell.now)


def reporting(**fields: int) -> Callable[[ProgramCell], None]:
    """Have the controller report another status than it has, and at once its own again."""

    def reported(cell: ProgramCell) -> None:
        own = cell.controller.status(cell.now)
        for message in (dataclasses.replace(own, **fields), own):
            cell._hear(ControllerPath.STATE, message)

    return reported


def lose(path: ControllerPath) -> Callable[[ProgramCell], None]:
    def lost(cell: ProgramCell) -> None:
        cell.disconnect(path)
        cell.pass_time(50)
        cell.connect(path)

    return lost


def fall_silent(cell: ProgramCell) -> None:
    """The controller reports nothing for a while."""

    def nothing(now: int) -> list[Message]:
        return []

    spoken = cell.controller.state_messages
    cell.controller.state_messages = nothing  # type: ignore[method-assign]
    cell.pass_time(400)
    cell.controller.state_messages = spoken  # type: ignore[method-assign]
