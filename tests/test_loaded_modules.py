"""What is loaded when a program starts: the same rules as `test_layers.py`, seen at run time."""

import json
import subprocess
import sys
from functools import cache

import pytest

NO_ARM_MATHEMATICS = {"pinocchio", "toppra", "ompl", "scipy", "matplotlib"}
SERVER = ("openpendant.server.shell.app", "openpendant.server.cli.serve")
EMULATOR = tuple(
    f"openpendant.controller_emulator.{name}"
    for name in ("shell.cli", "shell.service", "core.controller")
)
ROOMS = ("simplemsg", "motion", "controller_emulator", "server", "tools")


@cache
def loaded_by(*modules: str) -> frozenset[str]:
    script = f"import json, sys, {', '.join(modules)}; print(json.dumps(list(sys.modules)))"
    return frozenset(json.loads(_python(script)))


def _python(script: str) -> str:
    ran = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def test_the_emulator_starts_without_heavy_libraries() -> None:
    loaded = loaded_by(*EMULATOR)
    assert loaded.isdisjoint(NO_ARM_MATHEMATICS | {"numpy", "typer", "rich"})
    assert "openpendant.server" not in loaded


def test_a_pendant_loads_nothing_of_the_server() -> None:
    loaded = loaded_by("openpendant.tools.pendants.client")
    rooms = {name.split(".")[1] for name in loaded if name.startswith("openpendant.")}
    assert rooms == {"simplemsg", "tools"}
    assert loaded.isdisjoint(NO_ARM_MATHEMATICS | {"numpy", "pydantic"})


def test_the_packet_tools_load_no_robot_mathematics() -> None:
    loaded = loaded_by("openpendant.tools.packets.cli")
    assert loaded.isdisjoint(NO_ARM_MATHEMATICS | {"numpy", "openpendant.server"})


def test_robot_facts_load_neither_numpy_nor_heavier() -> None:
    modules = [
        f"openpendant.motion.{name}"
        for name in ("description.robot", "description.limits", "errors")
    ]
    assert loaded_by(*modules).isdisjoint(NO_ARM_MATHEMATICS | {"numpy"})


def test_the_server_starts_without_what_only_its_planning_worker_needs() -> None:
    assert loaded_by(*SERVER).isdisjoint({"toppra", "matplotlib", "scipy"})


def test_a_planning_process_is_warm_without_what_it_never_calls() -> None:
    warm_up = "from openpendant.server.planning.worker.job_planner import warm_up; warm_up('ur5')"
    script = f"import json, sys; {warm_up}; print(json.dumps(list(sys.modules)))"
    loaded = set(json.loads(_python(script)))
    assert "toppra" in loaded
    assert loaded.isdisjoint({"matplotlib", "ompl", "ruckig", "scipy"})


def test_uvloop_is_loaded_for_nobody_who_does_not_ask() -> None:
    assert "uvloop" not in loaded_by(*SERVER)
    assert "uvloop" not in loaded_by(*EMULATOR)


@pytest.mark.parametrize("module", ["openpendant.tools.cli", "openpendant.tools.console"])
def test_the_command_and_its_console_load_the_standard_library_only(module: str) -> None:
    packages = {name.partition(".")[0] for name in loaded_by(module)}
    foreign = packages - loaded_packages_at_start() - set(sys.stdlib_module_names)
    assert foreign == {"openpendant"}


def loaded_packages_at_start() -> set[str]:
    """What an interpreter of this environment holds at once, such as editable-install hooks."""
    return {name.partition(".")[0] for name in loaded_by("json")}


@pytest.mark.soak  # test_layers.py finds the imports that would do it, without running them
def test_no_file_is_loaded_under_two_names() -> None:
    script = f"""
import collections, importlib, json, os, pkgutil, sys

packages = [importlib.import_module("openpendant." + room) for room in {ROOMS!r}]
for package in packages:
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)

folders = tuple(os.path.realpath(package.__path__[0]) + os.sep for package in packages)
names = collections.defaultdict(list)
for name, module in list(sys.modules.items()):
    file = os.path.realpath(getattr(module, "__file__", None) or "")
    if file.startswith(folders):
        names[file].append(name)
print(json.dumps(list(names.values())))
"""
    names = json.loads(_python(script))
    assert len(names) > 50
    assert [several for several in names if len(several) > 1] == []
    assert [name for (name,) in names if not name.startswith("openpendant.")] == []
