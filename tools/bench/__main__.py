"""`python -m openpendant.tools.bench`: runs the benchmarks and prints one table.

A figure over its bound is marked, not a failure: machines differ. Only a crash is.
"""

from __future__ import annotations

import argparse
import json
import sys
import traceback
from importlib import import_module

from .table import Benchmark, Missing, Row, as_json, measure, render

MODULES = (
    "codec",
    "stream",
    "latency",
    "ik",
    "planning",
    "programs",
    "path_accuracy",
    "ticks",
    "cells",
    "startup",
    "rerun",
)
"""Modules of this folder with a function `benchmarks() -> list[Benchmark]`."""


def main(argv: list[str] | None = None) -> int:
    """Run the benchmarks.

    Args:
        argv: arguments; None takes those of the process.

    Returns:
        0, or 1 when a benchmark crashed.
    """
    arguments = _parser().parse_args(argv)
    rows: list[Row] = []
    crashed = False
    for benchmark in _chosen(arguments.only):
        print(f"{benchmark.name} …", file=sys.stderr, flush=True)
        try:
            rows.append(measure(benchmark, quick=arguments.quick))
        except Missing as missing:
            print(f"{benchmark.name} is left out: {missing}", file=sys.stderr)
        except Exception:
            crashed = True
            print(f"{benchmark.name} crashed:", file=sys.stderr)
            traceback.print_exc()
    print(json.dumps(as_json(rows), indent=2) if arguments.json else render(rows))
    return int(crashed)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m openpendant.tools.bench")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--quick", action="store_true", help="take a third of the samples")
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", help="run benchmarks whose name begins so"
    )
    return parser


def _chosen(names: list[str] | None) -> list[Benchmark]:
    found = [
        benchmark
        for module in MODULES
        for benchmark in import_module(f".{module}", __package__).benchmarks()
    ]
    if names is None:
        return found
    return [benchmark for benchmark in found if benchmark.name.startswith(tuple(names))]


if __name__ == "__main__":
    sys.exit(main())
