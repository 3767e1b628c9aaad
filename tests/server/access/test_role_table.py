"""Who may ask what, written down a second time: the roles of docs/access.md, request by request.

The table of the server is not looked at, so that a request that is moved to a lower role by mistake
is found here.
"""

from __future__ import annotations

import json

import pytest
from rigs.cells.admission_desk import BOOK, account
from rigs.cells.guarded_rig import GuardedRig

from openpendant.server.access.accounts import AccountBook
from openpendant.simplemsg import Message, ReplyCode, joint_array
from openpendant.simplemsg.pendant import (
    AccountRole,
    Authority,
    AuthorityAction,
    Home,
    JogSpace,
    JogStart,
    JointMove,
    Management,
    MotionControl,
    ProgramRun,
    ResetStop,
    SetAccount,
    SetMode,
    SetSpeed,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V

_RISING = ("viewer", "operator", "programmer", "admin")
_USERS = dict(zip(_RISING, ("vera", "otto", "paul", "ann"), strict=True))
_AT = joint_array((0.1, 0.1))


def managed(op: str) -> Management:
    return Management(9, json.dumps({"op": op}).encode())


LEAST: tuple[tuple[str, Message], ...] = (
    ("viewer", Subscribe(9, 10.0)),
    ("operator", Authority(9, AuthorityAction.REQUEST)),
    ("admin", Authority(9, AuthorityAction.FORCE)),
    ("operator", JointMove(9, 0.1, 2, _AT)),
    ("operator", Home(9, 0.1, "home")),
    ("operator", JogStart(9, 1, 0, 0.15, JogSpace.JOINTS, "", 2, _AT)),
    ("operator", SetSpeed(9, 0.5, 0.0)),
    ("operator", MotionControl(9, 1)),
    ("operator", ProgramRun(9, 1, 0, 1, 0, 1.0, "nothing")),
    ("operator", ResetStop(9)),
    ("operator", SetMode(9, 3)),
    ("admin", SetAccount(9, AccountRole.OPERATOR, "new", "a new long password")),
    *(("viewer", managed(op)) for op in ("snapshot", "why", "programs.list", "frames.show")),
    *(("operator", managed(op)) for op in ("signals.set", "recordings.play")),
    *(
        ("programmer", managed(op))
        for op in (
            *("programs.save", "programs.delete", "programs.edit", "programs.record"),
            *("recordings.start", "recordings.delete", "robots.load"),
            *("frames.add", "frames.move", "frames.import"),
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
        if isinstance(answer, Verdict) and answer.code == V.ROLE_TOO_LOW:
            return True
        if isinstance(answer, Management) and answer.reply_code == ReplyCode.FAILURE:
            return bool(json.loads(answer.body).get("code") == V.ROLE_TOO_LOW)
    return False


@pytest.fixture(scope="module")
def rig() -> GuardedRig:
    return GuardedRig(AccountBook([*BOOK, account("paul", Role.PROGRAMMER)]))


@pytest.mark.parametrize(
    ("least", "request_"),
    LEAST,
    ids=[
        json.loads(each.body)["op"] if isinstance(each, Management) else type(each).__name__
        for _, each in LEAST
    ],
)
def test_each_role_from_the_documented_one_up_may_ask_and_none_below(
    rig: GuardedRig, least: str, request_: Message
) -> None:
    may = [
        role
        for role in _RISING
        if not is_refused_for_its_role(rig.user(_USERS[role]).send(request_))
    ]
    assert may == list(_RISING[_RISING.index(least) :])
