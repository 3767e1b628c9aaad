"""The command behind `make mutants`: options, progress lines, summary and exit code."""

import argparse
import json
import signal
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path

from mutants.mutant_runs import ROW_SECONDS, MutantRuns, Outcome, Verdict
from mutants.mutant_table import BadTable, Mutant, NoSuchBase, changed_since, matching, read_rows

LEAST_FOUND = 0.95
"""Share of the rows that are not equivalent whose fault must be found."""

CHANGED = "changed"

_EXPLAINED = """\
Each row of tests/mutants/*.toml is a fault. It is planted by an import hook, in no file, and the
tests that the row names must find it. First they run on the code as it is.

WHICH: nothing runs all rows; a part of a name, room, file or test id (or a pattern with *) runs the
rows that have it; `changed` runs the rows whose file, test files or own text differ from --base.
Uncommitted and new files count, so with the usual base, HEAD, these are the rows of what is not
committed yet; with --base main all that a branch changed. Helpers of tests do not count.

Verdicts: found (a test failed), found by its hang (the tests took longer than --row-seconds, and
less than a third of it on the code as it is), survived, equivalent (never planted), row failed (its
text is not there once, its tests fail or are not there on the code as it is, no process imported
the fault, or pytest did not end by tests that ran).

Exit codes: 0 no row failed and at least 95 % of the rows that are not equivalent were found; 1
otherwise; 2 there is nothing to run, or the table cannot be read; 130 it was interrupted.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run rows and tell what became of them; return the exit code."""
    asked = _parser().parse_args(arguments)
    try:
        rows = read_rows()
        if asked.which == CHANGED:
            rows = changed_since(rows, asked.base)
        elif asked.which:
            rows = matching(rows, asked.which)
    except (BadTable, NoSuchBase) as error:
        sys.stderr.write(f"mutants: {error}\n")
        return 2
    if not rows:
        _tell("no row to run\n")
        return 0 if asked.which == CHANGED else 2
    began = time.monotonic()
    # Whoever ends this ends the tests too, which run in process groups of their own.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        outcomes = run_rows(rows, MutantRuns(seconds=asked.row_seconds), asked.workers)
    except KeyboardInterrupt:
        _tell("ended before all rows were judged\n")
        return 130
    _tell(f"{summary(outcomes)} in {time.monotonic() - began:.0f} s\n")
    if asked.json is not None:
        asked.json.write_text(json.dumps(as_data(outcomes), indent=1) + "\n", encoding="utf-8")
    return 0 if holds(outcomes) else 1


def run_rows(rows: Sequence[Mutant], runs: MutantRuns, workers: int) -> list[Outcome]:
    """Judge rows, several at a time, and print a line for each; in the order of the rows."""
    sets = list(dict.fromkeys(row.tests for row in rows if row.equivalent is None))
    outcomes: dict[str, Outcome] = {}
    with ThreadPoolExecutor(workers) as pool:
        try:
            # All sets first: two rows with the same tests would wait for each other.
            unchanged = [pool.submit(runs.run_unchanged, tests) for tests in sets]
            for ended in as_completed(unchanged):
                ended.result()
            _tell(f"{len(sets)} sets of tests ran on the code as it is\n")
            judged: list[Future[Outcome]] = [pool.submit(runs.judge, row) for row in rows]
            for done, judging in enumerate(as_completed(judged), 1):
                outcome = judging.result()
                outcomes[outcome.row.name] = outcome
                _tell(f"{done:4} of {len(rows)}  {_line(outcome)}\n")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            runs.end()
            raise
    return [outcomes[row.name] for row in rows]


def summary(outcomes: Sequence[Outcome]) -> str:
    lines = [
        f"{kind.value}: {outcome.row.name} ({outcome.row.file})"
        + (f": {outcome.said}" if outcome.said else "")
        for kind in (Verdict.SURVIVED, Verdict.FAILED)
        for outcome in outcomes
        if outcome.verdict is kind
    ]
    rooms = Counter(outcome.row.room for outcome in outcomes)
    found = Counter(outcome.row.room for outcome in outcomes if outcome.verdict.found)
    planted = Counter(o.row.room for o in outcomes if o.verdict is not Verdict.EQUIVALENT)
    lines += [f"{room}: {found[room]} of {planted[room]} found" for room in sorted(rooms)]
    counts = Counter(outcome.verdict for outcome in outcomes)
    total = sum(planted.values())
    all_found = sum(found.values())
    share = f" ({100 * all_found / total:.1f} %)" if total else ""
    lines.append(
        f"{all_found} of {total} found{share}, {counts[Verdict.HUNG]} of them by a hang; "
        f"{counts[Verdict.SURVIVED]} survived, {counts[Verdict.EQUIVALENT]} equivalent, "
        f"{counts[Verdict.FAILED]} rows failed"
    )
    return "\n".join(lines)


def holds(outcomes: Sequence[Outcome]) -> bool:
    planted = [outcome for outcome in outcomes if outcome.verdict is not Verdict.EQUIVALENT]
    if any(outcome.verdict is Verdict.FAILED for outcome in planted):
        return False
    return sum(o.verdict.found for o in planted) >= LEAST_FOUND * len(planted)


def as_data(outcomes: Sequence[Outcome]) -> dict[str, object]:
    counts = Counter(outcome.verdict for outcome in outcomes)
    return {
        "counts": {verdict.name.lower(): counts[verdict] for verdict in Verdict},
        "holds": holds(outcomes),
        "rows": [
            {
                "name": outcome.row.name,
                "room": outcome.row.room,
                "file": outcome.row.file,
                "tests": list(outcome.row.tests),
                "verdict": outcome.verdict.name.lower(),
                "seconds": round(outcome.seconds, 2),
                "said": outcome.said,
            }
            for outcome in outcomes
        ],
    }


def _line(outcome: Outcome) -> str:
    name = f"{outcome.row.room}/{outcome.row.name}"
    return f"{outcome.verdict.value:10} {outcome.seconds:5.1f} s  {name}"


def _tell(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="make mutants",
        description=_EXPLAINED,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("which", nargs="?", default="", metavar="WHICH", help="rows (MUTANTS=)")
    parser.add_argument("--base", default="HEAD", help="commit that `changed` means (BASE=)")
    parser.add_argument("--workers", type=int, default=2, help="rows at a time (WORKERS=)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the outcomes there, too")
    parser.add_argument(
        "--row-seconds", type=float, default=ROW_SECONDS, help="longest run of a row's tests"
    )
    return parser
