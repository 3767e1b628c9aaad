"""`python -m openpendant.tools.bench`: runs the benchmarks and prints one table.

A figure over its bound is marked, not a failure: machines differ. Only a crash is. With `--base`,
the benchmarks of an earlier commit and of the sources as they are run in turns, and a row that got
worse is a failure: both ran on the same machine.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
import traceback
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path

from . import two_commits
from .table import Benchmark, BenchmarkResult, MissingRequirement, as_json, measure, render
from .two_commits import LEAST_TURNS, ROOT, TURNS, NotComparable, measure_in_turns, two_sides

MODULES = (
    "codec",
    "latency",
    "ik",
    "planning",
    "programs",
    "questions",
    "path_accuracy",
    "ticks",
    "cells",
    "startup",
    "gateway",
    "keypad",
    "page",
    "rerun",
)
"""Modules of this folder with a function `benchmarks() -> list[Benchmark]`."""


def main(argv: list[str] | None = None) -> int:
    """Run the benchmarks.

    Returns:
        0; 1 when a benchmark crashed, or with `--base` a row is worse or was not measured; 2 when
        there is nothing to run; 130 when a comparison was interrupted.
    """
    arguments = _parser().parse_args(argv)
    groups = _chosen(arguments.only)
    if not groups:
        print(f"bench: no row is called {' or '.join(arguments.only)}", file=sys.stderr)
        if arguments.json:
            print("[]")
        return 2
    if arguments.base:
        names = {group: [each.name for each in found] for group, found in groups.items()}
        return compared(
            arguments.base, names, arguments.turns, quick=arguments.quick, as_json=arguments.json
        )
    rows: list[BenchmarkResult] = []
    crashed = False
    for benchmark in (each for group in groups.values() for each in group):
        print(f"{benchmark.name} …", file=sys.stderr, flush=True)
        try:
            rows.append(measure(benchmark, quick=arguments.quick))
        except MissingRequirement as missing:
            print(f"{benchmark.name} is left out: {missing}", file=sys.stderr)
        except Exception:
            crashed = True
            print(f"{benchmark.name} crashed:", file=sys.stderr)
            traceback.print_exc()
    print(json.dumps(as_json(rows), indent=2) if arguments.json else render(rows))
    return int(crashed)


def compared(
    base: str,
    groups: dict[str, list[str]],
    turns: int,
    *,
    quick: bool = False,
    as_json: bool = False,
    root: Path = ROOT,
) -> int:
    """Compare an earlier commit with the sources as they are; return the exit code of `main`."""
    began = time.monotonic()

    def tell(what: str) -> None:
        print(f"{time.monotonic() - began:5.0f} s  {what}", file=sys.stderr, flush=True)

    # Whoever ends this ends it as Ctrl-C does, so that no folder and no process stays.
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    found: list[two_commits.Comparison] = []
    try:
        with two_sides(base, root) as sides:
            for each in measure_in_turns(sides, groups, tell, turns, quick=quick):
                found.append(each)
                if each.verdict.is_failure:
                    tell(f"{each.verdict.value}: {each.name}")
    except NotComparable as error:
        print(f"bench: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        tell("ended before all rows were measured")
        return 130
    finally:
        signal.signal(signal.SIGTERM, before)
    rows = two_commits.as_json(found)
    print(json.dumps(rows, indent=2) if as_json else two_commits.render(found))
    return int(any(each.verdict.is_failure for each in found))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m openpendant.tools.bench")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--quick", action="store_true", help="take a third of the samples")
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="NAME",
        help="run benchmarks whose name begins so, or matches a pattern with *",
    )
    parser.add_argument(
        "--base",
        metavar="COMMIT",
        help="run this commit and the sources as they are in turns, and fail where a row got worse"
        " by more than 3 %% and by more than the spread between the quartiles of its ratios",
    )
    parser.add_argument(
        "--turns", type=_turns, default=TURNS, metavar="N", help="with --base; 10 unless named"
    )
    return parser


def _turns(text: str) -> int:
    turns = int(text)
    if turns < LEAST_TURNS:
        raise argparse.ArgumentTypeError(f"expected at least {LEAST_TURNS}")
    return turns


def _chosen(names: list[str] | None) -> dict[str, list[Benchmark]]:
    """Return the benchmarks by the module that they are of; those with the names, if there are."""
    found = {
        module: [
            benchmark
            for benchmark in import_module(f".{module}", __package__).benchmarks()
            if names is None or any(_is_called(benchmark.name, name) for name in names)
        ]
        for module in MODULES
    }
    return {module: benchmarks for module, benchmarks in found.items() if benchmarks}


def _is_called(name: str, asked: str) -> bool:
    return name.startswith(asked) or fnmatchcase(name, asked)


if __name__ == "__main__":
    sys.exit(main())
