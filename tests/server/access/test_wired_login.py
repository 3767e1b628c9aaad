"""Logging in and out at the pendant face: promises 19, 28 and 29, exact on the rig's clock."""

from collections.abc import Callable
from pathlib import Path

import pytest
from rigs.cells.admission_desk import BOOK, LAN, LOCAL, account
from rigs.cells.expectations import only
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.clock.busy_machine import PATIENCE
from rigs.peers.server_clients import Pendant
from rigs.processes.guarded_server import served_operator

from openpendant.server.access import request_gate
from openpendant.server.access.accounts import Account, AccountBook
from openpendant.server.access.audit import AuditEvent
from openpendant.server.access.passwords import PasswordHash
from openpendant.server.cli.users_commands import main as users_main
from openpendant.simplemsg import CommType, Message
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    AuthorityReason,
    Login,
    LoginKind,
    Outcome,
    OutcomeKind,
    Pairing,
    PairingAction,
    PairingReply,
    SoftwareStop,
    State,
    StopChanged,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import Refused


def test_whoever_logs_in_may_take_the_authority_as_his_account(rig: GuardedRig) -> None:
    otto = rig.user("otto")
    assert otto.take() is V.ACCEPTED
    assert [news.client for news in otto.all(AuthorityChanged)] == ["otto"]


def test_a_password_is_checked_while_the_robot_can_be_stopped(rig: GuardedRig) -> None:
    rig.checks_at_once = False
    visitor = rig.visitor()
    assert log_in(visitor, "otto") is None
    assert visitor.stop() is V.ACCEPTED
    rig.answer_checks()
    assert visitor.verdicts()[-1] == (900, V.ACCEPTED)


def test_promise_29_five_wrong_passwords_lock_logging_in_and_nothing_else(rig: GuardedRig) -> None:
    visitor = rig.visitor()
    codes = [log_in(visitor, "otto", "not it") for _ in range(6)]
    assert codes == [V.LOGIN_FAILED] * 5 + [V.LOCKED_OUT]
    assert visitor.take() is V.LOGIN_NEEDED
    assert log_in(visitor, "otto") is V.LOCKED_OUT
    assert visitor.stop() is V.ACCEPTED
    assert rig.core.cell.stop is not None
    rig.wait(61_000)
    late = rig.visitor()
    assert log_in(late, "otto") is V.ACCEPTED


def test_a_verdict_to_whoever_left_meanwhile_goes_nowhere(rig: GuardedRig) -> None:
    rig.checks_at_once = False
    visitor = rig.visitor()
    log_in(visitor, "otto")
    visitor.close()
    rig.answer_checks()
    late = rig.visitor()
    assert late.take() is V.LOGIN_NEEDED


def test_a_login_that_waits_for_a_minute_keeps_its_silent_connection(rig: GuardedRig) -> None:
    rig.checks_at_once = False
    waiting, silent = rig.visitor(), rig.visitor()
    log_in(waiting, "otto")
    rig.wait(75_000)
    assert silent.closed_for
    assert waiting.closed_for == []
    rig.answer_checks()
    assert waiting.verdicts()[-1] == (900, V.ACCEPTED)
    rig.wait(round(rig.settings.pendants.idle_timeout * 1_000) + 20)
    assert waiting.closed_for


def test_a_login_whose_connection_ends_leaves_the_queue_and_is_no_attempt(rig: GuardedRig) -> None:
    rig.checks_at_once = False
    for _ in range(10):
        visitor = rig.visitor()
        log_in(visitor, "otto", "not it")
        visitor.close()
        assert rig.checks == []
    rig.checks_at_once = True
    assert log_in(rig.visitor(), "otto") is V.ACCEPTED


def test_a_check_that_was_begun_counts_though_its_connection_ended(rig: GuardedRig) -> None:
    for _ in range(5):
        rig.checks_at_once = False
        visitor = rig.visitor()
        log_in(visitor, "otto", "not it")
        begun = rig.checks.pop()
        visitor.close()
        rig.answered(begun, False)
    rig.checks_at_once = True
    assert log_in(rig.visitor(), "otto") is V.LOCKED_OUT


def test_promise_28_a_login_is_no_use_to_another_connection(rig: GuardedRig) -> None:
    rig.user("otto")
    other = rig.visitor()
    assert other.take() is V.LOGIN_NEEDED


def test_logging_in_as_somebody_else_gives_the_authority_back(
    rig: GuardedRig, otto: Pendant
) -> None:
    assert otto.move(1.0, 0.0) is V.ACCEPTED
    log_in(otto, "ann")
    assert rig.core.cell.authority.holder is None
    assert otto.outcomes()[-1][1] is V.AUTHORITY_LOST
    assert otto.all(AuthorityChanged)[-1].reason == AuthorityReason.LOGGED_OUT


@pytest.mark.parametrize(
    ("after", "reason", "word", "code"),
    [
        (account("otto", Role.VIEWER), AuthorityReason.ROLE_LOST, "role lost", V.ROLE_TOO_LOW),
        (
            account("otto", Role.OPERATOR, disabled=True),
            *(AuthorityReason.LOGGED_OUT, "logged out", V.LOGIN_NEEDED),
        ),
    ],
)
def test_who_loses_the_authority_is_told_whether_it_was_for_the_role_or_the_login(
    rig: GuardedRig, otto: Pendant, after: Account, reason: AuthorityReason, word: str, code: V
) -> None:
    otto.move(1.0, 0.0)
    ann = rig.user("ann")
    rig.follow(AccountBook([*BOOK, after]))
    assert ann.all(AuthorityChanged)[-1].reason == reason
    (ended,) = otto.all(Outcome)[:1]
    assert (ended.code, ended.text) == (V.AUTHORITY_LOST, f"the motion authority ended: {word}")
    assert otto.take() is code


def test_a_promotion_does_not_stop_the_motion(rig: GuardedRig, otto: Pendant) -> None:
    otto.move(1.0, 0.0)
    rig.follow(AccountBook([*BOOK, account("otto", Role.PROGRAMMER)]))
    rig.wait(5_000)
    assert otto.outcomes()[-1][1] is V.ACCEPTED


def test_who_comes_from_outside_sees_the_state_only_after_the_login(rig: GuardedRig) -> None:
    visitor = rig.visitor(state_rate=50)
    rig.wait(200)
    assert visitor.all(State) == []
    assert visitor.code(Subscribe(1, 25.0)) is V.LOGIN_NEEDED
    log_in(visitor, "vera")
    rig.wait(200)
    assert len(visitor.all(State)) >= 8


def test_who_is_on_the_machine_looks_on_without_a_login(rig: GuardedRig) -> None:
    visitor = rig.visitor(LOCAL, state_rate=50)
    rig.wait(200)
    assert visitor.all(State)


@pytest.mark.parametrize(
    "message", [Login(7, 3, "otto", "otto's password"), Pairing(7, 9)], ids=["login", "pairing"]
)
def test_an_unknown_kind_is_refused_with_the_known(rig: GuardedRig, message: Message) -> None:
    answer = only(Verdict, rig.user("ann").send(message))
    assert answer.code == V.BAD_ARGUMENT
    assert "accepted: 1" in answer.text


def test_logins_are_noted_by_name_and_failures_without_what_was_typed(rig: GuardedRig) -> None:
    visitor = rig.visitor()
    log_in(visitor, "hunter2 typed here", "canary")
    log_in(visitor, "otto")
    assert rig.noted(AuditEvent.LOGIN) == ["otto"]
    assert len(rig.noted(AuditEvent.LOGIN_FAILED)) == 1
    assert "hunter2" not in repr(rig.desk.log)


def guest(rig: GuardedRig, teacher: Pendant, address: str = LAN) -> Pendant:
    reply = only(PairingReply, teacher.send(Pairing(5, PairingAction.ISSUE)))
    paired = rig.visitor(address, state_rate=50)
    request = Login(1, LoginKind.PAIRING, "Mia", reply.code)
    assert paired.code(request) is V.ACCEPTED
    paired.got.clear()
    return paired


def lesson_that_is_over(rig: GuardedRig, address: str = LAN) -> tuple[Pendant, Pendant]:
    ann = rig.user("ann")
    mia = guest(rig, ann, address)
    assert ann.code(Pairing(6, PairingAction.WITHDRAW)) is V.ACCEPTED
    return ann, mia


def sent_away(pendant: Pendant) -> list[Outcome]:
    return [outcome for outcome in pendant.all(Outcome) if outcome.request_id == 0]


OTHER_PASSWORD = PasswordHash(salt="cd" * 16, digest="0" * 64)
AFTER: dict[str, Account | None] = {
    "disabled": account("otto", Role.OPERATOR, disabled=True),
    "another password": account("otto", Role.OPERATOR).model_copy(
        update={"password": OTHER_PASSWORD}
    ),
    "removed": None,
}


@pytest.mark.parametrize("how", AFTER)
def test_whoever_loses_his_login_hears_that_and_may_not_look_on(
    rig: GuardedRig, otto: Pendant, how: str
) -> None:
    otto.got.clear()
    others = [each for each in BOOK if each.name != "otto"]
    after = AFTER[how]
    rig.follow(AccountBook(others if after is None else [*others, after]))
    (lost,) = otto.all(AuthorityChanged)
    assert (lost.holder, lost.reason) == (0, AuthorityReason.LOGGED_OUT)
    (told,) = sent_away(otto)
    assert (told.comm_type, told.outcome) == (CommType.TOPIC, OutcomeKind.ABORTED)
    assert told.code == V.LOGIN_NEEDED
    assert "the account was changed; log in again" in told.text
    assert otto.take() is V.LOGIN_NEEDED


def test_a_guest_hears_that_the_lesson_is_over_and_nothing_after_that(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    mia = guest(rig, ann)
    assert mia.take() is V.ACCEPTED
    assert ann.code(Pairing(6, PairingAction.WITHDRAW)) is V.ACCEPTED
    assert rig.core.cell.authority.holder is None
    assert [news.holder for news in mia.all(AuthorityChanged)] == [mia.session, 0]
    assert "the lesson is over" in sent_away(mia)[-1].text
    mia.got.clear()
    rig.wait(200)
    ann.stop()
    assert mia.got == []


def test_whoever_may_still_look_on_goes_on_looking_on(rig: GuardedRig) -> None:
    _, mia = lesson_that_is_over(rig, LOCAL)
    assert sent_away(mia) == []
    rig.wait(200)
    assert mia.all(State)


def promote(rig: GuardedRig, otto: Pendant) -> None:
    rig.follow(AccountBook([*BOOK, account("otto", Role.PROGRAMMER)]))


@pytest.mark.parametrize(
    ("change", "times"),
    [
        (lambda _, otto: otto.ask("access.logout"), 1),
        (lambda _, otto: log_in(otto, "vera"), 0),
        (promote, 0),
    ],
    ids=["logs out", "logs in as somebody else", "has another role"],
)
def test_only_who_may_not_look_on_any_more_is_sent_away(
    rig: GuardedRig, change: Callable[[GuardedRig, Pendant], object], times: int
) -> None:
    otto = rig.user("otto")
    change(rig, otto)
    assert len(sent_away(otto)) == times


def test_whoever_was_sent_away_is_told_why_with_each_refusal(rig: GuardedRig) -> None:
    _, mia = lesson_that_is_over(rig)
    assert len(sent_away(mia)) == 1
    mia.take()
    (_, code), text = mia.verdicts()[-1], mia.got[-1]
    assert code is V.LOGIN_NEEDED
    assert "the lesson is over" in getattr(text, "text", "")


def test_whoever_was_sent_away_may_stop_and_log_in_again(rig: GuardedRig) -> None:
    ann, mia = lesson_that_is_over(rig)
    assert mia.code(SoftwareStop(7, "still here")) is V.ACCEPTED
    assert log_in(mia, "vera") is V.ACCEPTED
    ann.reset()
    ann.take()
    ann.reset()
    assert mia.all(StopChanged)[-1].client == "ann"


@pytest.mark.realtime
async def test_a_client_on_another_machine_ends_its_wait_when_its_account_is_disabled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over sockets, whose addresses count as another machine's, by a command beside the server."""
    monkeypatch.setattr(request_gate, "is_loopback", lambda address: False)
    async with served_operator(tmp_path) as (server, otto):
        await otto.next_state()
        await otto.take_control()
        assert users_main(["disable", "otto", "--store", str(server.store)]) == 0
        with pytest.raises(Refused, match=r"LOGIN_NEEDED.*log in again"):
            await otto.wait_until(lambda state: False, within=PATIENCE)
        assert not otto.in_control
        assert server.app.cells[0].core.cell.authority.holder is None
        with pytest.raises(Refused, match="LOGIN_NEEDED"):
            await otto.take_control()
        await otto.stop("nobody is in control")
