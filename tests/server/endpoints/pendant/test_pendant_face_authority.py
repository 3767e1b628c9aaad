from __future__ import annotations

from rigs.cells.server_rig import MS, ready

from openpendant.simplemsg.pendant import AuthorityBeat, AuthorityChanged, AuthorityReason, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_two_pendants_one_authority() -> None:
    rig = ready()
    anna, bert = rig.pendant("anna"), rig.pendant("bert")
    assert anna.take() is V.ACCEPTED
    assert anna.take() is V.ACCEPTED
    assert bert.take() is V.HELD_BY_OTHER
    assert "anna" in bert.all(Verdict)[-1].text
    assert bert.release() is V.NOT_IN_CONTROL
    assert bert.move(0.1, 0.1) is V.HELD_BY_OTHER
    assert anna.release() is V.ACCEPTED
    assert bert.take() is V.ACCEPTED
    reasons = [change.reason for change in anna.all(AuthorityChanged)]
    assert reasons == [AuthorityReason.GRANTED, AuthorityReason.RELEASED, AuthorityReason.GRANTED]


def test_beats_keep_the_authority_and_their_absence_ends_it_after_3_s() -> None:
    rig = ready()
    pendant = rig.holder()
    for _ in range(10):
        rig.wait(1_000)
        pendant.send(AuthorityBeat())
    last = rig.now
    rig.wait(2_990)
    assert rig.core.cell.authority.is_held_by(pendant.session)
    rig.wait(10)
    assert rig.core.cell.authority.holder is None
    assert rig.now == last + 3_000 * MS
    assert pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.EXPIRED


def test_a_motion_request_is_a_sign_of_life() -> None:
    rig = ready()
    pendant = rig.holder()
    rig.wait(2_000)
    pendant.move(0.1, 0.1)
    rig.wait(2_990)
    assert rig.core.cell.authority.holder is not None


def test_a_refused_request_is_no_sign_of_life() -> None:
    rig = ready()
    pendant = rig.holder()
    rig.wait(2_000)
    pendant.move(9.0, 9.0)
    rig.wait(1_000)
    assert rig.core.cell.authority.holder is None


def test_nobody_resets_without_the_authority() -> None:
    rig = ready()
    pendant = rig.pendant()
    pendant.stop()
    assert pendant.reset() is V.NOT_IN_CONTROL


def test_a_stop_outlives_who_pressed_it() -> None:
    rig = ready()
    observer = rig.pendant()
    observer.stop()
    observer.close()
    assert rig.holder().move(0.5, 0.5) is V.STOP_LATCHED
