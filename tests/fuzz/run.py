"""Fuzz with atheris: `python tests/fuzz/run.py --seconds 60 [--only fuzz_decoder]`.

Each target runs in a process of its own, two at a time, from a corpus of its seeds. An input that
breaks one is kept in `regressions/<target>/`, where the tests run it for ever after. Exit codes:
0 nothing found, 1 something was, 2 atheris is not installed.
"""

import argparse
import hashlib
import importlib
import importlib.util
import os
import re
import resource
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent
TARGETS = (
    "fuzz_decoder",
    "fuzz_connection",
    "fuzz_stop_walk",
    "fuzz_json_bodies",
    "fuzz_capture_loader",
    "fuzz_program_text",
    "fuzz_serial_line",
)
REGRESSIONS = FOLDER / "regressions"
UNGUIDED = ("motion", "server/access", "server/cell", "server/programs/[!l]*", "server/recording")
"""Folders that inputs reach as values only; to instrument them takes a fuzzer most of its start."""

_LONGEST_INPUT = 4_096
_MOST_MEGABYTES = 1_024


@dataclass(frozen=True)
class Outcome:
    target: str
    executions: int
    found: tuple[Path, ...]
    log: str
    exit_code: int


def fuzz(target: str, limit: str, keep: Path, seed: int = 0) -> Outcome:
    """Fuzz one target in a process of its own; what breaks it is kept in a folder.

    Args:
        limit: the option of libFuzzer that ends it: `-max_total_time=SECONDS` or `-runs=INPUTS`.
        seed: 0 tries other inputs each time, another number the same ones.
    """
    before = set(keep.glob("*"))
    with tempfile.TemporaryDirectory() as corpus:
        command = [sys.executable, __file__, "--child", target, corpus, limit, str(keep), str(seed)]
        path = os.pathsep.join([str(FOLDER.parent), os.environ.get("PYTHONPATH", "")])
        done = subprocess.run(
            command,
            env={**os.environ, "PYTHONPATH": path.rstrip(os.pathsep)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
    runs = re.search(r"number_of_executed_units:\s*(\d+)", done.stdout)
    found = tuple(sorted(set(keep.glob("*")) - before))
    return Outcome(target, int(runs[1]) if runs else 0, found, done.stdout, done.returncode)


def _child(target: str, corpus: str, limit: str, keep: str, seed: str) -> None:
    """Run one target to its limit or until it breaks; does not return."""
    # Looked up by name, because it is optional and has no types.
    atheris = importlib.import_module("atheris")

    with atheris.instrument_imports(include=["openpendant"], exclude=_unguided_modules()):
        module = importlib.import_module(f"fuzz.{target}")
    for first in module.seeds():
        (Path(corpus) / hashlib.sha1(first).hexdigest()).write_bytes(first)
    Path(keep).mkdir(parents=True, exist_ok=True)
    memory = f"-rss_limit_mb={_inherited_megabytes() + _MOST_MEGABYTES}"
    options = [limit, memory, f"-seed={seed}", f"-artifact_prefix={keep}/", "-print_final_stats=1"]
    options += [f"-max_len={_LONGEST_INPUT}", "-timeout=10"]
    atheris.Setup([target, *options, corpus], module.TestOneInput)
    atheris.Fuzz()


def _unguided_modules() -> list[str]:
    package = Path(str(importlib.import_module("openpendant").__path__[0]))
    files = [file for folder in UNGUIDED for file in package.glob(f"{folder}/**/*.py")]
    parts = (file.relative_to(package).with_suffix("").parts for file in files)
    return [".".join(("openpendant", *each)) for each in parts]


def _inherited_megabytes() -> int:
    """Return the peak memory that this process was given by the one that started it [MB].

    Linux keeps the peak over `exec`, so libFuzzer would count a large test worker as the target's.
    """
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def main(argv: list[str]) -> int:
    if argv[:1] == ["--child"]:
        _child(*argv[1:])
    command = argparse.ArgumentParser(description="Fuzz the decoders with atheris.")
    command.add_argument("--seconds", type=int, default=60, help="for all targets together")
    command.add_argument("--only", choices=TARGETS, help="one target")
    arguments = command.parse_args(argv)
    if importlib.util.find_spec("atheris") is None:
        sys.stderr.write("atheris is not installed, nothing was fuzzed\n")
        return 2
    targets = (arguments.only,) if arguments.only else TARGETS
    side_by_side = min(2, len(targets))
    limit = f"-max_total_time={max(1, arguments.seconds * side_by_side // len(targets))}"
    with ThreadPoolExecutor(side_by_side) as pool:
        outcomes = list(pool.map(lambda name: fuzz(name, limit, REGRESSIONS / name), targets))
    for outcome in outcomes:
        found = ", ".join(str(path) for path in outcome.found) or "nothing"
        told = f"{outcome.target:<20} {outcome.executions:>9} executions, found: {found}"
        sys.stdout.write(f"{told}\n")
        if outcome.exit_code:
            sys.stderr.write(outcome.log)
    return 1 if any(outcome.exit_code for outcome in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
