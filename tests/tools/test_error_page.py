"""The page of the error catalogue, and that every refusal of the server is on it."""

import re
from pathlib import Path

from rigs.data.case_table import every

from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode
from openpendant.tools.reference.page import error_page

SERVER = Path(__file__).parents[2] / "server"
CODES = sorted(set(VerdictCode) - {VerdictCode.ACCEPTED})


def test_every_code_has_an_anchor_cause_and_remedy() -> None:
    page = error_page()

    def check(code: VerdictCode) -> None:
        assert page.count(f'<a id="code-{code.value}"></a>\n## {code.value} {code.name}\n') == 1
        assert f"**Cause.** {CATALOGUE[code].cause}" in page
        assert f"**Remedy.** {CATALOGUE[code].remedy}" in page

    every([(code.name, code) for code in CODES], check)


def test_every_code_that_the_server_names_is_in_the_catalogue() -> None:
    named = {
        name
        for file in SERVER.rglob("*.py")
        for name in re.findall(r"\bVerdictCode\.([A-Z_]+)\b", file.read_text(encoding="utf-8"))
    }
    assert len(named) > 50
    assert named <= {code.name for code in CATALOGUE}


def test_every_refusal_of_the_server_is_made_with_a_code_of_the_catalogue() -> None:
    # A refusal takes its code as the first argument; a number or a text would be caught here.
    wild = [
        f"{file.name}: {call}"
        for file in SERVER.rglob("*.py")
        for call in re.findall(r"\bRefusal\(\s*([\d\"'f][^,)]*)", file.read_text(encoding="utf-8"))
        if re.match(r"[\d\"']|f[\"']", call)
    ]
    assert wild == []


def test_numbers_are_unique() -> None:
    assert len({code.value for code in VerdictCode}) == len(VerdictCode.__members__)
