"""A cell with a UR5, its surroundings and a store in memory, and requests to them as JSON."""

import json
import pickle
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from rigs.data.stored_documents import answer_of, noon

from openpendant.motion.description.robot import SerialRobot, serial_robot
from openpendant.server.cell.robot_cell import RobotCell
from openpendant.server.endpoints.pendant.management import carry_out
from openpendant.server.environment import CellEnvironment
from openpendant.server.events.cell_events import CellEvent
from openpendant.server.events.effects import Ask, Backend, Effect, LogLine, QueryController, Send
from openpendant.server.events.management_requests import ReplyTo, handlers_of, parse
from openpendant.server.events.pending import Pending
from openpendant.server.positions.position_book import PositionBook
from openpendant.server.refusal import Refusal
from openpendant.server.scene.imports import read_apart
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.robot_kinematics import RobotKinematics
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.store.store_errors import StoreError
from openpendant.simplemsg import JointFeedback, Message, ReplyCode, ValidField, joint_array
from openpendant.simplemsg.pendant import Management, Outcome
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.verdicts import VerdictCode

MS = 1_000_000


@cache
def robot() -> SerialRobot:
    return serial_robot("ur5")


class SurroundedCell:
    """One cell whose robot stands at home; the store answers at once.

    Attributes:
        turns: processor time of each turn of the last request, that which took it first [ns].
    """

    def __init__(
        self, folder: Path, *, reads_apart: bool = False, is_told_emulated: bool = False
    ) -> None:
        """Begin with what the folder's store has.

        Args:
            reads_apart: whether requests come as a planning process hands them back.
            is_told_emulated: whether the cell's file says that its controller is emulated.
        """
        self._reads_apart = reads_apart
        controller = {"signals": "openpendant", "emulated": is_told_emulated}
        settings = make_settings({"controller": controller}, "test")
        self.now = 1_000_000_000
        self.pending = Pending()
        self.mathematics = RobotKinematics(robot())
        self.cell = RobotCell(settings, robot().limits, self._news, self.pending, self.mathematics)
        own = self.mathematics.named_positions
        self.positions = PositionBook(settings.name, own, robot().limits, self.pending)
        self.around = CellEnvironment(
            *(self.cell, self.mathematics, self.pending, settings, "ur5", self.positions)
        )
        around = self.around
        self._handlers = handlers_of(
            around.service, around.named, around.recordings, around.kinematics
        )
        self.store = open_store(folder / "store.db", wall_clock=noon)
        self.refuse_with: StoreError | None = None
        self.answers: list[tuple[bool, dict[str, Any]]] = []
        self.outcomes: list[Outcome] = []
        self.queries: list[Message] = []
        self.lines: list[str] = []
        self.turns: list[int] = []
        self.perform(self.positions.read_once())
        self.perform(self.around.world.load())
        self.until(lambda: not self.around.world.is_busy)

    def _news(self, news: CellEvent, now: int) -> list[Effect]:
        return []

    def perform(self, outgoing: list[Effect]) -> None:
        for item in outgoing:
            match item:
                case Ask(backend=Backend.STORE):
                    self._run(item)
                case Send(message=Management() as reply):
                    done = reply.reply_code == ReplyCode.SUCCESS
                    self.answers.append((done, json.loads(reply.body)))
                case Send(message=Outcome() as told):
                    self.outcomes.append(told)
                case QueryController(message=message):
                    self.queries.append(message)
                case LogLine(text=text):
                    self.lines.append(text)

    def _run(self, asked: Ask) -> None:
        answer = self.refuse_with or answer_of(self.store, asked.question)
        self.turn(lambda: self.pending.resume(asked, answer, self.now))

    def report(
        self,
        position: tuple[float, ...] | None = None,
        after_ms: int = 10,
        *,
        velocity: float = 0.0,
    ) -> None:
        self.now += after_ms * MS
        joints = joint_array(robot().home_position if position is None else position)
        still, rates = joint_array(()), joint_array((velocity,))
        message = JointFeedback(0, int(ValidField.ALL), 0.0, joints, rates, still)
        self.perform(self.cell.reported(message, self.now))
        self.perform(self.around.reported(self.now))

    def reports(self, count: int) -> None:
        for _ in range(count):
            self.report()

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Make a request that is carried out; return its answer."""
        done, answer = self._answer(op, fields)
        assert done, answer
        return answer

    def refused(self, op: str, **fields: Any) -> tuple[VerdictCode, str]:
        """Make a request that is refused; return why."""
        done, answer = self._answer(op, fields)
        assert not done, answer
        return VerdictCode(answer["code"]), answer["text"]

    def _answer(self, op: str, fields: dict[str, Any]) -> tuple[bool, dict[str, Any]]:
        before = len(self.answers)
        self.turns = []
        self.send(op, **fields)
        self.until(lambda: len(self.answers) > before)
        (answer,) = self.answers[before:]
        return answer

    def send(self, op: str, **fields: Any) -> None:
        """Make a request, whose answer may come later."""
        body = json.dumps({"op": op, **fields}).encode()
        if not self._reads_apart:
            self.turn(lambda: self.answered(body))
            return
        answer = pickle.dumps(read_apart(body), pickle.HIGHEST_PROTOCOL)
        self.turn(lambda: self._carried_out(pickle.loads(answer)[1]))

    def turn(self, event: Callable[[], list[Effect]]) -> None:
        """Let something happen, and note its processor time and that of what follows at once."""
        began = time.thread_time_ns()
        outgoing = event()
        self.turns.append(time.thread_time_ns() - began)
        self.perform(outgoing)

    def tick(self) -> None:
        self.now += 10 * MS
        self.turn(lambda: self.pending.tick(self.now) + self.around.monitor.tick(self.now))

    def until(self, is_so: Callable[[], bool]) -> int:
        """Let time pass until something is so; return how many ticks that took."""
        for ticks in range(10_000):
            if is_so():
                return ticks
            self.tick()
        raise AssertionError("nothing came of it")

    def answered(self, body: bytes) -> list[Effect]:
        return self._carried_out(parse(body)[1])

    def _carried_out(self, asked: Request[Any] | Refusal) -> list[Effect]:
        reply: ReplyTo[Any] = ReplyTo(1, 7, "ann")
        if isinstance(asked, Refusal):
            return reply.refuse(asked)
        return carry_out(self._handlers[type(asked)], asked, reply, self.now)
