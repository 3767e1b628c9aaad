"""`python -m openpendant.tools.reference`: write or check everything that is generated."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .files import generated_files, stale_files, write_files

_DOCS = Path(__file__).resolve().parents[2] / "docs"


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 1 where a checked file is stale, 2 where one cannot be written."""
    parser = argparse.ArgumentParser(
        prog="python -m openpendant.tools.reference",
        description="Write the reference pages, the dissector, the vectors and the schemas.",
    )
    parser.add_argument("--check", action="store_true", help="write nothing, say what is stale")
    parser.add_argument(
        "--out", type=Path, default=_DOCS, metavar="DIR", help="where (default: docs/)"
    )
    arguments = parser.parse_args(argv)
    if arguments.check:
        return _check(arguments.out)
    try:
        write_files(arguments.out)
    except OSError as error:
        print(f"{error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    print(f"{len(generated_files())} files written to {arguments.out}")
    return 0


def _check(folder: Path) -> int:
    stale = stale_files(folder)
    for sentence in stale:
        print(sentence, file=sys.stderr)
    if stale:
        print("run: make reference", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
