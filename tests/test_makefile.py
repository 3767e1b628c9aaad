"""The two commands of the README, with an interpreter that only writes down what it is asked."""

import os
import re
import shutil
import stat
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="make is not here")

# Stands in for `python3` and, once "installed", for the interpreter of the environment.
INTERPRETER = """#!/bin/sh
echo "$@" >> "$LOG"
[ -z "$PYTHONDONTWRITEBYTECODE" ] || echo "compiles in vain" >> "$LOG"
case "$*" in
    *version_info*) exit "${TOO_OLD:-0}" ;;
    *ensurepip*) exit "${NO_VENV:-0}" ;;
    *"-m venv"*) mkdir -p .venv/bin && cp "$0" .venv/bin/python && cp "$0" .venv/bin/openpendant ;;
    *web/build.py*) [ -z "$NO_PAGE" ] || exit 1 ;;
    *"install"*"-e "*)
        [ -z "$NO_WHEELS" ] || exit 1
        mkdir -p .dev/openpendant/simplemsg && : > .dev/openpendant/simplemsg/__init__.py ;;
esac
"""


@dataclass
class Project:
    folder: Path
    log: Path
    interpreter: Path

    def make(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        """Run make; what was given to an outer one must not reach it.

        That hands its arguments on in its own variables, and in those of the Makefile.
        """
        self.log.write_text("")
        own = re.findall(r"(?m)^(\w+) \?=", (self.folder / "Makefile").read_text())
        kept = {
            name: value
            for name, value in os.environ.items()
            if "MAKE" not in name and name not in own
        }
        return subprocess.run(
            ["make", f"PYTHON={self.interpreter}", *arguments],
            cwd=self.folder,
            env={**kept, "LOG": str(self.log), **environment},
            capture_output=True,
            text=True,
            check=False,
        )

    @property
    def calls(self) -> list[str]:
        return self.log.read_text().splitlines()

    @property
    def installed(self) -> list[str]:
        """What was installed by the last run, such as `-e .[server,plot,terminal]`."""
        return [call.rpartition("constraints.txt ")[2] for call in self.calls if "-c con" in call]


@pytest.fixture
def project(tmp_path: Path) -> Project:
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("Makefile", "pyproject.toml", "constraints.txt", "hatch_build.py"):
        shutil.copy(ROOT / name, folder)
    interpreter = tmp_path / "python3"
    interpreter.write_text(INTERPRETER)
    interpreter.chmod(interpreter.stat().st_mode | stat.S_IXUSR)
    return Project(folder, tmp_path / "log", interpreter)


def test_help_is_the_default_and_lists_the_targets(project: Project) -> None:
    shown = project.make()
    assert shown.returncode == 0
    for target in (
        "demo",
        "test",
        "conformance",
        "harness",
        "firmware",
        "firmware-test",
        "bench",
        "lint",
        "soak",
        "walk",
        "audit",
        "clean",
    ):
        assert f"  make {target} " in shown.stdout
    assert project.calls == []


RUN = "--no-build-isolation -e .[server,plot,terminal"
LANES = (
    "tests/run_lanes.py --workers 2 --beside .venv/bin/python -m ruff check ."
    " --beside .venv/bin/python -m ruff format --check ."
    " --beside .venv/bin/python -m mypy simplemsg motion server controller_emulator tools --"
)


@pytest.mark.parametrize(
    ("arguments", "extras", "call"),
    [
        (["demo", "ROBOT=abb_irb2400"], "]", "demo --robot abb_irb2400"),
        (["demo"], "]", "demo --robot ur5"),
        (["test"], ",dev]", LANES),
    ],
)
def test_a_target_installs_what_it_needs_and_runs_its_command(
    project: Project, arguments: list[str], extras: str, call: str
) -> None:
    assert project.make(*arguments).returncode == 0
    assert project.installed == ["hatchling", f"{RUN}{extras}"]
    assert project.calls[-1] == call


def test_firmware_tests_run_the_marked_tests_of_their_places(project: Project) -> None:
    assert project.make("firmware-test").returncode == 0
    places = ["tests/tools/pendants/keypad/firmware", "tests/system/test_keypad_pendant.py"]
    assert project.calls[-1] == f"-m pytest -m firmware and not soak --workers=2 {' '.join(places)}"
    assert all((ROOT / place).exists() for place in places)


def test_firmware_without_its_compiler_is_skipped_with_a_line(project: Project) -> None:
    tools = project.folder / "tools-here"
    tools.mkdir()
    for name in ("make", "sh", "cat", "sed"):
        (tools / name).symlink_to(shutil.which(name) or "")
    done = project.make("firmware", PATH=str(tools))
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr.startswith("openpendant: no avr-gcc here, no firmware.")


def test_audit_installs_what_runs_and_nothing_of_the_tests(project: Project) -> None:
    assert project.make("audit").returncode == 0
    assert project.installed == ["hatchling", f"{RUN}]"]
    assert project.calls[-1] == "tests/known_vulnerabilities.py"


def test_pendant_builds_the_page_and_starts_all_where_it_could_not_too(project: Project) -> None:
    for failing in ("", "1"):
        assert project.make("pendant", "ROBOT=abb_irb2400", NO_PAGE=failing).returncode == 0
        assert project.calls[-2:] == [
            "tools/pendants/web/build.py --fetch-node",
            "-m openpendant.tools.start_page --robot abb_irb2400",
        ]


def test_pendant_installs_the_gateway_after_what_the_demo_needs(project: Project) -> None:
    project.make("pendant")
    assert project.installed == ["hatchling", f"{RUN}]", "hatchling", f"{RUN},web]"]
    project.make("pendant")
    assert project.installed == []


@pytest.mark.parametrize("target", ["browser", "wheel"])
def test_what_needs_the_page_ends_where_it_cannot_be_built(project: Project, target: str) -> None:
    assert project.make(target).returncode == 0
    assert project.make(target, NO_PAGE="1").returncode != 0
    assert "tools/pendants/web/build.py --fetch-node" in project.calls[-1]


def test_lint_runs_the_same_commands(project: Project) -> None:
    assert project.make("lint").returncode == 0
    assert project.calls[-3:] == ["-m ruff check .", "-m ruff format --check .", "-m mypy ."]


BENCH = "-m openpendant.tools.bench"


@pytest.mark.parametrize(
    ("arguments", "call"),
    [
        (["test", "WORKERS=3"], "tests/run_lanes.py --workers 3 "),
        (["test", "PYTEST_ARGS=tests/motion -k 'a or b'"], " -- tests/motion -k a or b\n"),
        (["soak", "PYTEST_ARGS=tests/x"], "\ntests/run_lanes.py --soak --workers 2 -- tests/x\n"),
        (["bench"], f"\n{BENCH}\n"),
        (["bench", "BASE=v1", "BENCH=*5 p*"], f"\n{BENCH} --base v1 --only *5 p*\n"),
        (["bench", "BENCH=x", "BENCH_ARGS=--quick"], f"\n{BENCH} --quick --only x\n"),
        (["mutants", "MUTANTS=changed"], "--base HEAD changed"),
        (["mutants", "MUTANTS=changed", "BASE=v1"], "--base v1 changed"),
    ],
)
def test_what_make_is_given_reaches_the_command(
    project: Project, arguments: list[str], call: str
) -> None:
    project.make(*arguments)
    assert call in f"\n{project.calls[-1]}\n"


def test_what_an_outer_make_was_given_does_not_reach_the_inner_one(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTEST_ARGS", "-k nothing")
    monkeypatch.setenv("MAKEFLAGS", " -- PYTEST_ARGS=-k\\ nothing")
    project.make("test")
    assert project.calls[-1].endswith(" controller_emulator tools --")


@pytest.mark.parametrize("target", ["demo", "test"])
def test_a_second_run_installs_nothing(project: Project, target: str) -> None:
    project.make(target)
    assert project.make(target).returncode == 0
    assert project.installed == []


def test_demo_after_test_installs_nothing(project: Project) -> None:
    project.make("test")
    project.make("demo")
    assert project.installed == []


@pytest.mark.parametrize(
    "changed", ["Makefile", "pyproject.toml", "constraints.txt", "hatch_build.py"]
)
def test_changed_requirements_are_installed(project: Project, changed: str) -> None:
    project.make("demo")
    newer = (project.folder / ".venv" / "demo.stamp").stat().st_mtime + 10
    os.utime(project.folder / changed, (newer, newer))
    project.make("demo")
    assert project.installed != []


def test_a_failed_installation_is_tried_again(project: Project) -> None:
    failed = project.make("demo", NO_WHEELS="1")
    assert failed.returncode != 0
    assert "openpendant: the installation failed" in failed.stderr
    assert not (project.folder / ".venv" / "demo.stamp").exists()
    assert project.make("demo").returncode == 0
    assert project.installed != []


def test_what_python_compiled_is_kept_whatever_the_environment_says(project: Project) -> None:
    assert project.make("demo", PYTHONDONTWRITEBYTECODE="1").returncode == 0
    assert "compiles in vain" not in project.calls


def test_a_deleted_link_folder_is_made_again(project: Project) -> None:
    project.make("demo")
    shutil.rmtree(project.folder / ".dev")
    project.make("demo")
    assert project.installed != []


def test_a_moved_project_is_installed_again(project: Project) -> None:
    project.make("test")
    project.folder = project.folder.rename(project.folder.with_name("moved here"))
    assert project.make("test").returncode == 0
    assert project.installed != []
    project.make("test")
    assert project.installed == []


@pytest.mark.parametrize(
    ("trouble", "said"),
    [
        ({"TOO_OLD": "1"}, "is older than Python 3.11"),
        ({"NO_VENV": "1"}, "has no venv module"),
    ],
)
def test_an_unfit_interpreter_is_named_in_one_line(
    project: Project, trouble: dict[str, str], said: str
) -> None:
    refused = project.make("demo", **trouble)
    assert refused.returncode != 0
    lines = [line for line in refused.stderr.splitlines() if line.startswith("openpendant:")]
    assert len(lines) == 1
    assert said in lines[0]
    assert not (project.folder / ".venv").exists()


def test_a_missing_interpreter_is_named_in_one_line(project: Project) -> None:
    refused = project.make("test", "PYTHON=python-of-nowhere")
    assert refused.returncode != 0
    assert "openpendant: no 'python-of-nowhere' here." in refused.stderr


def test_clean_leaves_no_environment(project: Project) -> None:
    project.make("demo")
    assert project.make("clean").returncode == 0
    assert not (project.folder / ".venv").exists()
    assert not (project.folder / ".dev").exists()


def test_clean_removes_the_page_and_what_built_it(project: Project) -> None:
    web = project.folder / "tools" / "pendants" / "web"
    for made in (web / "page", web / "frontend" / "node_modules"):
        made.mkdir(parents=True)
    project.make("clean")
    assert [each.name for each in web.rglob("*")] == ["frontend"]
