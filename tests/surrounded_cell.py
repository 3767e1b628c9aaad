"""A cell with a UR5, its surroundings and a store in memory, and requests to them as JSON."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from stored_documents import noon

from openpendant.motion.robot import SerialRobot, serial_robot
from openpendant.server.errands import Errands
from openpendant.server.news import News
from openpendant.server.outgoing import Errand, Outgoing, Query, Send
from openpendant.server.playback.operations import Asker
from openpendant.server.robot_cell import RobotCell
from openpendant.server.robot_mathematics import RobotMathematics
from openpendant.server.settings import make_settings
from openpendant.server.store.errors import StoreError
from openpendant.server.store.requests import Answer, perform
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.world.cell_surroundings import CellSurroundings
from openpendant.simplemsg import JointFeedback, Message, ReplyCode, ValidField, joint_array
from openpendant.simplemsg.pendant import Management, Outcome
from openpendant.simplemsg.verdicts import VerdictCode

MS = 1_000_000


@cache
def robot() -> SerialRobot:
    return serial_robot("ur5")


class SurroundedCell:
    """One cell whose robot stands at home; every errand is done at once."""

    def __init__(self, folder: Path) -> None:
        settings = make_settings({"controller": {"signals": "openpendant"}}, "test")
        self.now = 1_000_000_000
        self.cell = RobotCell(settings, robot().limits, self._news)
        self.mathematics = RobotMathematics(robot())
        self.errands = Errands()
        self.around = CellSurroundings(
            self.cell, self.mathematics, self.errands.ask, settings, "ur5"
        )
        self.store = open_store(folder / "store.db", wall_clock=noon)
        self.refuse_with: StoreError | None = None
        self.answers: list[tuple[bool, dict[str, Any]]] = []
        self.outcomes: list[Outcome] = []
        self.queries: list[Message] = []
        self.perform(self.around.tick(self.now))

    def _news(self, news: News, now: int) -> list[Outgoing]:
        return []

    def perform(self, outgoing: list[Outgoing]) -> None:
        for item in outgoing:
            match item:
                case Errand():
                    self._run(item)
                case Send(message=Management() as reply):
                    done = reply.reply_code == ReplyCode.SUCCESS
                    self.answers.append((done, json.loads(reply.body)))
                case Send(message=Outcome() as told):
                    self.outcomes.append(told)
                case Query(message=message):
                    self.queries.append(message)

    def _run(self, errand: Errand) -> None:
        answer: Answer
        try:
            answer = self.refuse_with or perform(self.store, errand.request)
        except StoreError as error:
            answer = error
        self.perform(self.errands.done(errand.errand_id, answer, self.now))

    def report(self, position: tuple[float, ...] | None = None, after_ms: int = 10) -> None:
        self.now += after_ms * MS
        joints = joint_array(robot().home_position if position is None else position)
        still = joint_array(())
        message = JointFeedback(0, int(ValidField.ALL), 0.0, joints, still, still)
        self.perform(self.cell.reported(message, self.now))
        self.perform(self.around.reported(self.now))

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
        body = json.dumps({"op": op, **fields}).encode()
        self.perform(self.around.operation(body, Asker(1, 7, "ann"), self.now))
        (answer,) = self.answers[before:]
        return answer
