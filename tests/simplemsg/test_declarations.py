import pytest
from rigs.data.case_table import every
from rigs.data.message_samples import DECLARED

from openpendant.simplemsg import Message, errors, joint_array
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode


def test_every_verdict_has_a_cause_and_a_remedy() -> None:
    assert set(CATALOGUE) == set(VerdictCode)
    assert all(entry.cause and entry.remedy for entry in CATALOGUE.values())


def test_every_field_says_what_it_means() -> None:
    every(DECLARED.items(), _says_what_its_fields_mean)


def _says_what_its_fields_mean(cls: type[Message]) -> None:
    assert all(field.meaning for field in cls.FIELDS.values())
    assert cls.PLACE.source
    assert cls.PLACE.reply


def test_joint_values_are_padded_to_ten_slots() -> None:
    assert joint_array([1.0, 2.0]) == (1.0, 2.0, *[0.0] * 8)


def test_more_than_ten_joints_do_not_fit() -> None:
    with pytest.raises(ValueError, match="11 joints do not fit the 10 slots"):
        joint_array([0.0] * 11)


def test_an_error_shows_any_value_in_one_short_line() -> None:
    assert errors.shown("x" * 100) == "'" + "x" * 58 + "…"
    assert errors.shown(10**5000) == "a huge int"
    assert errors.shown("a\nb\ud800") == r"'a\nb\ud800'"
