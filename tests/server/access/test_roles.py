"""Who may ask what, written down a second time: the roles of docs/access.md, request by request.

The table of the server is not looked at there, so that a request that is moved to a lower role by
mistake is found here. And which requests a stop overtakes.
"""

import json

import pytest
from rigs.cells.admission_desk import BOOK, account
from rigs.cells.expectations import expect
from rigs.cells.guarded_rig import GuardedRig
from rigs.peers.server_clients import Pendant, hello

from openpendant.server.access.accounts import AccountBook, AccountChange
from openpendant.server.access.audit import AuditEvent
from openpendant.server.access.request_gate import (
    FREE,
    OF_MESSAGE,
    OVERTAKEN,
    TOPICS,
    is_overtaken,
    needs_of,
)
from openpendant.server.events.management_requests import parse
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import (
    CommType,
    JointTrajPt,
    Message,
    Ping,
    ReplyCode,
    joint_array,
    refused,
)
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.declaration import Direction
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import LEAST_ROLE, Permission, Role
from openpendant.simplemsg.verdicts import VerdictCode as V

_BY_ROLE = {"vera": 1, "otto": 2, "ann": 4}


@pytest.mark.parametrize("op", sorted(OPERATIONS))
def test_a_management_request_is_refused_where_the_role_is_too_low(
    rig: GuardedRig, op: str
) -> None:
    needed = OPERATIONS[op].NEEDS
    too_low = needed is not None and LEAST_ROLE[needed].value != "viewer"
    code = rig.user("vera").ask(op).get("code")
    assert (code == V.ROLE_TOO_LOW) == too_low


def test_promise_19_whoever_said_hello_may_stop_and_nothing_else(rig: GuardedRig) -> None:
    visitor = rig.visitor()
    codes = {visitor.code(each) for _, each in LEAST if not isinstance(each, messages.Management)}
    assert codes == {V.LOGIN_NEEDED}
    assert visitor.ask("snapshot")["code"] == V.LOGIN_NEEDED
    assert visitor.move(0.5, 0.0) is V.LOGIN_NEEDED
    assert visitor.stop() is V.ACCEPTED


def test_a_refused_role_is_noted_with_the_permission_that_was_wanted(rig: GuardedRig) -> None:
    rig.user("vera").take()
    (entry,) = [each for each in rig.desk.log if each.event is AuditEvent.REFUSED]
    assert (entry.who, entry.detail) == ("vera", {"wanted": "move", "code": 134})


def test_only_what_tells_of_nobody_but_who_asks_needs_no_permission() -> None:
    free = {op for op, kind in OPERATIONS.items() if kind.NEEDS is None}
    assert free == {"access.whoami", "access.logout", "access.exposure"}


def test_an_operation_that_nobody_listed_needs_the_highest_role() -> None:
    assert needs_of("new.thing") is Permission.MANAGE_USERS


_FROM_PENDANTS = {
    cls
    for cls in messages.PENDANT_MESSAGES
    if cls.PLACE.direction in (Direction.TO_SERVER, Direction.BOTH) and not cls.PLACE.is_reply
}


def _default_kind(cls: type[Message]) -> object:
    return cls.__dataclass_fields__["comm_type"].default


def test_every_message_of_a_pendant_is_in_exactly_one_table() -> None:
    """Every declared one: a request has a permission or is free, a topic is listed."""
    requests = {cls for cls in _FROM_PENDANTS if _default_kind(cls) == CommType.REQUEST}
    assert requests - {messages.Management} == set(OF_MESSAGE) | FREE
    assert _FROM_PENDANTS - requests == TOPICS
    assert not set(OF_MESSAGE) & FREE


FOREIGN = (JointTrajPt(0, joint_array((0.5, 0.5)), 0.1, 0.5), messages.WriteOutputs(0, 1, 1))


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
    about = rig.user("otto").ask("access.whoami")
    assert (about["name"], about["role"], about["basis"]) == ("otto", "operator", "account")
    assert "move" in about["permissions"]
    assert "edit-program" not in about["permissions"]
    assert rig.visitor().ask("access.whoami")["permissions"] == ["stop"]


def test_logging_out_gives_back_the_authority(rig: GuardedRig, otto: Pendant) -> None:
    otto.ask("access.logout")
    assert rig.core.cell.authority.holder is None
    assert otto.take() is V.LOGIN_NEEDED


def test_an_admin_sees_who_is_connected_and_who_has_an_account(rig: GuardedRig) -> None:
    ann, _ = rig.user("ann"), rig.visitor()
    sessions = ann.ask("access.sessions")["sessions"]
    assert [each["name"] for each in sessions] == ["ann", ""]
    users = ann.ask("users.list")["users"]
    assert [user["name"] for user in users] == ["ann", "gone", "otto", "vera"]
    assert "digest" not in json.dumps(users)


def test_an_admin_sees_the_accounts_that_cannot_be_read(rig: GuardedRig) -> None:
    rig.follow(AccountBook(BOOK, {"eve": "role: Field required"}))
    listed = rig.user("ann").ask("users.list")
    assert "eve" not in [user["name"] for user in listed["users"]]
    assert listed["unreadable"] == [{"name": "eve", "problem": "role: Field required"}]


def test_a_change_of_an_account_is_answered_when_it_was_made(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    request = messages.SetAccount(8, messages.AccountRole.OPERATOR, "new", "a canary password")
    assert ann.code(request) is None
    (wanted,) = rig.changes
    change = expect(AccountChange, wanted.question)
    assert (change.author, change.name) == ("ann", "new")
    assert "canary" not in repr(wanted)
    rig.answered(wanted, None)
    assert ann.verdicts()[-1] == (8, V.ACCEPTED)
    assert rig.noted(AuditEvent.ACCOUNT_CHANGED) == ["ann"]


def test_a_change_that_the_store_refuses_is_refused_in_its_words(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    request = messages.Management(9, json.dumps({"op": "users.remove", "name": "ann"}).encode())
    ann.send(request)
    refusal = Refusal(V.LAST_ADMIN, "'ann' is the only admin")
    rig.answered(rig.changes[0], refusal)
    answer = json.loads(ann.all(messages.Management)[-1].body)
    assert (answer["code"], answer["text"]) == (V.LAST_ADMIN, "'ann' is the only admin")
    assert rig.noted(AuditEvent.ACCOUNT_CHANGED) == []


_RISING = ("viewer", "operator", "programmer", "admin")
_USERS = dict(zip(_RISING, ("vera", "otto", "paul", "ann"), strict=True))


JOINTS = joint_array((0.1, 0.1))


def managed(op: str) -> messages.Management:
    return messages.Management(9, json.dumps({"op": op}).encode())


LEAST: tuple[tuple[str, Message], ...] = (
    ("viewer", messages.Subscribe(9, 10.0)),
    ("operator", messages.Authority(9, messages.AuthorityAction.REQUEST)),
    ("admin", messages.Authority(9, messages.AuthorityAction.FORCE)),
    ("operator", messages.JointMove(9, 0.1, 2, JOINTS)),
    ("operator", messages.Home(9, 0.1, "home")),
    ("operator", messages.JogStart(9, 1, 0, 0.15, messages.JogSpace.JOINTS, "", 2, JOINTS)),
    ("operator", messages.SetSpeed(9, 0.5, 0.0)),
    ("operator", messages.MotionControl(9, 1)),
    ("operator", messages.ProgramRun(9, 1, 0, 1, 0, 1.0, "nothing")),
    ("operator", messages.ResetStop(9)),
    ("operator", messages.SetMode(9, 3)),
    ("admin", messages.Pairing(9, messages.PairingAction.ISSUE)),
    ("admin", messages.SetAccount(9, messages.AccountRole.OPERATOR, "new", "a new long password")),
    *(("viewer", managed(op)) for op in ("snapshot", "why", "programs.list", "frames.show")),
    ("viewer", managed("positions.list")),
    *(("operator", managed(op)) for op in ("signals.set", "recordings.play")),
    *(
        ("programmer", managed(op))
        for op in (
            *("programs.save", "programs.delete", "programs.edit", "programs.record"),
            *("recordings.start", "recordings.delete", "robots.load"),
            *("frames.add", "frames.move", "frames.import"),
            *("positions.save", "positions.rename", "positions.delete"),
            *("tools.select", "tools.move", "tools.import"),
            *("scene.add", "scene.remove", "scene.allow", "scene.attach", "scene.import"),
        )
    ),
    *(
        ("admin", managed(op))
        for op in ("access.sessions", "users.list", "users.remove", "users.set_role")
    ),
)


def is_refused_for_its_role(answers: list[Message]) -> bool:
    for answer in answers:
        if isinstance(answer, messages.Verdict) and answer.code == V.ROLE_TOO_LOW:
            return True
        if isinstance(answer, messages.Management) and answer.reply_code == ReplyCode.FAILURE:
            return bool(json.loads(answer.body).get("code") == V.ROLE_TOO_LOW)
    return False


@pytest.fixture(scope="module")
def whole_rig() -> GuardedRig:
    return GuardedRig(AccountBook([*BOOK, account("paul", Role.PROGRAMMER)]))


@pytest.mark.parametrize(
    ("least", "request_"),
    LEAST,
    ids=[
        json.loads(each.body)["op"]
        if isinstance(each, messages.Management)
        else type(each).__name__
        for _, each in LEAST
    ],
)
def test_each_role_from_the_documented_one_up_may_ask_and_none_below(
    whole_rig: GuardedRig, least: str, request_: Message
) -> None:
    may = [
        role
        for role in _RISING
        if not is_refused_for_its_role(whole_rig.user(_USERS[role]).send(request_))
    ]
    assert may == list(_RISING[_RISING.index(least) :])


REQUEST = CommType.REQUEST
MOVING = {
    *("recordings.play", "scene.attach", "scene.detach", "signals.set"),
    *("tools.import", "tools.select"),
}


def named(message: Message) -> str:
    return parse(message.body)[0] if isinstance(message, messages.Management) else ""


def test_it_is_decided_for_every_permission() -> None:
    assert OVERTAKEN.keys() == set(Permission)


def test_what_is_in_no_table_is_overtaken(monkeypatch: pytest.MonkeyPatch) -> None:
    assert is_overtaken(managed(""), "robots.explode")
    monkeypatch.delitem(OF_MESSAGE, messages.SetMode)
    assert is_overtaken(messages.SetMode(1, messages.OperatingMode.AUTOMATIC))


@pytest.mark.parametrize(
    "message",
    [
        messages.Authority(1, messages.AuthorityAction.REQUEST),
        messages.Authority(1, messages.AuthorityAction.FORCE),
        messages.JointMove(1, 0.5, 2, JOINTS),
        messages.Home(1, 0.5, "home"),
        messages.JogStart(1, 1, 1, 0.15, messages.JogSpace.JOINTS, "", 2, JOINTS),
        messages.SetSpeed(1, 0.5, 0.0),
        messages.SetMode(1, messages.OperatingMode.AUTOMATIC),
        messages.ResetStop(1),
        messages.MotionControl(1, messages.MotionControlAction.RESUME),
        *(managed(op) for op in sorted(MOVING)),
    ],
)
def test_what_would_undo_a_stop_is_overtaken(message: Message) -> None:
    assert is_overtaken(message, named(message))


@pytest.mark.parametrize(
    "message",
    [
        hello(),
        messages.Subscribe(1, 10.0),
        messages.SoftwareStop(1, ""),
        messages.JogRelease(1, 1),
        messages.Authority(1, messages.AuthorityAction.RELEASE),
        messages.MotionControl(1, messages.MotionControlAction.PAUSE),
        messages.MotionControl(1, messages.MotionControlAction.PROGRAM_STOP),
        Ping(comm_type=REQUEST),
        *(managed(op) for op in ("snapshot", "programs.save", "programs.dry_run")),
        *(managed(op) for op in ("recordings.start", "access.logout")),
    ],
)
def test_what_moves_nothing_is_not(message: Message) -> None:
    assert not is_overtaken(message, named(message))


def test_every_operation_that_moves_is_overtaken_and_no_other() -> None:
    assert {op for op in OPERATIONS if is_overtaken(managed(""), op)} == MOVING
