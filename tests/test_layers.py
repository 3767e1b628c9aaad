"""Who may import whom, read from the source, by the tables of `layers.toml`; names of classes."""

import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
UMBRELLA = "openpendant"

TABLES = tomllib.loads((ROOT / "tests" / "layers.toml").read_text("utf-8"))
ROOMS: dict[str, dict[str, list[str]]] = TABLES["rooms"]
HOMES: dict[str, list[str]] = TABLES["homes"]
FOLDER_ORDER: dict[str, list[str]] = TABLES["folder_order"]
LISTS: dict[str, list[str]] = TABLES["lists"]

CONSOLE = f"{UMBRELLA}.tools.console"
HELP_TEXT = "openpendant.tools.help_text"
COMMAND_LINES = tuple(LISTS["command_lines"])

# Rooms whose folders have an order to the last, so that a circle and a name twice are faults.
ORDERED_ROOMS = [room for room in FOLDER_ORDER if room != "tools"]


@dataclass(frozen=True)
class Import:
    """One name imported by one line; a relative import is resolved to its absolute name."""

    file: str
    line: int
    target: str
    relative: bool
    inside_function: bool

    def __str__(self) -> str:
        return f"{self.file}:{self.line} imports {self.target}"

    @property
    def library(self) -> str:
        return self.target.partition(".")[0]

    @property
    def room(self) -> str:
        """The room imported from; empty for anything that is not ours."""
        parts = self.target.split(".")
        return parts[1] if parts[0] == UMBRELLA and len(parts) > 1 else ""

    @property
    def home(self) -> str:
        """The room imported into: a sub-folder with rules of its own, else the top folder."""
        folder = "/".join(self.file.split("/")[:2])
        return folder if folder in ROOMS else self.file.partition("/")[0]


def imports_of(source: str, file: str) -> Iterator[Import]:
    package = [UMBRELLA, *file.split("/")[:-1]]

    blocks: list[tuple[ast.AST, bool]] = [(_parsed(source), False)]
    while blocks:
        block, inside_function = blocks.pop()
        for child in _statements(block):
            function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
            blocks.append((child, inside_function or function))
            for target, relative in _targets(child, package):
                line = getattr(child, "lineno", 0)
                yield Import(file, line, target, relative, inside_function)


@cache
def _parsed(source: str) -> ast.Module:
    return ast.parse(source)


def _statements(block: ast.AST) -> Iterator[ast.AST]:
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        inside = getattr(block, name, ())
        yield from inside if isinstance(inside, list) else ()


def _targets(node: ast.AST, package: list[str]) -> Iterator[tuple[str, bool]]:
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield alias.name, False
    elif isinstance(node, ast.ImportFrom):
        base = package[: len(package) - node.level + 1] if node.level else []
        origin = ".".join([*base, *(node.module or "").split(".")]).strip(".")
        for alias in node.names:
            yield f"{origin}.{alias.name}", node.level > 0


def _tree(*folders: str, having: re.Pattern[str] = re.compile("")) -> list[Import]:
    return [
        found
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*.py"))
        if having.search(source := path.read_text("utf-8"))
        for found in imports_of(source, path.relative_to(ROOT).as_posix())
    ]


TOP_ROOMS = [room for room in ROOMS if "/" not in room]


@cache
def ours() -> list[Import]:
    """What our rooms import; read when a test asks, which one process of several does."""
    return _tree(*TOP_ROOMS)


Rule = Callable[[Import], bool]


def names_a_bare_folder(found: Import) -> bool:
    return found.library in TOP_ROOMS


def reaches_a_forbidden_room(found: Import) -> bool:
    own_room = found.home.partition("/")[0]
    if found.room in ("", own_room) or writes_to_the_console(found):
        return False
    return found.room not in ROOMS[found.home]["rooms"]


def writes_to_the_console(found: Import) -> bool:
    """A command line shares exit codes, errors and output with all others, nothing else."""
    return found.file.startswith(COMMAND_LINES) and f"{found.target}.".startswith(f"{CONSOLE}.")


def climbs_out_of_its_sub_folder(found: Import) -> bool:
    """A sub-folder with rules of its own is closed: nothing of the room around it."""
    inside = f"{UMBRELLA}.{found.home.replace('/', '.')}."
    own_room = found.home.partition("/")[0]
    return (
        "/" in found.home
        and found.room == own_room
        and not found.target.startswith(inside)
        and not writes_to_the_console(found)
    )


def judges_packets_by_a_pendant(found: Import) -> bool:
    """The packet tools judge what pendants send, so they share no code with them."""
    pendants = f"{UMBRELLA}.tools.pendants."
    return found.file.startswith("tools/packets/") and f"{found.target}.".startswith(pendants)


def crosses_rooms_relatively(found: Import) -> bool:
    return found.relative and found.room != found.file.partition("/")[0]


def names_its_own_room_absolutely(found: Import) -> bool:
    return not found.relative and found.room == found.file.partition("/")[0]


def uses_a_library_its_room_may_not(found: Import) -> bool:
    free = {*sys.stdlib_module_names, UMBRELLA, *TOP_ROOMS}
    return found.library not in free.union(ROOMS[found.home]["libraries"])


def uses_a_heavy_library_away_from_its_home(found: Import) -> bool:
    return found.library in HOMES and found.file not in HOMES[found.library]


def imports_a_slow_library_at_its_top(found: Import) -> bool:
    return found.library in LISTS["only_inside_functions"] and not found.inside_function


def knows_more_than_plain_data(found: Import) -> bool:
    if found.home != "controller_emulator" or found.room != "motion":
        return False
    plain = [f"{UMBRELLA}.motion.{module}." for module in LISTS["plain_data"]]
    return not f"{found.target}.".startswith(tuple(plain))


def touches_the_outside_world_in_a_core(found: Import) -> bool:
    return (
        not found.home.startswith("tools")
        and found.library in LISTS["outside_world"]
        and found.file not in LISTS["shells"]
    )


def reads_a_clock_in_a_core(found: Import) -> bool:
    return (
        not found.home.startswith("tools")
        and found.library == "time"
        and found.file not in LISTS["clock_readers"]
    )


def runs_on_more_than_the_standard_library(found: Import) -> bool:
    return (
        found.file in ("tools/cli.py", "tools/help_text.py")
        and not found.inside_function
        and not f"{found.target}.".startswith((f"{CONSOLE}.", f"{HELP_TEXT}."))
        and found.library not in sys.stdlib_module_names
    )


@cache
def file_of(target: str) -> str:
    """The file of ours that an imported name is in; empty for none."""
    parts = target.split(".")[1:]
    while len(parts) > 1:
        for path in ("/".join(parts) + ".py", "/".join(parts) + "/__init__.py"):
            if (ROOT / path).is_file():
                return path
        parts.pop()
    return ""


def folder_rank(file: str) -> int | None:
    """The place of a file in its room's order; None for the markers of the room itself.

    Where the order names a folder of `tools` as a whole, all that is in it has this place.
    """
    room, _, inside = file.partition("/")
    folder = inside.rpartition("/")[0] or inside.removesuffix(".py")
    folder = folder.partition("/")[0] if room == "tools" else folder
    order = FOLDER_ORDER.get(room, [])
    return order.index(folder) if folder in order else None


def imports_a_folder_above_itself(found: Import) -> bool:
    own = folder_rank(found.file)
    if own is None or found.room != found.file.partition("/")[0]:
        return False
    rank = folder_rank(file_of(found.target))
    return rank is not None and rank > own


def names_a_dialect_outside_its_table(found: Import) -> bool:
    target = file_of(found.target)
    is_dialect = target.startswith("server/uplinks/") and target not in LISTS["no_dialects"]
    return is_dialect and not found.file.startswith("server/uplinks/")


RULES: list[Rule] = [
    names_a_dialect_outside_its_table,
    imports_a_folder_above_itself,
    reaches_a_forbidden_room,
    climbs_out_of_its_sub_folder,
    judges_packets_by_a_pendant,
    crosses_rooms_relatively,
    names_its_own_room_absolutely,
    uses_a_library_its_room_may_not,
    uses_a_heavy_library_away_from_its_home,
    imports_a_slow_library_at_its_top,
    knows_more_than_plain_data,
    touches_the_outside_world_in_a_core,
    reads_a_clock_in_a_core,
    runs_on_more_than_the_standard_library,
]


@pytest.mark.parametrize(
    "source",
    [
        "import server",
        "import os, server.app as app",
        "if True: from tools import console",
        "def f():\n    from motion.pose import Pose",
        "from simplemsg import (\n    Ping,\n)",
    ],
)
def test_a_file_that_names_a_bare_folder_is_parsed(source: str) -> None:
    assert BARE_FOLDER.search(source)
    assert any(names_a_bare_folder(found) for found in imports_of(source, "tests/x.py"))


@pytest.mark.parametrize("breaks", RULES, ids=lambda rule: rule.__name__)
def test_no_import_breaks_a_rule(breaks: Rule) -> None:
    assert [str(found) for found in ours() if breaks(found)] == []


# Nearly all files of the tests have no such line, and need not be parsed.
BARE_FOLDER = re.compile(rf"\b(?:import|from)\b.*(?<![\w.])(?:{'|'.join(TOP_ROOMS)})\b")


def test_no_import_names_a_bare_folder_in_the_tests_either() -> None:
    everything = [*ours(), *_tree("tests", having=BARE_FOLDER)]
    assert [str(found) for found in everything if names_a_bare_folder(found)] == []


def test_every_room_is_a_typed_package_and_has_imports_to_judge() -> None:
    for room in TOP_ROOMS:
        assert (ROOT / room / "py.typed").is_file()
        assert any(found.file.startswith(f"{room}/") for found in ours())


def test_the_files_that_the_rules_name_exist() -> None:
    homes = (file for files in HOMES.values() for file in files)
    named = {*LISTS["shells"], *LISTS["clock_readers"], *homes}
    assert sorted(file for file in named if not (ROOT / file).is_file()) == []


@pytest.mark.parametrize(
    ("breaks", "file", "source"),
    [(rule, *planted) for rule in RULES for planted in TABLES["planted"][rule.__name__]],
)
def test_a_planted_import_is_found(breaks: Rule, file: str, source: str) -> None:
    assert any(breaks(found) for found in imports_of(source, file))


@pytest.mark.parametrize(("file", "source"), TABLES["proper"]["imports"])
def test_a_proper_import_breaks_no_rule(file: str, source: str) -> None:
    for found in imports_of(source, file):
        assert [rule.__name__ for rule in RULES if rule(found)] == []


@pytest.mark.parametrize("room", FOLDER_ORDER)
def test_every_file_of_a_room_has_a_place_in_its_order(room: str) -> None:
    markers = {f"{room}/__init__.py", f"{room}/__main__.py", f"{room}/programs/__init__.py"}
    files = {path.relative_to(ROOT).as_posix() for path in (ROOT / room).rglob("*.py")}
    assert sorted(file for file in files - markers if folder_rank(file) is None) == []
    assert [name for name in FOLDER_ORDER[room] if not _stands(room, name)] == []


def _stands(room: str, name: str) -> bool:
    return (ROOT / room / name).is_dir() or (ROOT / room / f"{name}.py").is_file()


@pytest.mark.parametrize("room", ORDERED_ROOMS)
def test_a_file_name_stands_once_in_a_room(room: str) -> None:
    names = Counter(path.name for path in (ROOT / room).rglob("*.py"))
    assert [name for name, count in names.items() if count > 1 and name[0] != "_"] == []


def in_circles(imports: dict[str, set[str]]) -> set[str]:
    """The files on circles of imports, and between two of them."""
    left = dict(imports)
    while True:
        wanted = {file for targets in left.values() for file in targets}
        kept = {
            file: targets & left.keys()
            for file, targets in left.items()
            if file in wanted and targets & left.keys()
        }
        if kept == left:
            return set(left)
        left = kept


def test_no_files_import_each_other_in_a_circle() -> None:
    imports: dict[str, set[str]] = {}
    for found in ours():
        if found.file.partition("/")[0] in ORDERED_ROOMS:
            target = file_of(found.target)
            imports.setdefault(found.file, set()).update({target} - {found.file, ""})
    assert in_circles(imports) == set()


def journal_uses(source: str) -> set[str]:
    if "journal" not in source:
        return set()
    return {
        node.attr
        for node in ast.walk(_parsed(source))
        if isinstance(node, ast.Attribute)
        and ast.unparse(node.value).split(".")[-1].lstrip("_") == "journal"
    }


def test_three_files_of_the_server_touch_its_journal() -> None:
    users = {
        str(file.relative_to(ROOT))
        for file in (ROOT / "server").rglob("*.py")
        if journal_uses(file.read_text("utf-8"))
    }
    assert users - {"server/cli/serve.py"} == set(LISTS["journal_users"])
    assert journal_uses((ROOT / "server/cli/serve.py").read_text("utf-8")) == {"keep", "end"}


def test_a_planted_use_of_the_journal_is_found() -> None:
    assert journal_uses("self._app.journal.begin('tick')") == {"begin"}
    assert journal_uses("now = journal.now") == {"now"}


def test_a_planted_circle_is_found() -> None:
    imports = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": set(), "f": {"a"}}
    assert in_circles(imports) == {"a", "b", "c"}


MOST_DOUBLE = 38
"""Class names that stand in two modules or more; this may only fall."""


def public_classes(source: str) -> list[str]:
    return [
        node.name
        for node in _parsed(source).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]


def double_names() -> list[str]:
    found = Counter(
        name
        for room in TOP_ROOMS
        for file in (ROOT / room).rglob("*.py")
        for name in set(public_classes(file.read_text("utf-8")))
    )
    return sorted(name for name, modules in found.items() if modules > 1)


def test_no_more_classes_share_a_name_than_before() -> None:
    double = double_names()
    assert len(double) <= MOST_DOUBLE, f"one more of {', '.join(double)}"
    assert len(double) == MOST_DOUBLE, f"lower MOST_DOUBLE to {len(double)}"


def test_private_and_inner_classes_do_not_count() -> None:
    source = "class Seen:\n    class Inner: ...\nclass _Hidden: ...\ndef f():\n    class In: ...\n"
    assert public_classes(source) == ["Seen"]
