from __future__ import annotations

import json
from typing import Any

import pytest
from rigs.cells.admission_desk import BOOK
from rigs.cells.guarded_rig import GuardedRig
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import AccountBook, AccountChange
from openpendant.server.access.audit import AuditEvent
from openpendant.server.access.request_gate import FREE, OF_MESSAGE, TOPICS, needs_of
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import CommType, JointTrajPt, Message, ReplyCode, joint_array, refused
from openpendant.simplemsg.declaration import Direction
from openpendant.simplemsg.pendant import (
    PENDANT_MESSAGES,
    AccountRole,
    Authority,
    AuthorityAction,
    Management,
    MotionControl,
    ProgramRun,
    ResetStop,
    SetAccount,
    SetMode,
    SetSpeed,
    WriteOutputs,
)
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import LEAST_ROLE, Permission
from openpendant.simplemsg.verdicts import VerdictCode as V

_BY_ROLE = {"vera": 1, "otto": 2, "ann": 4}


def asked(pendant: Pendant, **body: object) -> dict[str, Any]:
    request = Management(77, json.dumps(body).encode())
    (answer,) = [each for each in pendant.send(request) if isinstance(each, Management)]
    found: dict[str, Any] = json.loads(answer.body)
    return found


REQUESTS: tuple[Message, ...] = (
    Authority(1, AuthorityAction.REQUEST),
    Authority(1, AuthorityAction.FORCE),
    ResetStop(1),
    SetMode(1, 3),
    SetSpeed(1, 0.5, 0.0),
    MotionControl(1, 1),
    ProgramRun(1, 1, 0, 1, 0, 1.0, "nothing"),
    SetAccount(1, AccountRole.OPERATOR, "new", "a new long password"),
)


@pytest.mark.parametrize("op", sorted(OPERATIONS))
def test_a_management_request_is_refused_for_the_role_exactly_where_it_is_too_low(
    rig: GuardedRig, op: str
) -> None:
    needed = OPERATIONS[op].NEEDS
    too_low = needed is not None and LEAST_ROLE[needed].value != "viewer"
    code = asked(rig.user("vera"), op=op).get("code")
    assert (code == V.ROLE_TOO_LOW) == too_low


def test_promise_19_whoever_said_hello_may_stop_and_nothing_else(rig: GuardedRig) -> None:
    visitor = rig.visitor()
    codes = {visitor.code(request) for request in REQUESTS}
    assert codes == {V.LOGIN_NEEDED}
    assert asked(visitor, op="snapshot")["code"] == V.LOGIN_NEEDED
    assert visitor.move(0.5, 0.0) is V.LOGIN_NEEDED
    assert visitor.stop() is V.ACCEPTED


def test_a_refused_role_is_noted_with_the_permission_that_was_wanted(rig: GuardedRig) -> None:
    rig.user("vera").take()
    (entry,) = [each for each in rig.desk.log if each.event is AuditEvent.REFUSED]
    assert (entry.who, entry.detail) == ("vera", {"wanted": "move", "code": 134})


def test_only_what_is_about_nobody_but_who_asks_needs_no_permission() -> None:
    free = {op for op, kind in OPERATIONS.items() if kind.NEEDS is None}
    assert free == {"access.whoami", "access.logout"}


def test_an_operation_that_nobody_listed_needs_the_highest_role() -> None:
    assert needs_of("new.thing") is Permission.MANAGE_USERS


_FROM_PENDANTS = {
    cls
    for cls in PENDANT_MESSAGES
    if cls.PLACE.direction in (Direction.TO_SERVER, Direction.BOTH) and not cls.PLACE.is_reply
}


def _default_kind(cls: type[Message]) -> object:
    return cls.__dataclass_fields__["comm_type"].default


def test_every_message_of_a_pendant_is_in_exactly_one_table() -> None:
    """Every declared one: a request has a permission or is free, a topic is listed."""
    requests = {cls for cls in _FROM_PENDANTS if _default_kind(cls) == CommType.REQUEST}
    assert requests - {Management} == set(OF_MESSAGE) | FREE
    assert _FROM_PENDANTS - requests == TOPICS
    assert not set(OF_MESSAGE) & FREE


FOREIGN = (JointTrajPt(0, joint_array((0.5, 0.5)), 0.1, 0.5), WriteOutputs(0, 1, 1))


@pytest.mark.parametrize("message", FOREIGN, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("name", ["", *_BY_ROLE])
def test_a_message_of_another_face_is_unknown_here_whoever_sends_it(
    rig: GuardedRig, name: str, message: Message
) -> None:
    """No set-point goes round the roles by coming on the pendant port."""
    pendant = rig.user(name) if name else rig.visitor()
    (answer,) = pendant.send(message)
    assert (type(answer), answer.reply_code) == (type(refused(message)), ReplyCode.FAILURE)


def test_whoami_tells_role_and_permissions(rig: GuardedRig) -> None:
    about = asked(rig.user("otto"), op="access.whoami")
    assert (about["name"], about["role"], about["basis"]) == ("otto", "operator", "account")
    assert "move" in about["permissions"]
    assert "edit-program" not in about["permissions"]
    assert asked(rig.visitor(), op="access.whoami")["permissions"] == ["stop"]


def test_logging_out_gives_back_the_authority(rig: GuardedRig) -> None:
    otto = rig.user("otto")
    otto.take()
    asked(otto, op="access.logout")
    assert rig.core.cell.authority.holder is None
    assert otto.take() is V.LOGIN_NEEDED


def test_an_admin_sees_who_is_connected_and_who_has_an_account(rig: GuardedRig) -> None:
    ann, _ = rig.user("ann"), rig.visitor()
    sessions = asked(ann, op="access.sessions")["sessions"]
    assert [each["name"] for each in sessions] == ["ann", ""]
    users = asked(ann, op="users.list")["users"]
    assert [user["name"] for user in users] == ["ann", "gone", "otto", "vera"]
    assert "digest" not in json.dumps(users)


def test_an_admin_sees_the_accounts_that_cannot_be_read(rig: GuardedRig) -> None:
    rig.follow(AccountBook(BOOK, {"eve": "role: Field required"}))
    listed = asked(rig.user("ann"), op="users.list")
    assert "eve" not in [user["name"] for user in listed["users"]]
    assert listed["unreadable"] == [{"name": "eve", "problem": "role: Field required"}]


def test_a_change_of_an_account_is_answered_when_it_was_made(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    assert ann.code(SetAccount(8, AccountRole.OPERATOR, "new", "a canary password")) is None
    (wanted,) = rig.changes
    assert isinstance(wanted.question, AccountChange)
    assert (wanted.question.author, wanted.question.name) == ("ann", "new")
    assert "canary" not in repr(wanted)
    rig.answered(wanted, None)
    assert ann.verdicts()[-1] == (8, V.ACCEPTED)
    assert rig.noted(AuditEvent.ACCOUNT_CHANGED) == ["ann"]


def test_a_change_that_the_store_refuses_is_refused_in_its_words(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    request = Management(9, json.dumps({"op": "users.remove", "name": "ann"}).encode())
    ann.send(request)
    refusal = Refusal(V.LAST_ADMIN, "'ann' is the only admin")
    rig.answered(rig.changes[0], refusal)
    answer = json.loads(ann.all(Management)[-1].body)
    assert (answer["code"], answer["text"]) == (V.LAST_ADMIN, "'ann' is the only admin")
    assert rig.noted(AuditEvent.ACCOUNT_CHANGED) == []
