import pytest
from rigs.data.case_table import CASE_VARIABLE, every, same


@pytest.fixture(autouse=True)
def _all_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(CASE_VARIABLE, raising=False)


def _is_even(number: int) -> None:
    assert number % 2 == 0


def _told(cases: list[tuple[str, int]]) -> list[str]:
    with pytest.raises(AssertionError) as failed:
        every(cases, _is_even)
    return str(failed.value).splitlines()


def test_every_case_that_fails_is_told_by_its_id_and_no_other() -> None:
    head, one, two = _told([("a", 1), ("b", 2), ("c", 3)])
    assert head == f"2 of 3 cases fail; {CASE_VARIABLE}=ID runs one alone"
    assert one.startswith("a: assert (1 % 2) == 0 (test_case_table.py:")
    assert two.startswith("c: assert (3 % 2) == 0")


def test_cases_that_are_right_pass() -> None:
    every([("a", 0), ("b", 2)], _is_even)


def test_what_is_raised_in_a_case_is_a_failure_of_that_case() -> None:
    def check(number: int) -> None:
        if number == 1:
            raise KeyError("nothing")
        if number == 2:
            pytest.fail("not this one")

    with pytest.raises(AssertionError, match="3 cases") as failed:
        every([("a", 1), ("b", 2), ("c", 3)], check)
    assert "a: KeyError: 'nothing' (" in str(failed.value)
    assert "b: Failed: not this one (" in str(failed.value)


def test_no_more_than_50_are_told_and_the_rest_are_counted() -> None:
    lines = _told([(str(number), number) for number in range(1, 141, 2)])
    assert lines[0].startswith("70 of 70 cases")
    assert lines[50].startswith("99: ")
    assert lines[51:] == ["and 20 more"]


def test_a_table_without_a_case_or_with_an_id_twice_fails() -> None:
    assert _told([]) == ["there is no case to run"]
    assert _told([("a", 2), ("b", 2), ("a", 2)]) == ["ids of more than one case: a"]


def test_one_case_can_be_run_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CASE_VARIABLE, "b")
    every([("a", 1), ("b", 2)], _is_even)
    (_, line) = _told([("a", 2), ("b", 1)])
    assert line.startswith("b: ")
    with pytest.raises(pytest.skip.Exception, match="no case is called b"):
        every([("a", 1)], _is_even)


def test_the_first_difference_of_two_texts_is_told() -> None:
    same("abc", "abc")
    with pytest.raises(AssertionError, match="from character 2: …'c' where …'xyz' is expected"):
        same("abc", "abxyz")
