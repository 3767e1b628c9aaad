"""Who may make, look at and execute plans, in which order requests count, and old connections."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from rigs.cells.admission_desk import LAN
from rigs.cells.guarded_rig import GuardedRig
from rigs.cells.planning_pendants import PlansCell
from rigs.peers.server_clients import Pendant

from openpendant.server.access.request_gate import is_overtaken
from openpendant.server.events.events import StopReceived
from openpendant.simplemsg import Overtaken, ReplyCode
from openpendant.simplemsg.pendant import (
    Capability,
    Execute,
    HelloReply,
    Management,
    PlanChanged,
    SoftwareStop,
    Verdict,
)
from openpendant.simplemsg.pendant.roles import LEAST_ROLE, Permission, Role
from openpendant.simplemsg.verdicts import VerdictCode as V

MAKE = {"goal": {"kind": "position", "name": "zero"}}


@pytest.fixture
def rig() -> GuardedRig:
    return GuardedRig()


@pytest.fixture
def cell() -> Iterator[PlansCell]:
    made = PlansCell(has_surroundings=False)
    yield made
    assert made.controller.referee.total == 0


def test_the_role_for_plans_is_that_of_operators() -> None:
    assert LEAST_ROLE[Permission.PLAN] is Role.OPERATOR


@pytest.mark.parametrize("user", ["vera", "otto"])
def test_a_viewer_looks_and_an_operator_plans(rig: GuardedRig, user: str) -> None:
    person = rig.user(user)
    may = user == "otto"
    assert person.ask("plans.show") == {"plans": []}
    assert person.ask("plans.samples", plan=1)["code"] == V.PLAN_UNKNOWN
    drop = person.ask("plans.drop", plan=1)
    assert drop["code"] == (V.PLAN_UNKNOWN if may else V.ROLE_TOO_LOW)
    person.take()
    assert person.code(Execute(5, 1, 0)) is (V.PLAN_UNKNOWN if may else V.ROLE_TOO_LOW)


def test_without_a_login_nothing_is_planned_or_executed(rig: GuardedRig) -> None:
    stranger = rig.visitor(LAN)
    for op, fields in (("plans.make", MAKE), ("plans.show", {}), ("plans.drop", {"plan": 1})):
        assert stranger.ask(op, **fields)["code"] == V.LOGIN_NEEDED
    assert stranger.code(Execute(5, 1, 0)) is V.LOGIN_NEEDED


def test_an_execution_counts_in_the_order_of_requests(cell: PlansCell) -> None:
    plan = cell.plan()
    operator = cell.operator
    assert operator.code(Execute(500, plan + 1, 0)) is V.PLAN_UNKNOWN
    assert operator.code(Execute(500, plan, 0)) is V.REQUEST_REPEATED
    assert operator.code(Execute(499, plan, 0)) is V.REQUEST_REPEATED
    assert operator.code(Execute(501, plan, 0)) is V.ACCEPTED


def test_an_execution_that_a_stop_overtook_moves_nothing(cell: PlansCell) -> None:
    plan = cell.plan()
    stop, execute = SoftwareStop(901, "enough"), Execute(900, plan, 0)
    cell.perform(cell.core.handle(StopReceived(cell.operator.session, stop), cell.now))
    cell.operator.reset()
    assert is_overtaken(execute)
    (refused,) = cell.operator.send(Overtaken(execute))
    assert isinstance(refused, Verdict)
    assert refused.code == V.OVERTAKEN_BY_STOP
    cell.wait(100)
    assert cell.handed == []
    assert cell.state_of(plan) == "ready"


@pytest.mark.parametrize("op", ["plans.make", "plans.samples", "plans.show", "plans.drop"])
def test_a_stop_does_not_keep_plans_from_being_made_or_looked_at(op: str) -> None:
    assert not is_overtaken(Management(1, b""), op)


def old(cell: PlansCell) -> Pendant:
    pendant = cell.stranger()
    pendant.hello("old", version=2)
    return pendant


def test_a_connection_of_version_2_knows_no_plans(cell: PlansCell) -> None:
    pendant = old(cell)
    (welcome,) = pendant.all(HelloReply)
    assert Capability.PLANS not in Capability(welcome.capabilities)
    for op in ("plans.make", "plans.show", "plans.samples", "plans.drop"):
        assert pendant.ask(op, plan=1)["code"] == V.BAD_ARGUMENT
    (answer,) = pendant.send(Execute(5, 1, 0))
    assert answer.reply_code == ReplyCode.FAILURE
    cell.plan()
    assert pendant.all(PlanChanged) == []
