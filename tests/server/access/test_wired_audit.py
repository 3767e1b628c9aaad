from __future__ import annotations

import json

import pytest
from rigs.cells.guarded_rig import GuardedRig
from rigs.cells.server_rig import ServerRig

from openpendant.server.access.audit import AuditEvent, ChainCheck, Link, write_line
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Authority, AuthorityAction, Management, SetMode
from openpendant.simplemsg.verdicts import VerdictCode as V


def told(rig: GuardedRig, *events: AuditEvent) -> list[tuple[AuditEvent, str]]:
    return [(entry.event, entry.who) for entry in rig.desk.log if entry.event in events]


def test_a_motion_is_noted_from_the_authority_to_its_end(rig: GuardedRig) -> None:
    otto = rig.user("otto")
    otto.take()
    otto.move(0.5, 0.0)
    rig.wait(3_000)
    otto.release()
    wanted = [
        AuditEvent.AUTHORITY_TAKEN,
        AuditEvent.MOTION_BEGAN,
        AuditEvent.MOTION_ENDED,
        AuditEvent.AUTHORITY_ENDED,
    ]
    assert told(rig, *wanted) == [(event, "otto") for event in wanted]


def test_a_stop_and_its_reset_are_noted_with_who_and_why(rig: GuardedRig) -> None:
    otto, visitor = rig.user("otto"), rig.visitor()
    otto.take()
    otto.move(1.0, 0.0)
    visitor.stop("a hand in the way")
    rig.wait(2_000)
    assert otto.reset() is V.ACCEPTED
    stop, reset = (
        next(entry for entry in rig.desk.log if entry.event is event)
        for event in (AuditEvent.STOP, AuditEvent.RESET)
    )
    assert (stop.session, stop.detail["reason"]) == (visitor.session, "a hand in the way")
    assert (reset.who, reset.role) == ("otto", "operator")
    (ended,) = [entry for entry in rig.desk.log if entry.event is AuditEvent.MOTION_ENDED]
    assert ended.detail["code"] == V.STOPPED


def test_a_take_over_is_noted_for_both(rig: GuardedRig) -> None:
    otto, ann = rig.user("otto"), rig.user("ann")
    otto.take()
    assert ann.code(Authority(1, AuthorityAction.FORCE)) is V.ACCEPTED
    noted = told(rig, AuditEvent.AUTHORITY_ENDED, AuditEvent.AUTHORITY_FORCED)
    assert noted == [(AuditEvent.AUTHORITY_ENDED, "otto"), (AuditEvent.AUTHORITY_FORCED, "ann")]


def test_a_change_of_the_mode_is_noted(rig: GuardedRig) -> None:
    otto = rig.user("otto")
    otto.take()
    otto.code(SetMode(2, 1))
    (entry,) = [entry for entry in rig.desk.log if entry.event is AuditEvent.MODE]
    assert (entry.who, entry.detail["mode"]) == ("otto", "manual_reduced")


def test_a_motion_that_is_refused_is_noted_with_who_what_and_why(rig: GuardedRig) -> None:
    """At once, for another's authority, and after planning."""
    otto, ann = rig.user("otto"), rig.user("ann")
    otto.take()
    ann.move(0.5, 0.0)
    otto.move(9.0, 0.0)
    refused = [entry for entry in rig.desk.log if entry.event is AuditEvent.REFUSED]
    assert [(entry.who, entry.detail["code"]) for entry in refused] == [
        ("ann", V.HELD_BY_OTHER),
        ("otto", V.OUT_OF_RANGE),
    ]
    assert refused[1].detail["wanted"] == "joint_move"
    rig.plans_at_once = False
    otto.path((0.1, 0.1))
    rig.plan(Refusal(V.TOO_FAST, "joint 1 is too fast"))
    last = rig.desk.log[-1]
    assert (last.event, last.who, last.detail["text"]) == (
        AuditEvent.REFUSED,
        "otto",
        "joint 1 is too fast",
    )


def test_a_motion_is_noted_with_where_it_began_and_ended(rig: GuardedRig) -> None:
    otto = rig.user("otto")
    otto.take()
    otto.move(0.5, -0.25)
    rig.wait(3_000)
    places = [
        entry.detail["at"]
        for entry in rig.desk.log
        if entry.event in (AuditEvent.MOTION_BEGAN, AuditEvent.MOTION_ENDED)
    ]
    assert places == ["0.0000 0.0000", "0.5000 -0.2500"]


@pytest.mark.parametrize(
    ("op", "is_noted"), [("signals.set", True), ("frames.add", True), ("signals.read", False)]
)
def test_a_change_of_the_cell_is_noted_whether_or_not_it_is_kept(
    rig: GuardedRig, op: str, is_noted: bool
) -> None:
    rig.user("ann").send(Management(1, json.dumps({"op": op}).encode()))
    asked = [entry for entry in rig.desk.log if entry.event is AuditEvent.CHANGE_ASKED]
    assert [(entry.who, entry.detail) for entry in asked] == (
        [("ann", {"operation": op})] if is_noted else []
    )


def test_a_program_that_is_saved_is_noted_with_its_revision(rig: GuardedRig) -> None:
    ann = rig.user("ann")
    ann.send(Management(1, json.dumps({"op": "programs.create", "name": "lift"}).encode()))
    (entry,) = [each for each in rig.desk.log if each.event is AuditEvent.DOCUMENT_CHANGED]
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
    log = [entry for entry in rig.desk.log if entry.event is AuditEvent.MOTION_BEGAN]
    assert [entry.who for entry in log] == ["ROS-I 127.0.0.1"]


def test_without_a_log_nothing_is_kept() -> None:
    rig = ServerRig()
    rig.connect_controller()
    assert rig.holder().move(0.1, 0.0) is V.ACCEPTED
