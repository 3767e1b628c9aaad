"""What is shipped, and that no file of the project points outside it."""

import email
import importlib.metadata
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from openpendant.simplemsg import __version__

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
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
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
    extras = ["dev", "fast", "fuzz", "motion", "oracle", "plan", "plot", "server", "terminal"]
    assert metadata.get_all("Provides-Extra") == extras


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
