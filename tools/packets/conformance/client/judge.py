"""The judge of clients: every check on every scenario of a trace, one result a check.

Owns the list of checks and how the findings of several scenarios become one. Pure: entries in,
results out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

from ...trace import Entry
from ..findings import (
    PASSED,
    CheckInfo,
    Finding,
    Result,
    Section,
    Verdict,
    deviates,
    failed,
    not_applicable,
)
from . import (
    answers,
    framing,
    headers,
    limits,
    link,
    motion,
    motoman,
    motoman_fields,
    points,
    replies,
    status,
    stop,
    velocities,
)
from .check import ClientCheck, Observed
from .reports import Reports
from .setup import Setup
from .trace import ClientTrace
from .trajectories import motions_of

_ORDER = list(Section)

CHECKS: tuple[ClientCheck, ...] = tuple(
    sorted(
        chain(
            framing.CHECKS,
            headers.CHECKS,
            replies.CHECKS,
            answers.CHECKS,
            motion.CHECKS,
            points.CHECKS,
            stop.CHECKS,
            limits.CHECKS,
            velocities.CHECKS,
            status.CHECKS,
            link.CHECKS,
            motoman.CHECKS,
            motoman_fields.CHECKS,
        ),
        key=lambda check: (_ORDER.index(check.info.section), check.info.number),
    )
)
"""In the order of the report: section by section, then by number."""

CLIENT_CHECKS: tuple[CheckInfo, ...] = tuple(check.info for check in CHECKS)


def judge_scenario(entries: Sequence[Entry], setup: Setup) -> dict[str, Finding]:
    """Judge one scenario.

    Args:
        entries: its packets and events, in order of time.
        setup: what is known of the controller.

    Returns:
        The finding of every check by its number.
    """
    trace = ClientTrace(entries, setup)
    seen = Observed(trace, motions_of(trace), Reports(trace))
    return {check.info.number: check.judge(seen) for check in CHECKS}


def scenarios_of(entries: Iterable[Entry]) -> dict[str, list[Entry]]:
    """Return the entries of a trace by scenario, in order."""
    found: dict[str, list[Entry]] = {}
    for entry in entries:
        found.setdefault(entry.scenario, []).append(entry)
    return found


def results_of(findings: Mapping[str, Mapping[str, Finding]]) -> tuple[Result, ...]:
    """Return one result for each check from its findings in each scenario.

    The worst finding counts: one failure fails, one habit makes it deviate, and it passed only
    where some scenario gave it something to look at.

    Args:
        findings: by scenario, then by number of the check.
    """
    return tuple(
        Result(
            check.info,
            _together({name: found[check.info.number] for name, found in findings.items()}),
        )
        for check in CHECKS
    )


def _together(findings: Mapping[str, Finding]) -> Finding:
    def details(verdict: Verdict) -> str:
        return "; ".join(
            f"[{name}] {finding.detail}" if name else finding.detail
            for name, finding in findings.items()
            if finding.verdict is verdict
        )

    verdicts = {finding.verdict for finding in findings.values()}
    if Verdict.FAILED in verdicts:
        return failed(details(Verdict.FAILED))
    if Verdict.DEVIATES in verdicts:
        habits = dict.fromkeys(f.habit for f in findings.values() if f.habit)
        return deviates("; ".join(habits), details(Verdict.DEVIATES))
    if Verdict.PASSED in verdicts:
        return PASSED
    reasons = dict.fromkeys(finding.detail for finding in findings.values())
    return not_applicable("; ".join(reasons) or "nothing was observed")
