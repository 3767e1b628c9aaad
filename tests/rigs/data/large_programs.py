"""Programs as large as they are taken, and a cell that counts what its core reads of them."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from rigs.cells.program_cell import ProgramCell
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Ask, Effect
from openpendant.server.planning.jobs import ProgramJob
from openpendant.server.planning.worker import job_planner
from openpendant.server.programs.editing import program_tasks
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program import MOST_POINTS
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.simplemsg.pendant import Management
from openpendant.simplemsg.pendant.management import statements
from openpendant.simplemsg.pendant.management.program_values import TeachPoint
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS

PIECE = 40_000


def large_text(
    points: int = MOST_POINTS, moves: int = MOST_STATEMENTS, *, name: str = "main"
) -> str:
    """A program whose robot goes to and fro, nowhere far."""
    lines = ["openpendant-program/1", f'program "{name}" robot ur5']
    lines += [f"point p{n} joints 0 -1.5 1.5 -1.5 -1.5 {n / 10_000} rad" for n in range(points)]
    lines += [f"move PTP p{n % points}" for n in range(moves)]
    return "\n".join(lines) + "\n"


@cache
def large_body(points: int = MOST_POINTS, moves: int = MOST_STATEMENTS) -> str:
    """The same as it is kept."""
    return program_to_json(parse(large_text(points, moves)))


class WorkCount:
    """Points and statements that were made, but for those of the planning process."""

    def __init__(self) -> None:
        self.parts = 0
        self.parses = 0
        self._elsewhere = False

    def counted(self, function: Callable[..., Any], attribute: str) -> Callable[..., Any]:
        def wrapper(*arguments: Any, **named: Any) -> Any:
            if not self._elsewhere:
                setattr(self, attribute, getattr(self, attribute) + 1)
            return function(*arguments, **named)

        return wrapper

    def elsewhere(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def wrapper(*arguments: Any) -> Any:
            self._elsewhere = True
            try:
                return function(*arguments)
            finally:
                self._elsewhere = False

        return wrapper

    def taken(self) -> tuple[int, int]:
        """The parts and parses since the last time."""
        found = (self.parts, self.parses)
        self.parts = self.parses = 0
        return found


def count_work(patch: pytest.MonkeyPatch) -> WorkCount:
    count = WorkCount()
    for kind in (TeachPoint, statements._Statement):
        patch.setattr(kind, "__post_init__", count.counted(kind.__post_init__, "parts"))
    for name in ("parse_source", "print_program"):
        patch.setattr(program_tasks, name, count.counted(getattr(program_tasks, name), "parses"))
    patch.setattr(job_planner, "perform", count.elsewhere(program_tasks.perform))
    return count


class WorkingCell(ProgramCell):
    """A cell whose planning process does its tasks about programs when told to."""

    def __init__(self) -> None:
        self.jobs: list[ProgramJob] = []
        self.done = 0
        super().__init__()

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        here = []
        for item in outgoing:
            match item:
                case Ask(question=ProgramJob() as job):
                    self.jobs.append(job)
                case _:
                    here.append(item)
        super().perform(here)
        return outgoing

    def work(self) -> None:
        while self.jobs:
            job = self.jobs.pop(0)
            self.done += 1
            self.planned(job, job_planner.answer(self.robot, job))

    def send(self, pendant: Pendant, op: str, **fields: object) -> list[dict[str, Any]]:
        """Send a request and return what is answered on this call stack."""
        body = json.dumps({"op": op, **fields}).encode()
        return [
            json.loads(reply.body)
            for reply in pendant.send(Management(77, body))
            if isinstance(reply, Management)
        ]

    def answer_to(self, body: bytes) -> dict[str, Any]:
        """Send the bytes of a request of the user's and return its one answer."""
        (reply,) = self.user.send(Management(77, body))
        assert isinstance(reply, Management)
        answer: dict[str, Any] = json.loads(reply.body)
        return answer

    def begin(self, pendant: Pendant, op: str, **fields: object) -> None:
        """Send a request whose answer is still to come."""
        assert self.send(pendant, op, **fields) == []

    def ask(self, pendant: Pendant, op: str, **fields: object) -> dict[str, Any]:
        """Send a request, have its tasks done, and return its one answer."""
        before = len(pendant.answers())
        self.send(pendant, op, **fields)
        self.work()
        (answer,) = pendant.answers()[before:]
        return answer

    def upload(self, text: str, revision: int = 0, *, form: str = "text") -> dict[str, Any]:
        """Save a program in parts; return the last answer."""
        pieces = [text[place : place + PIECE] for place in range(0, len(text), PIECE)]
        answer: dict[str, Any] = {}
        for part, piece in enumerate(pieces, 1):
            answer = self.ask(
                self.user,
                "programs.save",
                name="main",
                format=form,
                body=piece,
                expected_revision=revision,
                part=part,
                parts=len(pieces),
            )
            if "code" in answer:
                break
        return answer
