from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from rigs.cells.admission_desk import BOOK, LAN, LOCAL, account
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.clock.busy_machine import PATIENCE
from rigs.peers.server_clients import Pendant
from rigs.processes.guarded_server import served_operator

from openpendant.server.access import admission
from openpendant.server.access.accounts import Account, AccountBook
from openpendant.server.access.passwords import PasswordHash
from openpendant.server.cli.users_commands import main as users_main
from openpendant.simplemsg import CommType
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    AuthorityReason,
    Login,
    LoginKind,
    Management,
    Outcome,
    OutcomeKind,
    Pairing,
    PairingAction,
    PairingReply,
    SoftwareStop,
    State,
    StopChanged,
)
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import Refused


def guest(rig: GuardedRig, teacher: Pendant, address: str = LAN) -> Pendant:
    (reply,) = teacher.send(Pairing(5, PairingAction.ISSUE))
    assert isinstance(reply, PairingReply)
    paired = rig.visitor(address, state_rate=50)
    request = Login(1, LoginKind.PAIRING, "Mia", reply.code)
    assert paired.code(request) is V.ACCEPTED
    paired.got.clear()
    return paired


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
def test_whoever_loses_his_login_hears_that_he_has_lost_control_and_may_not_look_on(
    rig: GuardedRig, how: str
) -> None:
    otto = rig.user("otto")
    otto.take()
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


def test_a_guest_hears_that_the_lesson_is_over_and_nothing_after_that(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    mia = guest(rig, ann)
    mia.take()
    assert ann.code(Pairing(6, PairingAction.WITHDRAW)) is V.ACCEPTED
    assert [news.holder for news in mia.all(AuthorityChanged)] == [mia.session, 0]
    assert "the lesson is over" in sent_away(mia)[-1].text
    mia.got.clear()
    rig.wait(200)
    ann.stop()
    assert mia.got == []


def test_a_guest_without_control_hears_that_the_lesson_is_over(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    mia = guest(rig, ann)
    ann.code(Pairing(6, PairingAction.WITHDRAW))
    assert len(sent_away(mia)) == 1


def test_whoever_may_still_look_on_goes_on_looking_on(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    mia = guest(rig, ann, LOCAL)
    ann.code(Pairing(6, PairingAction.WITHDRAW))
    assert sent_away(mia) == []
    rig.wait(200)
    assert mia.all(State)


def log_out(rig: GuardedRig, otto: Pendant) -> None:
    otto.send(Management(7, b'{"op": "access.logout"}'))


def log_in_anew(rig: GuardedRig, otto: Pendant) -> None:
    log_in(otto, "vera")


def promote(rig: GuardedRig, otto: Pendant) -> None:
    rig.follow(AccountBook([*BOOK, account("otto", Role.PROGRAMMER)]))


@pytest.mark.parametrize(
    ("change", "times"),
    [(log_out, 1), (log_in_anew, 0), (promote, 0)],
    ids=["logs out", "logs in as somebody else", "has another role"],
)
def test_only_who_may_not_look_on_any_more_is_sent_away(
    rig: GuardedRig, change: Callable[[GuardedRig, Pendant], None], times: int
) -> None:
    otto = rig.user("otto")
    change(rig, otto)
    assert len(sent_away(otto)) == times


def test_whoever_was_sent_away_is_told_why_with_each_refusal(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    mia = guest(rig, ann)
    ann.code(Pairing(6, PairingAction.WITHDRAW))
    mia.take()
    (_, code), text = mia.verdicts()[-1], mia.got[-1]
    assert code is V.LOGIN_NEEDED
    assert "the lesson is over" in getattr(text, "text", "")


def test_whoever_was_sent_away_may_stop_and_log_in_again(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    mia = guest(rig, ann)
    ann.code(Pairing(6, PairingAction.WITHDRAW))
    assert mia.code(SoftwareStop(7, "still here")) is V.ACCEPTED
    assert log_in(mia, "vera") is V.ACCEPTED
    ann.reset()
    ann.take()
    ann.reset()
    assert mia.all(StopChanged)[-1].client == "ann"


@pytest.mark.realtime
@pytest.mark.asyncio
async def test_a_client_on_another_machine_ends_its_wait_when_its_account_is_disabled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over sockets, whose addresses count as another machine's."""
    monkeypatch.setattr(admission, "is_loopback", lambda address: False)
    async with served_operator(tmp_path) as (server, otto):
        await otto.next_state()
        await otto.take_control()
        assert users_main(["disable", "otto", "--store", str(server.store)]) == 0
        with pytest.raises(Refused, match=r"LOGIN_NEEDED.*log in again"):
            await otto.wait_until(lambda state: False, within=PATIENCE)
        assert not otto.in_control
        await otto.stop("nobody is in control")
