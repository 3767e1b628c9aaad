"""Page docs/command-to-motion.md: the folders by which commands become motion, from the walks.

Owns the page's text and form. Each table has the folders of a walk in the order in which they are
entered, each with its first function; what that does is the first line of its docstring. Run as a
script it writes the page.
"""

import ast
import sys
from functools import cache
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])  # tests/, as pytest has it

from walks.tracer import Walk
from walks.walk_report import source_of
from walks.walk_table import gone

PAGE = Path(__file__).parents[2] / "docs" / "command-to-motion.md"

_HEAD = """\
# A command becomes motion

The way through the server from a pendant's bytes to the controller's bytes. Each table has the
folders of one event in the order in which it enters them, with the first function that it calls in
each; `make walk WALK=a1` shows every file and call. What each folder owns is in
[architecture.md](architecture.md), which motion is refused in [safety.md](safety.md). `make
reference` writes this page from `tests/walks`: one cell with one pendant and an emulated UR5.
"""

_STEPS = (
    (
        "a1",
        "A pose move is asked for",
        "Bytes of POSE_MOVE come in; all interlocks hold; a planning process gets the job.",
    ),
    (
        "a2",
        "Its plan is executed",
        "The certified trajectory comes back; the first set-point passes its guard and leaves.",
    ),
    (
        "b1",
        "A jog is kept alive",
        "A heartbeat of the press comes in; without one, the robot ramps down to standstill.",
    ),
    (
        "b2",
        "A tick sends the jog's next set-point",
        "The timer ticks; one more row is computed, checked and written to the controller.",
    ),
)


def page() -> str:
    """Return the page's text."""
    parts = [_HEAD]
    for name, title, sentence in _STEPS:
        walk = gone(name)
        parts.append(
            f"\n## {title}\n\n{sentence} (`{name}`: {walk.calls} calls in "
            f"{len(walk.files)} files)\n\n"
            "| Folder | First function | What it does |\n|---|---|---|\n"
        )
        parts += [
            f"| `{folder}/` | `{function}` | {_summary(file, function)} |\n"
            for folder, (file, function) in _entered(walk).items()
        ]
    return "".join(parts)


def _entered(walk: Walk) -> dict[str, tuple[str, str]]:
    """Return each folder of a walk with the first file and function that were entered there."""
    folders: dict[str, tuple[str, str]] = {}
    for file, function in walk.functions:
        folders.setdefault(file.rpartition("/")[0], (file, function))
    return folders


def _summary(file: str, function: str) -> str:
    """Return the first line of a function's docstring; of its class where it has none."""
    documented = _docstrings(file)
    names = function.replace(".<locals>", "").split(".")
    while names:
        text = documented.get(".".join(names))
        if text:
            return text.partition("\n")[0].replace("|", "\\|")
        names.pop()
    return ""


@cache
def _docstrings(file: str) -> dict[str, str]:
    found: dict[str, str] = {}

    def search(node: ast.AST, before: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
                found[before + child.name] = ast.get_docstring(child) or ""
                search(child, f"{before}{child.name}.")

    search(source_of(file), "")
    return found


def main() -> int:
    """Write the page; return the exit code."""
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
