import pytest
from rigs.cells.admission_desk import BOOK, LAN, LOCAL
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.audit import AuditEntry, AuditEvent, ChainCheck, Link, write_line
from openpendant.server.events.events import Port
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V


def entries(rig: GuardedRig, *events: AuditEvent) -> list[AuditEntry]:
    return [entry for entry in rig.desk.log if entry.event in events]


def told(rig: GuardedRig, *events: AuditEvent) -> list[tuple[AuditEvent, str]]:
    return [(entry.event, entry.who) for entry in entries(rig, *events)]


def test_a_motion_is_noted_from_the_authority_to_its_end(rig: GuardedRig, otto: Pendant) -> None:
    otto.move(0.5, -0.25)
    rig.wait(3_000)
    otto.release()
    wanted = [
        AuditEvent.AUTHORITY_TAKEN,
        AuditEvent.MOTION_BEGAN,
        AuditEvent.MOTION_ENDED,
        AuditEvent.AUTHORITY_ENDED,
    ]
    assert told(rig, *wanted) == [(event, "otto") for event in wanted]
    _, began, ended, _ = entries(rig, *wanted)
    assert [began.detail["at"], ended.detail["at"]] == ["0.0000 0.0000", "0.5000 -0.2500"]


def test_a_stop_and_its_reset_are_noted_with_who_and_why(rig: GuardedRig) -> None:
    otto, visitor = rig.user("otto"), rig.visitor()
    otto.take()
    otto.move(1.0, 0.0)
    visitor.stop("a hand in the way")
    rig.wait(2_000)
    assert otto.reset() is V.ACCEPTED
    stop, reset = (entries(rig, event)[0] for event in (AuditEvent.STOP, AuditEvent.RESET))
    assert (stop.session, stop.detail["reason"]) == (visitor.session, "a hand in the way")
    assert (reset.who, reset.role) == ("otto", "operator")
    (ended,) = entries(rig, AuditEvent.MOTION_ENDED)
    assert ended.detail["code"] == V.STOPPED


def test_a_take_over_is_noted_for_both(rig: GuardedRig, otto: Pendant) -> None:
    ann = rig.user("ann")
    assert ann.code(messages.Authority(1, messages.AuthorityAction.FORCE)) is V.ACCEPTED
    noted = told(rig, AuditEvent.AUTHORITY_ENDED, AuditEvent.AUTHORITY_FORCED)
    assert noted == [(AuditEvent.AUTHORITY_ENDED, "otto"), (AuditEvent.AUTHORITY_FORCED, "ann")]


def test_a_change_of_the_mode_is_noted(rig: GuardedRig, otto: Pendant) -> None:
    otto.code(messages.SetMode(2, 1))
    (entry,) = entries(rig, AuditEvent.MODE)
    assert (entry.who, entry.detail["mode"]) == ("otto", "manual_reduced")


def test_a_motion_that_is_refused_is_noted_with_who_what_and_why(
    rig: GuardedRig, otto: Pendant
) -> None:
    """At once, for another's authority, and after planning."""
    ann = rig.user("ann")
    ann.move(0.5, 0.0)
    otto.move(9.0, 0.0)
    refused = entries(rig, AuditEvent.REFUSED)
    assert [(entry.who, entry.detail["code"]) for entry in refused] == [
        ("ann", V.HELD_BY_OTHER),
        ("otto", V.OUT_OF_RANGE),
    ]
    assert refused[1].detail["wanted"] == "joint_move"
    rig.plans_at_once = False
    otto.path((0.1, 0.1))
    rig.plan(Refusal(V.TOO_FAST, "joint 1 is too fast"))
    last = rig.desk.log[-1]
    assert (last.event, last.who) == (AuditEvent.REFUSED, "otto")
    assert last.detail["text"] == "joint 1 is too fast"


@pytest.mark.parametrize(
    ("op", "is_noted"), [("signals.set", True), ("frames.add", True), ("signals.read", False)]
)
def test_a_change_of_the_cell_is_noted_even_unkept(
    rig: GuardedRig, op: str, is_noted: bool
) -> None:
    rig.user("ann").ask(op)
    asked = entries(rig, AuditEvent.CHANGE_ASKED)
    assert [(entry.who, entry.detail) for entry in asked] == (
        [("ann", {"operation": op})] if is_noted else []
    )


def test_a_program_that_is_saved_is_noted_with_its_revision(rig: GuardedRig) -> None:
    rig.user("ann").ask("programs.create", name="lift")
    (entry,) = entries(rig, AuditEvent.DOCUMENT_CHANGED)
    assert entry.who == "ann"
    assert (entry.detail["document"], entry.detail["revision"]) == ("lift", 1)


def test_what_is_noted_makes_an_intact_log(rig: GuardedRig) -> None:
    test_a_stop_and_its_reset_are_noted_with_who_and_why(rig)
    check, link = ChainCheck(), Link()
    for entry in rig.desk.log:
        line, link = write_line(entry, "2026-01-01T00:00:00+00:00", link)
        assert check.feed(line.rstrip(b"\n")) is None
    assert check.finish() is None


def test_a_ros_client_is_noted_by_its_address() -> None:
    rig = GuardedRig()
    client = rig.ros()
    client.trajectory((0.0, 0.0), (0.2, 0.0), (0.4, 0.0))
    rig.wait(4_000)
    log = entries(rig, AuditEvent.MOTION_BEGAN)
    assert [entry.who for entry in log] == ["ROS-I 127.0.0.1"]


def impostor(rig: GuardedRig, name: str = "ann", address: str = LAN) -> Pendant:
    pendant = rig.stranger(Port.PENDANT, address)
    pendant.hello(name)
    pendant.got.clear()
    return pendant


def noted(rig: GuardedRig, event: AuditEvent) -> AuditEntry:
    return entries(rig, event)[-1]


@pytest.mark.parametrize("address", [LAN, LOCAL])
def test_nobody_signs_a_stop_in_the_audit_log_as_another(rig: GuardedRig, address: str) -> None:
    impostor(rig, address=address).stop("boo")
    entry = noted(rig, AuditEvent.STOP)
    assert (entry.who, entry.role, entry.source) == ("", "", address)
    assert (entry.detail["client"], entry.detail["reason"]) == ("ann", "boo")


def test_what_is_refused_without_a_login_is_noted_with_the_claimed_name(
    rig: GuardedRig,
) -> None:
    impostor(rig).move(0.1, 0.0)
    entry = noted(rig, AuditEvent.REFUSED)
    assert (entry.who, entry.detail["client"]) == ("", "ann")


def test_everybody_is_shown_that_whoever_stopped_has_not_logged_in(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    impostor(rig).stop("boo")
    assert ann.all(messages.StopChanged)[-1].client == "ann (not logged in)"
    ann.take()
    assert ann.move(0.1, 0.0) is V.STOP_LATCHED
    assert ann.all(messages.Verdict)[-1].text == "software stop by ann (not logged in): boo"
    assert ann.ask("snapshot")["stop"]["client"] == "ann (not logged in)"


@pytest.mark.parametrize("name", ["a" * 32, "ü" * 16, "otto (not logged in) "])
def test_a_long_name_cannot_push_the_remark_out_of_the_field(rig: GuardedRig, name: str) -> None:
    ann = rig.user("ann")
    impostor(rig, name).stop()
    assert ann.all(messages.StopChanged)[-1].client.endswith(" (not logged in)")


def test_whoever_gives_no_name_is_shown_without_one(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    impostor(rig, "").stop()
    assert ann.all(messages.StopChanged)[-1].client == ""
    assert noted(rig, AuditEvent.STOP).who == ""


def test_whoever_logs_in_and_out_is_shown_by_his_account_in_between_alone(rig: GuardedRig) -> None:
    watcher, pendant = rig.user("vera"), impostor(rig, "desk 4")
    names = []
    for step in ("comes", "logs in", "logs out"):
        if step == "logs in":
            log_in(pendant, "otto")
        elif step == "logs out":
            pendant.ask("access.logout")
        pendant.stop()
        names.append(watcher.all(messages.StopChanged)[-1].client)
        ann = rig.user("ann")
        ann.take()
        ann.reset()
        ann.release()
    assert names == ["desk 4 (not logged in)", "otto", "desk 4 (not logged in)"]


@pytest.mark.parametrize("change", ["logs out", "logs in as somebody else"])
def test_the_end_of_the_authority_is_noted_of_who_had_it(
    rig: GuardedRig, otto: Pendant, change: str
) -> None:
    if change == "logs out":
        otto.ask("access.logout")
    else:
        log_in(otto, "ann")
    entry = noted(rig, AuditEvent.AUTHORITY_ENDED)
    assert (entry.who, entry.source, entry.session) == ("otto", LAN, otto.session)


def test_a_motion_that_ends_with_the_login_is_noted_of_who_began_it(
    rig: GuardedRig, otto: Pendant
) -> None:
    otto.move(1.0, 0.0)
    otto.ask("access.logout")
    entry = noted(rig, AuditEvent.MOTION_ENDED)
    assert (entry.who, entry.session) == ("otto", otto.session)


def test_without_accounts_a_pendant_is_called_as_it_says() -> None:
    rig = GuardedRig(AccountBook())
    rig.desk.login.single_user_host = True
    one, other = (impostor(rig, name, LOCAL) for name in ("bench 1", "bench 2"))
    one.take()
    other.stop()
    assert [news.client for news in other.all(messages.AuthorityChanged)] == ["bench 1"]
    assert one.all(messages.StopChanged)[-1].client == "bench 2"
    assert noted(rig, AuditEvent.STOP).who == "bench 2"


def test_the_first_account_ends_the_single_user_whose_name_is_a_claim_then() -> None:
    rig = GuardedRig(AccountBook())
    rig.desk.login.single_user_host = True
    bench = impostor(rig, "ann", LOCAL)
    assert bench.take() is V.ACCEPTED
    rig.follow(BOOK)
    assert rig.core.cell.authority.holder is None
    assert bench.take() is V.LOGIN_NEEDED
    bench.stop()
    assert bench.all(messages.StopChanged)[-1].client == "ann (not logged in)"
    assert noted(rig, AuditEvent.STOP).who == ""
