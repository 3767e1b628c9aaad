"""Reports of a judgement: for a person, for a program and for a build server.

Owns the three forms of the report: text, JSON and JUnit XML. Knows nothing of how a finding came
about.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import groupby
from typing import Any
from xml.etree import ElementTree

from ...console import one_line
from .check import CheckVerdict, Judgement, Result

FORMAT = "openpendant-conformance/1"
"""Name and version of the JSON report."""

_LOOKS = {
    CheckVerdict.PASSED: ("passed", "32"),
    CheckVerdict.FAILED: ("FAILED", "1;31"),
    CheckVerdict.DEVIATES: ("deviates", "33"),
    CheckVerdict.NOT_APPLICABLE: ("not applicable", "2"),
}
"""Word and colour of each verdict."""

_WIDTH = max(len(word) for word, _ in _LOOKS.values())
_INDENT = " " * (_WIDTH + 8)


def as_text(judgement: Judgement, color: bool) -> str:
    """Return the report for a person."""
    lines = [_printable(judgement.subject)]
    for section, results in groupby(judgement.results, lambda result: result.check.section):
        lines += ["", section.name.lower().replace("_", " ")]
        for result in results:
            lines += _text_lines(result, color)
    return "\n".join([*lines, "", summary(judgement)])


def summary(judgement: Judgement) -> str:
    """Return the counts of a judgement in one line."""
    counts = ", ".join(f"{judgement.count(verdict)} {verdict.value}" for verdict in CheckVerdict)
    return f"{len(judgement.results)} checks: {counts}"


def _text_lines(result: Result, color: bool) -> Iterator[str]:
    check, finding = result.check, result.finding
    word, paint = _LOOKS[finding.verdict]
    word = f"{word:<{_WIDTH}}"
    if color:
        word = f"\x1b[{paint}m{word}\x1b[0m"
    yield f"  {word} {check.number} {_printable(check.title)}"
    if finding.habit:
        yield f"{_INDENT}habit: {_printable(finding.habit)}"
    if finding.detail:
        yield f"{_INDENT}{_printable(finding.detail)}"
    if finding.verdict in (CheckVerdict.FAILED, CheckVerdict.DEVIATES):
        yield f"{_INDENT}clause: {_printable(check.clause)}"


def as_json(judgement: Judgement) -> str:
    """Return the report as one JSON object."""
    report = {
        "format": FORMAT,
        "subject": judgement.subject,
        "role": judgement.role,
        "counts": {verdict.value: judgement.count(verdict) for verdict in CheckVerdict},
        "results": [_json_of(result) for result in judgement.results],
    }
    return json.dumps(report, indent=2)


def _json_of(result: Result) -> dict[str, Any]:
    check, finding = result.check, result.finding
    return {
        "number": check.number,
        "title": check.title,
        "clause": check.clause,
        "section": check.section.name.lower(),
        "moves": check.moves,
        "verdict": finding.verdict.value,
        "detail": finding.detail,
        "habit": finding.habit,
        "seconds": round(result.seconds, 6),
    }


def as_junit(judgement: Judgement) -> str:
    """Return the report as JUnit XML.

    A deviation counts as passed and carries its habit as a property, because a build must not break
    on what a vendor has always done; a check that could not look is skipped.
    """
    counts = {
        "tests": len(judgement.results),
        "failures": judgement.count(CheckVerdict.FAILED),
        "errors": 0,
        "skipped": judgement.count(CheckVerdict.NOT_APPLICABLE),
    }
    attributes = {name: str(count) for name, count in counts.items()}
    attributes["time"] = _seconds(sum(result.seconds for result in judgement.results))
    root = ElementTree.Element("testsuites", attributes)
    named = {"name": _printable(judgement.subject), **attributes}
    suite = ElementTree.SubElement(root, "testsuite", named)
    for result in judgement.results:
        suite.append(_test_case(judgement.role, result))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _test_case(role: str, result: Result) -> ElementTree.Element:
    check, finding = result.check, result.finding
    case = ElementTree.Element(
        "testcase",
        {
            "name": _printable(f"{check.number} {check.title}"),
            "classname": f"conformance.{role}.{check.section.name.lower()}",
            "time": _seconds(result.seconds),
        },
    )
    properties = {"clause": check.clause, "verdict": finding.verdict.value}
    if finding.verdict is CheckVerdict.DEVIATES:
        properties |= {"habit": finding.habit, "detail": finding.detail}
    listed = ElementTree.SubElement(case, "properties")
    for key, value in properties.items():
        ElementTree.SubElement(listed, "property", {"name": key, "value": _printable(value)})
    outcome = {CheckVerdict.FAILED: "failure", CheckVerdict.NOT_APPLICABLE: "skipped"}.get(
        finding.verdict
    )
    if outcome is not None:
        ElementTree.SubElement(case, outcome, {"message": _printable(finding.detail)})
    return case


def _seconds(duration: float) -> str:
    return f"{duration:.3f}"


def _printable(text: str) -> str:
    """Return a text without what a peer may have smuggled in: escape sequences, line feeds.

    XML knows no control characters at all, and a terminal obeys them.
    """
    return one_line(text, "\N{REPLACEMENT CHARACTER}")
