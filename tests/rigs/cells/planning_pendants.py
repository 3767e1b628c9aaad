"""A cell with an emulated robot, whose pendants make plans and execute them; on a virtual clock."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, TypeAlias

from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import jobs_in
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Effect, SendToController
from openpendant.server.events.events import Answered
from openpendant.server.planning.jobs import Job, PlanAnswer
from openpendant.simplemsg import JointTrajPtFull
from openpendant.simplemsg import pendant as wire
from openpendant.simplemsg.pendant import Activity, PlanState
from openpendant.simplemsg.verdicts import VerdictCode

Made: TypeAlias = dict[str, Any]


class PlansCell(EmulatedCell):
    """One cell; `operator` holds the authority, and is told of changes.

    Attributes:
        handed: positions of the set-points in the order in which the uplink got them.
        jobs: what the planning process was asked for.
    """

    def __init__(self, robot: str = "ur5", *, has_surroundings: bool = True, **more: Any) -> None:
        self.handed: list[JointTrajPtFull] = []
        self.jobs: list[Job] = []
        super().__init__(robot, has_surroundings=has_surroundings, **more)
        self.operator = self.informed(self.holder("operator"))
        self.wait(100)
        self.home = self.position

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        self.jobs += jobs_in(outgoing)
        for item in outgoing:
            if isinstance(item, SendToController) and isinstance(item.message, JointTrajPtFull):
                self.handed.append(item.message)
        return super().perform(outgoing)

    def informed(self, pendant: Pendant) -> Pendant:
        """Return a pendant that has declared that it wants notices."""
        assert pendant.code(wire.Declare(pendant._next(), 0.0, 1, "en")) is VerdictCode.ACCEPTED
        return pendant

    def other(self, name: str = "other") -> Pendant:
        return self.informed(self.pendant(name))

    def turned(self, angle: float, joint: int = 0) -> list[float]:
        goal = list(self.home)
        goal[joint] += angle
        return goal

    def make(self, by: Pendant | None = None, **fields: Any) -> Made:
        """Have a plan made; a turn of the first joint where no goal is given."""
        fields.setdefault("goal", {"kind": "ptp", "joints": self.turned(0.4)})
        return (by or self.operator).ask("plans.make", **fields)

    def plan(self, by: Pendant | None = None, **fields: Any) -> int:
        """Have a plan made that is made; return its number."""
        made = self.make(by, **fields)
        assert made.get("state") == "ready", made
        return int(made["plan"])

    def ask_later(self, by: Pendant, op: str, **fields: Any) -> dict[str, Any]:
        """Make a request that is answered within some ticks; return the answer."""
        before = len(by.answers())
        by.send(wire.Management(78, json.dumps({"op": op, **fields}).encode()))
        for _ in range(40):
            if len(by.answers()) > before:
                return by.answers()[before]
            self.wait(10)
        raise AssertionError("no answer came")

    def samples(self, plan: int, **fields: Any) -> list[list[float]]:
        """Return all samples of a plan, asked for a hundred at a time."""
        rows: list[list[float]] = []
        while True:
            told = self.ask_later(
                self.operator, "plans.samples", plan=plan, first=len(rows), **fields
            )
            rows += told["rows"]
            if not told["more"]:
                return rows
            self.wait(60)

    def execute(
        self, plan: int, by: Pendant | None = None, *, override_is_one: int = 0
    ) -> VerdictCode | None:
        who = by or self.operator
        self.handed.clear()
        return who.code(wire.Execute(who._next(), plan, override_is_one))

    def let_finish(self, longest: int = 60_000) -> None:
        """Let time pass, the authority alive, until the cell is at rest."""
        for _ in range(0, longest, 100):
            self.operator.send(wire.AuthorityBeat())
            self.wait(100)
            if self.core.cell.activity is Activity.IDLE:
                return
        raise AssertionError("the motion does not end")

    def state_of(self, plan: int) -> str:
        heads = self.operator.ask("plans.show")["plans"]
        (head,) = [each for each in heads if each["plan"] == plan]
        return str(head["state"])

    @property
    def is_executing(self) -> bool:
        return self.core.cell.driving.is_busy

    def add_box(self, name: str, at: Sequence[float], size: float = 0.1) -> dict[str, Any]:
        revision = self.operator.ask("scene.show")["revision"]
        box = {
            "name": name,
            "shape": {"type": "box", "size": [size] * 3},
            "position": list(at),
        }
        return self.operator.ask("scene.add", object=box, expected_revision=revision)


def notices(pendant: Pendant, plan: int | None = None) -> list[tuple[PlanState, VerdictCode]]:
    """Return what a pendant was told of plans, or of one."""
    return [
        (PlanState(each.state), VerdictCode(each.code))
        for each in pendant.all(wire.PlanChanged)
        if plan is None or each.plan == plan
    ]


class UnplannedCell(PlansCell):
    """The same, where the planning process answers only when it is told to."""

    waits = True

    def answered(self, asked: Any, answer: object) -> list[Effect]:
        if self.waits and isinstance(answer, PlanAnswer):
            self.open.append((asked, answer))
            return []
        return super().answered(asked, answer)

    def __init__(self, robot: str = "ur5", **more: Any) -> None:
        self.open: list[tuple[Any, PlanAnswer]] = []
        self.waits = False
        super().__init__(robot, **more)
        self.waits = True

    def answer_next(self, instead: PlanAnswer | None = None) -> None:
        asked, answer = self.open.pop(0)
        told = answer if instead is None else instead
        self.perform(self.core.handle(Answered(asked, told), self.now))
