"""A journal's questions to planner, store, passwords and accounts are written as they were."""

import difflib

import pytest
from frozen.frozen_files import QUESTIONS
from frozen.questions import KINDS, kinds_of, lines


def test_every_question_is_written_as_it_was() -> None:
    then = QUESTIONS.read_text("utf-8").splitlines()
    found = list(difflib.unified_diff(then, lines(), "then", "now", lineterm="", n=0))
    assert not found, "\n".join(found)


@pytest.mark.parametrize("kind", KINDS)
def test_none_of_a_kind_is_left_out(kind: str) -> None:
    union, asked = KINDS[kind]
    assert {type(each) for each in asked} == kinds_of(union)
