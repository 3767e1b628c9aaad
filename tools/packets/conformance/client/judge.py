"""The judge of clients: every check on every scenario of a trace, one result a check.

Owns the list of checks and how the findings of several scenarios become one. Pure: entries in,
results out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ...trace import Entry
from ..check import (
    PASSED,
    CheckFinding,
    CheckVerdict,
    Result,
    Section,
    deviates,
    failed,
    not_applicable,
)
from . import (  # noqa: F401 - they register themselves
    framing,
    limits,
    link,
    motion,
    motoman,
    replies,
    stop,
)
from .check import REGISTER, ClientCheck, Observed
from .setup import Setup
from .trace import ClientTrace, ReportHistory
from .trajectories import motions_of

CHECKS = REGISTER.in_order(Section)
"""In the order of the report: section by section, then by number."""


def judge_scenario(
    entries: Sequence[Entry], setup: Setup, checks: Iterable[ClientCheck] = CHECKS
) -> dict[str, CheckFinding]:
    """Judge one scenario."""
    trace = ClientTrace(entries, setup)
    seen = Observed(trace, motions_of(trace), ReportHistory(trace))
    return {check.number: check.judge(seen) for check in checks}


def scenarios_of(entries: Iterable[Entry]) -> dict[str, list[Entry]]:
    """Return the entries of a trace by scenario, in order."""
    found: dict[str, list[Entry]] = {}
    for entry in entries:
        found.setdefault(entry.scenario, []).append(entry)
    return found


def results_of(findings: Mapping[str, Mapping[str, CheckFinding]]) -> tuple[Result, ...]:
    """Return one result for each check from its findings in each scenario.

    The worst finding counts: one failure fails, one habit makes it deviate, and it passed only
    where some scenario gave it something to look at.
    """
    return tuple(
        Result(check, _together({name: found[check.number] for name, found in findings.items()}))
        for check in CHECKS
    )


def _together(findings: Mapping[str, CheckFinding]) -> CheckFinding:
    def details(verdict: CheckVerdict) -> str:
        return "; ".join(
            f"[{name}] {finding.detail}" if name else finding.detail
            for name, finding in findings.items()
            if finding.verdict is verdict
        )

    verdicts = {finding.verdict for finding in findings.values()}
    if CheckVerdict.FAILED in verdicts:
        return failed(details(CheckVerdict.FAILED))
    if CheckVerdict.DEVIATES in verdicts:
        habits = dict.fromkeys(f.habit for f in findings.values() if f.habit)
        return deviates("; ".join(habits), details(CheckVerdict.DEVIATES))
    if CheckVerdict.PASSED in verdicts:
        return PASSED
    reasons = dict.fromkeys(finding.detail for finding in findings.values())
    return not_applicable("; ".join(reasons) or "nothing was observed")
