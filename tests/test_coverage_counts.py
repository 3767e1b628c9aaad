"""What the tests cover is counted, and may not become less."""

from pathlib import Path

import pytest
from coverage_counts import counts, least, lost


def test_nothing_that_was_covered_is_lost() -> None:
    counted = counts()
    assert counted.keys() == least().keys()
    assert lost(counted, least()) == []


@pytest.mark.parametrize(
    ("counted", "said"),
    [
        ({"promises": 3}, []),
        ({"promises": 4}, []),
        ({"promises": 2}, ["2 promises, there must be 3: some were lost"]),
        ({}, ["0 promises, there must be 3: some were lost"]),
    ],
)
def test_a_count_may_not_fall(counted: dict[str, int], said: list[str]) -> None:
    assert lost(counted, {"promises": 3}) == said


FILES = {
    "tests/mutants/one.toml": '[[mutant]]\nname = "a"\n[[mutant]]\nequivalent = "since it is"\n',
    "tests/mutants/two.toml": '[[mutant]]\nname = "b"\n',
    "tests/vectors/one.json": '[{"name": "x"}, {"name": "y"}]',
    "tests/vectors/two.json": '[{"name": "z"}]',
    "tests/promises/table.toml": """
[common]
sockets = ["a.py"]
[1]
virtual = ["a.py"]
[2]
soak = ["b.py"]
[3]
virtual = []
""",
    "simplemsg/verdicts.py": """
class Other(IntEnum):
    MOVING = 1

class VerdictCode(IntEnum):
    ACCEPTED = 0
    MALFORMED = 41
    NOT_FINITE = 43
    TOO_FAST = 44
""",
    "tests/test_a.py": "V.NOT_FINITE, VerdictCode.MALFORMED, V.MOVING, Other.ACCEPTED, TOO_FAST",
    "tests/server/test_b.py": "V.NOT_FINITE",
    "tests/rig.py": "V.ACCEPTED",
}


def test_what_is_counted(tmp_path: Path) -> None:
    for name, text in FILES.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    assert counts(tmp_path) == {
        "planted faults": 2,
        "golden cases": 3,
        "promises": 2,
        "refusal codes": 2,
    }
