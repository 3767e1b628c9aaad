from __future__ import annotations

from typing import Any, get_args, get_type_hints

import pytest
from rigs.cells.emulated_cell import EmulatedCell

from openpendant.server.endpoints.pendant.access_requests import AccessRequests
from openpendant.server.endpoints.pendant.jog_requests import EscapeRequests
from openpendant.server.endpoints.pendant.management import ManagementRequests
from openpendant.server.events.effects import Effect
from openpendant.server.events.management_requests import ReplyTo, handlers_of, handles
from openpendant.server.programs.execution.breakpoints import Breakpoints
from openpendant.server.programs.execution.dry_run_service import DryRunService
from openpendant.server.programs.library.program_changes import ProgramChanges
from openpendant.server.programs.library.program_library import ProgramLibrary
from openpendant.server.recording.recording_service import RecordingService
from openpendant.server.scene.scene_service import SceneService
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import Done
from openpendant.simplemsg.pendant.management.devices import ClearTrace

SERVICES = (
    AccessRequests,
    Breakpoints,
    DryRunService,
    ManagementRequests,
    ProgramChanges,
    ProgramLibrary,
    RecordingService,
    EscapeRequests,
    SceneService,
)


def methods() -> dict[str, Any]:
    return {
        f"{service.__name__}.{name}": method
        for service in SERVICES
        for name, method in vars(service).items()
        if hasattr(method, "handles")
    }


def test_every_operation_has_one_handler() -> None:
    handled = [method.handles for method in methods().values()]
    assert len(handled) == len(set(handled))
    assert set(handled) == set(OPERATIONS.values())


def test_a_cell_finds_a_handler_for_every_operation() -> None:
    core = EmulatedCell(has_surroundings=True).core
    handlers = core.pendants._management._handlers
    assert set(handlers) == set(OPERATIONS.values())


@pytest.mark.parametrize("name", methods())
def test_a_handler_takes_its_request_and_answers_with_its_reply(name: str) -> None:
    method = methods()[name]
    hints = list(get_type_hints(method).values())
    assert hints[0] is method.handles
    assert get_args(hints[1]) == (method.handles.reply(),)


class Twice:
    @handles(ClearTrace)
    def first(self, asked: ClearTrace, reply: ReplyTo[Done], now: int) -> list[Effect]:
        return reply.answer({})

    @handles(ClearTrace)
    def second(self, asked: ClearTrace, reply: ReplyTo[Done], now: int) -> list[Effect]:
        return reply.answer({})


class Once:
    clear = Twice.first


@pytest.mark.parametrize("services", [(Twice(),), (Once(), Once())])
def test_a_second_handler_for_a_request_is_an_error(services: tuple[object, ...]) -> None:
    with pytest.raises(ValueError, match="ClearTrace has two handlers"):
        handlers_of(*services)
