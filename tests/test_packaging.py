"""What is shipped, what it loads, where it points, and what its documents promise."""

import email
import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from openpendant.simplemsg import __version__
from openpendant.tools.cli import COMMANDS

ROOT = Path(__file__).parent.parent
ROOMS = ("simplemsg", "motion", "controller_emulator", "server", "tools")

# In pieces, so that this file does not name them itself.
REGISTRY_HOSTS = [
    "py" + "pi.org",
    "python" + "hosted.org",
    "ana" + "conda.org",
    "npm" + "js.org",
    "npm" + "js.com",
    "ghcr" + ".io",
    "quay" + ".io",
]
MACHINE_PATHS = ["/wo" + "rk/", "/ro" + "ot/", "/ho" + "me/", "/Us" + "ers/", "../sha" + "red"]


@pytest.fixture(scope="module")
def pyproject() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[zipfile.ZipFile]:
    with zipfile.ZipFile(_build("wheel", tmp_path_factory.mktemp("wheel"))) as archive:
        yield archive


def _build(target: str, folder: Path) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    environment = {**os.environ, "OPENPENDANT_NO_PAGE": "1"}
    built = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    (archive,) = folder.iterdir()
    return archive


def test_the_wheel_has_one_import_name(wheel: zipfile.ZipFile) -> None:
    top = {name.partition("/")[0] for name in wheel.namelist()}
    assert top == {"openpendant", f"openpendant-{__version__}.dist-info"}


def test_the_wheel_holds_every_room_typed_and_no_umbrella_module(wheel: zipfile.ZipFile) -> None:
    names = set(wheel.namelist())
    assert {name.split("/")[1] for name in names if name.startswith("openpendant/")} == {*ROOMS}
    for room in ROOMS:
        assert {f"openpendant/{room}/__init__.py", f"openpendant/{room}/py.typed"} <= names


def test_the_wheel_holds_every_robot_file(wheel: zipfile.ZipFile) -> None:
    robots = {f"openpendant/{path.relative_to(ROOT)}" for path in ROOT.glob("motion/robots/*.yaml")}
    assert len(robots) >= 24
    assert robots <= set(wheel.namelist())


def test_the_wheel_holds_no_tests_and_nothing_generated(wheel: zipfile.ZipFile) -> None:
    stray = re.compile(r"(^|/)(tests?/|test_|conftest|__pycache__|\.)")
    assert [name for name in wheel.namelist() if stray.search(name)] == []


def test_the_wheel_carries_the_licence_the_command_and_the_extras(wheel: zipfile.ZipFile) -> None:
    info = f"openpendant-{__version__}.dist-info"
    assert b"Apache License" in wheel.read(f"{info}/licenses/LICENSE")
    assert b"openpendant = openpendant.tools.cli:main" in wheel.read(f"{info}/entry_points.txt")
    metadata = email.message_from_bytes(wheel.read(f"{info}/METADATA"))
    extras = [
        "browser",
        "dev",
        "fast",
        "fuzz",
        "motion",
        "node",
        "oracle",
        "plan",
        "plot",
        "serial",
        "server",
        "terminal",
        "web",
    ]
    assert metadata.get_all("Provides-Extra") == extras


def test_the_wheel_leaves_the_sources_of_the_page_out(wheel: zipfile.ZipFile) -> None:
    held = [name for name in wheel.namelist() if "/pendants/web/" in name]
    assert "openpendant/tools/pendants/web/relay.py" in held
    assert [name for name in held if "/frontend/" in name] == []


def test_the_page_that_was_built_goes_along_though_git_ignores_it(
    pyproject: dict[str, Any],
) -> None:
    targets = pyproject["tool"]["hatch"]["build"]["targets"]
    assert "/tools/pendants/web/page/" in (ROOT / ".gitignore").read_text().splitlines()
    for target in ("wheel", "sdist"):
        assert "tools/pendants/web/page/**" in targets[target]["artifacts"]


def test_the_source_archive_holds_only_what_is_listed(
    tmp_path: Path, pyproject: dict[str, Any]
) -> None:
    listed = pyproject["tool"]["hatch"]["build"]["targets"]["sdist"]["only-include"]
    top = {Path(name).parts[0] for name in listed}
    with tarfile.open(_build("sdist", tmp_path)) as archive:
        held = {Path(name).parts[1] for name in archive.getnames()}
    assert held == top | {"PKG-INFO", "pyproject.toml", ".gitignore"}


def test_the_version_is_written_once() -> None:
    assert importlib.metadata.version("openpendant") == __version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", __version__)


def test_the_changelog_has_a_place_for_what_comes_next() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    unreleased = changelog.partition("\n## [Unreleased]\n")[2].partition("\n## ")[0]
    assert "\n### Added\n" in unreleased
    assert "\n### Wire and file formats\n" in unreleased


def test_constraints_are_exact_versions_and_nothing_else() -> None:
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"[\w.-]+==[\w.]+", line)] == []
    assert len(lines) == len({_name(line) for line in lines})


def test_every_requirement_is_constrained(pyproject: dict[str, Any]) -> None:
    project = pyproject["project"]
    wanted = [
        *pyproject["build-system"]["requires"],
        *project["dependencies"],
        *(line for extra in project["optional-dependencies"].values() for line in extra),
    ]
    constrained = {_name(line) for line in _lines("constraints.txt")}
    assert {_name(line) for line in wanted} - constrained == set()


def test_this_environment_is_the_constrained_one() -> None:
    wanted = {_name(line): line.partition("==")[2] for line in _lines("constraints.txt")}
    installed = {
        _name(distribution.name): distribution.version
        for distribution in importlib.metadata.distributions()
    }
    differing = {
        name: (installed[name], version)
        for name, version in wanted.items()
        if name in installed and installed[name] != version
    }
    assert differing == {}


def test_no_file_names_a_package_registry() -> None:
    assert _mentions(REGISTRY_HOSTS) == []


def test_no_file_points_outside_the_project() -> None:
    assert _mentions(MACHINE_PATHS) == []


def test_no_vendor_of_continuous_integration_is_asked_for() -> None:
    assert [name for name in (".github", ".gitlab-ci.yml") if (ROOT / name).exists()] == []
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111


def _lines(file: str) -> list[str]:
    return (ROOT / file).read_text("utf-8").splitlines()


def _name(requirement: str) -> str:
    found = re.match(r"[\w.-]+", requirement)
    assert found, requirement
    return re.sub(r"[-_.]+", "-", found[0]).lower()


def _mentions(words: list[str]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)}: {word}"
        for path in _project_files(ROOT)
        for text in [path.read_bytes().decode("utf-8", "ignore")]
        for word in words
        if word in text
    ]


def _project_files(folder: Path) -> Iterator[Path]:
    """Walk what git would track; read from .gitignore, as there may be no git here."""
    ignored = {".git", *(line.strip("/") for line in _lines(".gitignore"))}
    for path in sorted(folder.iterdir()):
        if path.name in ignored or path.is_symlink():
            continue
        if path.is_dir():
            yield from _project_files(path)
        else:
            yield path


NO_ARM_MATHEMATICS = {"pinocchio", "toppra", "ompl", "scipy", "matplotlib"}
SERVER = ("openpendant.server.shell.app", "openpendant.server.cli.serve")
EMULATOR = tuple(
    f"openpendant.controller_emulator.{name}"
    for name in ("shell.cli", "shell.service", "core.controller")
)


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


DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted(ROOT.glob("docs/*.md"))]

every_document = pytest.mark.parametrize(
    "document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix()
)


@every_document
def test_every_link_inside_the_project_leads_somewhere(document: Path) -> None:
    targets = re.findall(r"\]\(([^)#]+)[^)]*\)", document.read_text("utf-8"))
    inside = [target for target in targets if "://" not in target]
    assert [target for target in inside if not (document.parent / target).exists()] == []


@every_document
def test_every_make_target_and_command_exists(document: Path) -> None:
    code = "\n".join(re.findall(r"```.*?```|`[^`\n]+`", document.read_text("utf-8"), re.DOTALL))
    targets = set(re.findall(r"(?m)^([a-z]+):", (ROOT / "Makefile").read_text("utf-8")))
    assert set(re.findall(r"\bmake (?:[A-Z]+=\S+ )?([a-z]+)\b", code)) <= targets
    assert set(re.findall(r"\bopenpendant ([a-z]+)\b", code)) <= set(COMMANDS)


def test_every_page_is_listed_in_the_index() -> None:
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    pages = {path.name for path in ROOT.glob("docs/*.md")} - {"index.md"}
    assert {page for page in pages if f"({page})" not in index} == set()


def test_the_picture_is_well_formed() -> None:
    assert ElementTree.parse(ROOT / "docs" / "parts.svg").getroot().tag.endswith("svg")


FIELD_TERMS: dict[str, list[str]] = tomllib.loads(
    (ROOT / "tests" / "field_terms.toml").read_text("utf-8")
)


@pytest.mark.parametrize("page", FIELD_TERMS)
def test_a_term_of_the_field_stands_on_the_page_where_a_reader_looks_for_it(page: str) -> None:
    text = (ROOT / page).read_text("utf-8").lower()
    assert [term for term in FIELD_TERMS[page] if term.lower() not in text] == []
