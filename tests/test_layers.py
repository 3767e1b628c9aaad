"""Who may import whom, read from the source; `docs/architecture.md` draws the same arrows."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
UMBRELLA = "openpendant"

# Each room: the rooms it may import, and the libraries beside the standard one.
ROOMS: dict[str, tuple[set[str], set[str]]] = {
    "simplemsg": (set(), set()),
    "motion": (
        set(),
        {
            *("coal", "eigenpy", "matplotlib", "numpy", "ompl", "pinocchio", "pydantic", "rich"),
            *("ruckig", "toppra", "typer", "yaml"),
        },
    ),
    "controller_emulator": ({"motion", "simplemsg"}, {"pydantic", "uvloop"}),
    "server": ({"motion", "simplemsg"}, {"numpy", "pydantic", "rich", "typer", "uvloop"}),
    "tools": (
        {"controller_emulator", "motion", "server", "simplemsg"},
        {"matplotlib", "numpy", "pydantic", "rich", "typer", "yaml"},
    ),
    "tools/pendants": ({"simplemsg"}, {"rich", "textual", "typer"}),
}

# What the emulator may know of motion: facts and limits and how files are opened, no mathematics
# of arms.
PLAIN_DATA = {
    f"{UMBRELLA}.motion.{module}" for module in ("bounded_file", "errors", "limits", "robot")
}

# Heavy libraries: the only files that may import them.
HOMES = {
    "pinocchio": {"motion/collision.py", "motion/kinematics.py", "motion/serial_model.py"},
    "coal": {"motion/collision_shapes.py"},
    "eigenpy": {"motion/cholesky.py"},
    "toppra": {"motion/toppra_solver.py"},
    "ompl": {"motion/ompl_planner.py"},
    "ruckig": {"motion/jerk_limited.py"},
    "uvloop": {"controller_emulator/event_loop.py", "server/event_loop.py"},
    "textual": {"tools/pendants/terminal/app.py"},
    "matplotlib": {"motion/plan_plot.py", "tools/demo_report.py"},
}

# These take longer to import than the whole program does without them, or are asked for by few.
ONLY_INSIDE_FUNCTIONS = {"matplotlib", "ompl", "ruckig", "toppra", "uvloop"}

# Motion, server and emulator are pure cores, but for these files: no socket, thread or process.
OUTSIDE_WORLD = {"asyncio", "multiprocessing", "select", "socket", "subprocess", "threading"}
SHELLS = {
    "controller_emulator/cli.py",
    "controller_emulator/console.py",
    "controller_emulator/event_loop.py",
    "controller_emulator/links.py",
    "controller_emulator/service.py",
    "server/access/audit_writer.py",
    "server/access/log_queue.py",
    "server/access/password_worker.py",
    "server/access/door.py",
    "server/app.py",
    "server/cli.py",
    "server/client_connection.py",
    "server/controller_addresses.py",
    "server/controller_connection.py",
    "server/event_loop.py",
    "server/listening.py",
    "server/planning/plan_store.py",
    "server/planning/pool.py",
    "server/planning/process.py",
    "server/ports.py",
    "server/access/process_access.py",
    "server/store/writer.py",
    "server/store/door.py",
    "server/store/opening.py",
    "server/watchdog/address.py",
    "server/watchdog/child.py",
    "server/watchdog/process.py",
    "server/watchdog/stop_connection.py",
    "server/watchdog/voice.py",
    "simplemsg/journal_writer.py",
}
CLOCK_READERS = {
    "server/app.py",  # how much of a delay was computed, for the log
    "server/access/process_log.py",  # how many lines went out in the last second
    "server/watchdog/child.py",
    "server/watchdog/process.py",
    "motion/ik.py",  # the outer cap on a search
    "motion/plan_cli.py",  # what a plan cost, and the planner's time limit
    "server/planning/planner.py",  # what a plan cost, measured in the worker
}


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

    def walk(node: ast.AST, inside_function: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from walk(child, inside_function or function)
            for target, relative in _targets(child, package):
                line = getattr(child, "lineno", 0)
                yield Import(file, line, target, relative, inside_function)

    return walk(ast.parse(source, file), inside_function=False)


def _targets(node: ast.AST, package: list[str]) -> Iterator[tuple[str, bool]]:
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield alias.name, False
    elif isinstance(node, ast.ImportFrom):
        base = package[: len(package) - node.level + 1] if node.level else []
        origin = ".".join([*base, *(node.module or "").split(".")]).strip(".")
        for alias in node.names:
            yield f"{origin}.{alias.name}", node.level > 0


def _tree(*folders: str) -> list[Import]:
    return [
        found
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*.py"))
        for found in imports_of(path.read_text("utf-8"), path.relative_to(ROOT).as_posix())
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
    if found.room in ("", own_room):
        return False
    return found.room not in ROOMS[found.home][0]


def climbs_out_of_its_sub_folder(found: Import) -> bool:
    """A sub-folder with rules of its own is closed: nothing of the room around it."""
    inside = f"{UMBRELLA}.{found.home.replace('/', '.')}."
    own_room = found.home.partition("/")[0]
    return "/" in found.home and found.room == own_room and not found.target.startswith(inside)


def crosses_rooms_relatively(found: Import) -> bool:
    return found.relative and found.room != found.file.partition("/")[0]


def names_its_own_room_absolutely(found: Import) -> bool:
    return not found.relative and found.room == found.file.partition("/")[0]


def uses_a_library_its_room_may_not(found: Import) -> bool:
    free = {*sys.stdlib_module_names, UMBRELLA, *TOP_ROOMS}
    return found.library not in free | ROOMS[found.home][1]


def uses_a_heavy_library_away_from_its_home(found: Import) -> bool:
    return found.library in HOMES and found.file not in HOMES[found.library]


def imports_a_slow_library_at_its_top(found: Import) -> bool:
    return found.library in ONLY_INSIDE_FUNCTIONS and not found.inside_function


def knows_more_than_plain_data(found: Import) -> bool:
    if found.home != "controller_emulator" or found.room != "motion":
        return False
    return not any(f"{found.target}.".startswith(f"{module}.") for module in PLAIN_DATA)


def touches_the_outside_world_in_a_core(found: Import) -> bool:
    return (
        not found.home.startswith("tools")
        and found.library in OUTSIDE_WORLD
        and found.file not in SHELLS
    )


def reads_a_clock_in_a_core(found: Import) -> bool:
    return (
        not found.home.startswith("tools")
        and found.library == "time"
        and found.file not in CLOCK_READERS
    )


def runs_on_more_than_the_standard_library(found: Import) -> bool:
    return (
        found.file == "tools/cli.py"
        and not found.inside_function
        and found.library not in sys.stdlib_module_names
    )


RULES: list[Rule] = [
    reaches_a_forbidden_room,
    climbs_out_of_its_sub_folder,
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


@pytest.mark.parametrize("breaks", RULES, ids=lambda rule: rule.__name__)
def test_no_import_breaks_a_rule(breaks: Rule) -> None:
    assert [str(found) for found in ours() if breaks(found)] == []


def test_no_import_names_a_bare_folder_in_the_tests_either() -> None:
    everything = [*ours(), *_tree("tests")]
    assert [str(found) for found in everything if names_a_bare_folder(found)] == []


def test_every_room_is_a_typed_package_and_has_imports_to_judge() -> None:
    for room in TOP_ROOMS:
        assert (ROOT / room / "py.typed").is_file()
        assert any(found.file.startswith(f"{room}/") for found in ours())


def test_the_files_that_the_rules_name_exist() -> None:
    named = {*SHELLS, *CLOCK_READERS, *(file for files in HOMES.values() for file in files)}
    assert sorted(file for file in named if not (ROOT / file).is_file()) == []


@pytest.mark.parametrize(
    ("breaks", "file", "source"),
    [
        (names_a_bare_folder, "server/x.py", "import server"),
        (names_a_bare_folder, "tests/x.py", "from tools.pendants import client"),
        (reaches_a_forbidden_room, "server/x.py", "import openpendant.controller_emulator.cli"),
        (reaches_a_forbidden_room, "controller_emulator/x.py", "from openpendant import server"),
        (reaches_a_forbidden_room, "motion/x.py", "from openpendant.simplemsg import Ping"),
        (reaches_a_forbidden_room, "tools/pendants/x.py", "from openpendant.motion import pose"),
        (climbs_out_of_its_sub_folder, "tools/pendants/x.py", "from ..packets import cli"),
        (crosses_rooms_relatively, "server/x.py", "from ..motion.pose import Pose"),
        (names_its_own_room_absolutely, "server/x.py", "from openpendant.server.core import Core"),
        (uses_a_library_its_room_may_not, "simplemsg/x.py", "import numpy.typing"),
        (uses_a_heavy_library_away_from_its_home, "motion/ik.py", "import pinocchio"),
        (imports_a_slow_library_at_its_top, "motion/toppra_solver.py", "import toppra.algorithm"),
        (knows_more_than_plain_data, "controller_emulator/x.py", "from openpendant import motion"),
        (
            knows_more_than_plain_data,
            "controller_emulator/x.py",
            "from openpendant.motion.pose import Pose",
        ),
        (touches_the_outside_world_in_a_core, "server/core.py", "from asyncio import Queue"),
        (reads_a_clock_in_a_core, "server/core.py", "def f():\n    import time"),
        (runs_on_more_than_the_standard_library, "tools/cli.py", "import typer"),
    ],
)
def test_a_planted_import_is_found(breaks: Rule, file: str, source: str) -> None:
    assert any(breaks(found) for found in imports_of(source, file))


@pytest.mark.parametrize(
    ("file", "source"),
    [
        ("server/uplinks/x.py", "from ..core import Core\nfrom .generic import Uplink"),
        ("controller_emulator/x.py", "from openpendant.motion.robot import load_robot"),
        ("motion/toppra_solver.py", "def fastest_rates():\n    import toppra"),
        ("tools/pendants/x.py", "from .client import PendantClient\nimport asyncio"),
        ("tools/cli.py", "def version():\n    from openpendant.simplemsg import __version__"),
    ],
)
def test_a_proper_import_breaks_no_rule(file: str, source: str) -> None:
    for found in imports_of(source, file):
        assert [rule.__name__ for rule in RULES if rule(found)] == []
