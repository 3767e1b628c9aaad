"""`python -m openpendant.tools.reference`: write or check everything that is generated."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .files import (
    generated_files,
    generated_sources,
    stale_files,
    stale_sources,
    write_files,
    write_sources,
)

_ROOT = Path(__file__).resolve().parents[2]
_DOCS = _ROOT / "docs"


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 1 where a checked file is stale, 2 where one cannot be written."""
    parser = argparse.ArgumentParser(
        prog="python -m openpendant.tools.reference",
        description="Write the reference pages, dissector, vectors, schemas, TypeScript and C.",
    )
    parser.add_argument("--check", action="store_true", help="write nothing, say what is stale")
    parser.add_argument(
        "--out", type=Path, default=_DOCS, metavar="DIR", help="where (default: docs/)"
    )
    parser.add_argument(
        "--sources",
        type=Path,
        metavar="DIR",
        help="root of TypeScript and C (default: the project)",
    )
    arguments = parser.parse_args(argv)
    sources = arguments.sources
    if sources is None and arguments.out == _DOCS:
        sources = _ROOT
    if arguments.check:
        return _check(arguments.out, sources)
    try:
        write_files(arguments.out)
        if sources is not None:
            write_sources(sources)
    except OSError as error:
        print(f"{error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    print(f"{len(generated_files())} files written to {arguments.out}")
    if sources is not None:
        print(f"{len(generated_sources())} files written to {sources}")
    return 0


def _check(folder: Path, sources: Path | None) -> int:
    stale = stale_files(folder) + ([] if sources is None else stale_sources(sources))
    for sentence in stale:
        print(sentence, file=sys.stderr)
    if stale:
        print("run: make reference", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
