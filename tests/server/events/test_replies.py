"""Texts of replies and notices, which have to fit a field."""

from openpendant.server.events.replies import cut_at_word


def test_a_text_that_fits_is_told_as_it_is() -> None:
    assert cut_at_word("twelve bytes", 12) == "twelve bytes"


def test_a_text_that_is_too_long_ends_behind_a_whole_word() -> None:
    assert cut_at_word("the plan starts at noon", 20) == "the plan starts ..."
