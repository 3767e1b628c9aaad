from __future__ import annotations

import json

import pytest
from rigs.cells.admission_desk import BOOK, LAN, LOCAL
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.audit import AuditEntry, AuditEvent
from openpendant.server.events.events import Port
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    JointMove,
    Management,
    StopChanged,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V


def impostor(rig: GuardedRig, name: str = "ann", address: str = LAN) -> Pendant:
    pendant = rig.stranger(Port.PENDANT, address)
    pendant.hello(name)
    pendant.got.clear()
    return pendant


def noted(rig: GuardedRig, event: AuditEvent) -> AuditEntry:
    return [entry for entry in rig.desk.log if entry.event is event][-1]


@pytest.mark.parametrize("address", [LAN, LOCAL])
def test_nobody_signs_a_stop_in_the_audit_log_with_the_name_of_another(
    rig: GuardedRig, address: str
) -> None:
    impostor(rig, address=address).stop("boo")
    entry = noted(rig, AuditEvent.STOP)
    assert (entry.who, entry.role, entry.source) == ("", "", address)
    assert (entry.detail["client"], entry.detail["reason"]) == ("ann", "boo")


def test_what_is_refused_to_whoever_has_not_logged_in_is_noted_with_what_he_calls_himself(
    rig: GuardedRig,
) -> None:
    impostor(rig).move(0.1, 0.0)
    entry = noted(rig, AuditEvent.REFUSED)
    assert (entry.who, entry.detail["client"]) == ("", "ann")


def test_a_failed_login_is_noted_with_what_the_pendant_calls_itself(rig: GuardedRig) -> None:
    pendant = impostor(rig)
    log_in(pendant, "ann", "wrong")
    entry = noted(rig, AuditEvent.LOGIN_FAILED)
    assert (entry.who, entry.detail["client"]) == ("", "ann")


def test_everybody_is_shown_that_whoever_stopped_has_not_logged_in(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    impostor(rig).stop("boo")
    assert ann.all(StopChanged)[-1].client == "ann (not logged in)"
    ann.take()
    assert ann.move(0.1, 0.0) is V.STOP_LATCHED
    assert ann.all(Verdict)[-1].text == "software stop by ann (not logged in): boo"
    ann.send(Management(901, b'{"op": "snapshot"}'))
    answer = ann.all(Management)[-1]
    assert json.loads(answer.body)["stop"]["client"] == "ann (not logged in)"


@pytest.mark.parametrize("name", ["a" * 32, "ü" * 16, "otto (not logged in) "])
def test_a_long_name_cannot_push_the_remark_out_of_the_field(rig: GuardedRig, name: str) -> None:
    ann = rig.user("ann")
    impostor(rig, name).stop()
    assert ann.all(StopChanged)[-1].client.endswith(" (not logged in)")


def test_whoever_gives_no_name_is_shown_without_one(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    impostor(rig, "").stop()
    assert ann.all(StopChanged)[-1].client == ""
    assert noted(rig, AuditEvent.STOP).who == ""


def test_whoever_logs_in_and_out_is_shown_by_his_account_in_between_alone(rig: GuardedRig) -> None:
    watcher, pendant = rig.user("vera"), impostor(rig, "desk 4")
    names = []
    for step in ("comes", "logs in", "logs out"):
        if step == "logs in":
            log_in(pendant, "otto")
        elif step == "logs out":
            log_out(pendant)
        pendant.stop()
        names.append(watcher.all(StopChanged)[-1].client)
        ann = rig.user("ann")
        ann.take()
        ann.reset()
        ann.release()
    assert names == ["desk 4 (not logged in)", "otto", "desk 4 (not logged in)"]


def log_out(pendant: Pendant) -> None:
    pendant.send(Management(902, b'{"op": "access.logout"}'))


@pytest.mark.parametrize("change", ["logs out", "logs in as somebody else"])
def test_the_end_of_the_authority_is_noted_of_who_had_it(rig: GuardedRig, change: str) -> None:
    otto = rig.user("otto")
    otto.take()
    if change == "logs out":
        log_out(otto)
    else:
        log_in(otto, "ann")
    entry = noted(rig, AuditEvent.AUTHORITY_ENDED)
    assert (entry.who, entry.source, entry.session) == ("otto", LAN, otto.session)


def test_a_motion_that_ends_with_the_login_is_noted_of_who_began_it(rig: GuardedRig) -> None:
    otto = rig.user("otto")
    otto.take()
    otto.code(JointMove(950, 1.0, 2, joint_array((1.0, 0.0))))
    log_out(otto)
    entry = noted(rig, AuditEvent.MOTION_ENDED)
    assert (entry.who, entry.session) == ("otto", otto.session)


def test_without_accounts_a_pendant_is_called_as_it_says() -> None:
    rig = GuardedRig(AccountBook())
    rig.desk.login.single_user_host = True
    one, other = (impostor(rig, name, LOCAL) for name in ("bench 1", "bench 2"))
    one.take()
    other.stop()
    assert [news.client for news in other.all(AuthorityChanged)] == ["bench 1"]
    assert one.all(StopChanged)[-1].client == "bench 2"
    assert noted(rig, AuditEvent.STOP).who == "bench 2"


def test_with_the_first_account_the_name_of_the_single_user_is_a_claim() -> None:
    rig = GuardedRig(AccountBook())
    rig.desk.login.single_user_host = True
    bench = impostor(rig, "ann", LOCAL)
    rig.follow(BOOK)
    bench.stop()
    assert bench.all(StopChanged)[-1].client == "ann (not logged in)"
    assert noted(rig, AuditEvent.STOP).who == ""
