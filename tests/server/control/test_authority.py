import pytest

from openpendant.server.control import AuthorityChange, Holder, MotionAuthority
from openpendant.simplemsg.pendant import AuthorityReason

TIMEOUT = 3_000_000_000
ANNA, BERT = Holder(1, "anna"), Holder(2, "bert")


@pytest.fixture
def held() -> MotionAuthority:
    authority = MotionAuthority(TIMEOUT)
    assert authority.request(ANNA, 0, beats=True) == AuthorityChange(ANNA, AuthorityReason.GRANTED)
    assert authority.is_held_by(1)
    return authority


def test_a_held_authority_does_not_change_by_a_request(held: MotionAuthority) -> None:
    for asker in (ANNA, BERT):
        assert held.request(asker, 1, beats=True) is None
        assert held.holder == ANNA


def test_it_expires_exactly_at_the_timeout(held: MotionAuthority) -> None:
    assert held.expire(TIMEOUT - 1) is None
    assert held.expire(TIMEOUT) == AuthorityChange(None, AuthorityReason.EXPIRED)
    assert held.holder is None


def test_a_beat_prolongs_it(held: MotionAuthority) -> None:
    held.beat(1, 1_000)
    assert not held.is_overdue(TIMEOUT + 999)
    assert held.is_overdue(TIMEOUT + 1_000)


def test_a_beat_that_comes_too_late_does_not_revive_it(held: MotionAuthority) -> None:
    held.beat(1, TIMEOUT)
    assert held.expire(TIMEOUT) is not None


def test_a_beat_of_somebody_else_does_nothing(held: MotionAuthority) -> None:
    held.beat(2, 1_000)
    assert held.is_overdue(TIMEOUT)


def test_only_the_holder_releases_it(held: MotionAuthority) -> None:
    assert held.release(2, AuthorityReason.RELEASED) is None
    for change in (AuthorityChange(None, AuthorityReason.RELEASED), None):
        assert held.release(1, AuthorityReason.RELEASED) == change


def test_without_beats_it_never_expires() -> None:
    authority = MotionAuthority(TIMEOUT)
    authority.request(ANNA, 0, beats=False)
    authority.beat(1, 5)
    assert authority.expire(10**18) is None


def test_a_new_holder_does_not_inherit_the_deadline_of_the_last(held: MotionAuthority) -> None:
    held.release(1, AuthorityReason.RELEASED)
    held.request(BERT, TIMEOUT - 1, beats=True)
    assert not held.is_overdue(TIMEOUT)


def test_a_holder_without_a_name_is_called_by_its_session() -> None:
    assert Holder(7, "").name == "session 7"
