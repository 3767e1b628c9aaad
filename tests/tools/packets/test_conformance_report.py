import json
import re
from xml.etree import ElementTree

import pytest

from openpendant.tools.packets.conformance.check import (
    PASSED,
    Check,
    CheckVerdict,
    Judgement,
    Result,
    deviates,
    failed,
    not_applicable,
)
from openpendant.tools.packets.conformance.report import as_json, as_junit, as_text


def check(number: str) -> Check[None]:
    return Check(number, f"title of {number}", "REP-I0006 & <more>", None)


JUDGEMENT = Judgement(
    "server 127.0.0.1:12000",
    "server",
    (
        Result(check("FS01"), PASSED, 0.25),
        Result(check("FS02"), failed("length 5 < 12 & more"), 0.5),
        Result(check("MS01"), deviates("early reply", "after 3 ms")),
        Result(check("MS02"), not_applicable("it may not move")),
        Result(check("KS01"), not_applicable("no time")),
    ),
)
HOSTILE = Judgement(
    "server \x1b[2J\x00",
    "server",
    (Result(check("FS01"), failed("\ud800 line\nfeed \x07 ]]> <x>")),),
)


def test_the_text_names_every_check_its_verdict_and_the_counts() -> None:
    text = as_text(JUDGEMENT, color=False)
    for line in (
        "passed         FS01 title of FS01",
        "FAILED         FS02 title of FS02",
        "deviates       MS01 title of MS01",
        "not applicable MS02 title of MS02",
        "habit: early reply",
        "length 5 < 12 & more",
        "it may not move",
    ):
        assert line in text
    assert text.endswith("5 checks: 1 passed, 1 failed, 1 deviates, 2 not applicable")


def test_the_clause_is_told_where_a_check_did_not_pass() -> None:
    assert as_text(JUDGEMENT, color=False).count("clause: REP-I0006") == 2


def test_colour_changes_nothing_but_colour() -> None:
    colored = as_text(JUDGEMENT, color=True)
    assert "\x1b[" in colored
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == as_text(JUDGEMENT, color=False)


def test_json_has_every_result_and_the_counts() -> None:
    report = json.loads(as_json(JUDGEMENT))
    assert report["counts"] == {"passed": 1, "failed": 1, "deviates": 1, "not applicable": 2}
    assert [result["number"] for result in report["results"]] == [
        *("FS01", "FS02", "MS01", "MS02", "KS01")
    ]
    assert report["results"][2] == {
        "number": "MS01",
        "title": "title of MS01",
        "clause": "REP-I0006 & <more>",
        "section": "motion",
        "moves": False,
        "verdict": "deviates",
        "detail": "after 3 ms",
        "habit": "early reply",
        "seconds": 0.0,
    }


def test_junit_counts_equal_its_cases_and_the_judgement() -> None:
    root = ElementTree.fromstring(as_junit(JUDGEMENT))
    cases = root.findall("testsuite/testcase")
    for element in (root, root[0]):
        assert int(element.attrib["tests"]) == len(cases) == len(JUDGEMENT.results)
        failures = len(root.findall(".//failure"))
        assert int(element.attrib["failures"]) == failures == JUDGEMENT.count(CheckVerdict.FAILED)
        assert (
            int(element.attrib["skipped"])
            == len(root.findall(".//skipped"))
            == JUDGEMENT.count(CheckVerdict.NOT_APPLICABLE)
        )
        assert element.attrib["time"] == "0.750"


def test_junit_passes_a_deviation_and_names_its_habit() -> None:
    root = ElementTree.fromstring(as_junit(JUDGEMENT))
    case = root.find("testsuite/testcase[3]")
    assert case is not None
    assert [child.tag for child in case] == ["properties"]
    properties = {item.attrib["name"]: item.attrib["value"] for item in case.iter("property")}
    assert properties["habit"] == "early reply"
    assert properties["verdict"] == "deviates"


@pytest.mark.parametrize("judgement", [HOSTILE, Judgement("nobody", "client", ())])
def test_no_text_of_a_peer_breaks_a_report(judgement: Judgement) -> None:
    for text in (as_text(judgement, color=False), as_junit(judgement), as_json(judgement)):
        assert "\x1b" not in text
        assert "\x00" not in text
        text.encode()
    ElementTree.fromstring(as_junit(judgement))
    json.loads(as_json(judgement))
