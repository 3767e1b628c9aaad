"""The runner of `make mutants`, on a project of three files."""

import os
import subprocess
import time
from pathlib import Path

import pytest
from mutants.command_line import holds, summary
from mutants.mutant_runs import MutantRuns, Outcome, TestRun, Verdict, judged
from mutants.mutant_table import Mutant, NoSuchBase, changed_since, matching

pytestmark = pytest.mark.harness

_DIES_WITHIN = 10.0
"""So long may a killed process wait for a processor [s]."""

PRODUCT = """
def least(a, b):
    return min(a, b)
"""

TESTS = """
import subprocess, sys
sys.path.insert(0, "linked")

def test_least():
    from package.product import least
    assert least(1, 2) == 1

def test_least_in_a_process():
    asked = "import sys; sys.path[0] = 'linked'; import package.product as p; print(p.least(1, 2))"
    ran = subprocess.run([sys.executable, "-c", asked], capture_output=True)
    assert ran.stdout == b"1\\n"

def test_of_something_else():
    process = subprocess.Popen(["sleep", "600"])
    with open("left_behind", "w") as file:
        file.write(str(process.pid))

def test_red():
    assert False
"""

BARE = tuple(
    word
    for plugin in ("hypothesispytest", "pytest_cov", "asyncio", "timeout")
    for word in ("-p", f"no:{plugin}")
)
"""Options that leave out the plugins of this project: each takes its time to import."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project that imports its package through a link, as the editable install does."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "package").mkdir()
    (folder / "package" / "product.py").write_text(PRODUCT)
    (folder / "linked").mkdir()
    (folder / "linked" / "package").symlink_to("../package", target_is_directory=True)
    (folder / "test_product.py").write_text(TESTS)
    (folder / "pytest.ini").write_text("[pytest]\n")
    return folder


@pytest.fixture(scope="module")
def runs(project: Path) -> MutantRuns:
    return MutantRuns(project, options=BARE)


def row(*tests: str, before: str = "min(", after: str = "max(") -> Mutant:
    ids = tuple(f"test_product.py::{test}" for test in tests)
    return Mutant("a-fault", "package/product.py", before, after, ids, "room")


def test_a_fault_is_found_by_the_test_that_fails_with_it(runs: MutantRuns) -> None:
    outcome = runs.judge(row("test_least"))
    assert outcome.verdict is Verdict.FOUND
    assert "test_least - assert 2 == 1" in outcome.said


def test_a_fault_reaches_the_processes_that_a_test_starts(runs: MutantRuns) -> None:
    assert runs.judge(row("test_least_in_a_process")).verdict is Verdict.FOUND


def test_a_fault_that_its_tests_pass_over_survives(runs: MutantRuns) -> None:
    assert runs.judge(row("test_least", after="sum((0,)) or min(")).verdict is Verdict.SURVIVED


def test_neither_the_file_nor_its_bytecode_keeps_a_fault(runs: MutantRuns, project: Path) -> None:
    assert runs.judge(row("test_least")).verdict is Verdict.FOUND
    assert (project / "package" / "product.py").read_text() == PRODUCT
    assert runs.judge(row("test_least", after="min( ")).verdict is Verdict.SURVIVED


def test_a_fault_that_no_process_imports_fails_its_row(runs: MutantRuns) -> None:
    outcome = runs.judge(row("test_of_something_else"))
    assert outcome.verdict is Verdict.FAILED
    assert "no process of its tests imported package/product.py" in outcome.said


def test_what_a_test_left_behind_is_ended(runs: MutantRuns, project: Path) -> None:
    runs.judge(row("test_of_something_else"))
    left = int((project / "left_behind").read_text())
    deadline = time.monotonic() + _DIES_WITHIN
    while is_alive(left):  # what is killed still needs a processor to end
        assert time.monotonic() < deadline, f"process {left} is alive"
        time.sleep(0.01)


def is_alive(process: int) -> bool:
    """Return True unless a process has ended; it is a zombie until its parent looks."""
    try:
        status = Path(f"/proc/{process}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


@pytest.mark.parametrize(
    ("mutant", "said"),
    [
        (row("test_least", before="sum("), "stands 0 times in package/product.py"),
        (row("test_least", before="a, b"), "stands 2 times in package/product.py"),
        (row("test_least", after="max(("), "was never closed"),
        (row("test_red"), "its tests do not pass on the code as it is"),
    ],
)
def test_a_row_that_could_show_nothing_fails(runs: MutantRuns, mutant: Mutant, said: str) -> None:
    outcome = runs.judge(mutant)
    assert outcome.verdict is Verdict.FAILED
    assert said in outcome.said


def test_an_equivalent_fault_is_not_planted(runs: MutantRuns) -> None:
    mutant = Mutant("same", "nowhere.py", "", "", (), "room", equivalent="min of two equal values")
    assert runs.judge(mutant).verdict is Verdict.EQUIVALENT


def test_tests_that_do_not_end_in_time_are_ended(project: Path) -> None:
    ran = MutantRuns(project, 0.05, BARE).run_unchanged(("test_product.py::test_least",))
    assert ran.code is None


@pytest.mark.parametrize(
    ("code", "loaded", "quick", "verdict"),
    [
        (0, True, True, Verdict.SURVIVED),
        (1, True, True, Verdict.FOUND),
        (1, True, False, Verdict.FOUND),
        (None, True, True, Verdict.HUNG),
        (None, True, False, Verdict.FAILED),  # it may only have been slow
        (2, True, True, Verdict.FAILED),  # its tests could not be collected
        (5, True, True, Verdict.FAILED),
        (-11, True, True, Verdict.FAILED),
        (0, False, True, Verdict.FAILED),
        (1, False, True, Verdict.FAILED),  # it failed for another reason
        (None, False, True, Verdict.FAILED),
    ],
)
def test_how_pytest_ended_is_judged(
    code: int | None, loaded: bool, quick: bool, verdict: Verdict
) -> None:
    assert judged(row(), TestRun(code, 1.0, ""), loaded, quick).verdict is verdict


def outcomes(found: int, survived: int, failed: int = 0) -> list[Outcome]:
    verdicts = [Verdict.FOUND] * found + [Verdict.SURVIVED] * survived + [Verdict.FAILED] * failed
    return [Outcome(row(), verdict) for verdict in (*verdicts, Verdict.EQUIVALENT)]


@pytest.mark.parametrize(
    ("ended", "as_wanted"),
    [
        (outcomes(19, 1), True),
        (outcomes(18, 1), False),
        (outcomes(20, 0, failed=1), False),
        (outcomes(0, 0), True),
    ],
)
def test_it_holds_where_no_row_failed_and_95_in_100_were_found(
    ended: list[Outcome], as_wanted: bool
) -> None:
    assert holds(ended) is as_wanted


def test_the_summary_names_who_survived_and_counts_the_rest() -> None:
    said = summary(outcomes(18, 1, failed=1))
    assert "SURVIVED: a-fault (package/product.py)" in said
    assert "18 of 20 found (90.0 %), 0 of them by a hang; 1 survived, 1 equivalent" in said


def test_rows_are_chosen_by_a_part_of_their_name_file_or_test() -> None:
    rows = [row("test_least")]
    for pattern in ("fault", "product.py", "room", "::test_least", "a-*"):
        assert matching(rows, pattern) == rows
    assert matching(rows, "nothing of it") == []


class TestChangedRows:
    @pytest.fixture
    def repository(self, tmp_path: Path) -> Path:
        project = tmp_path
        (project / "package").mkdir()
        (project / "package" / "product.py").write_text(PRODUCT)
        (project / "test_product.py").write_text(TESTS)
        (project / "tests" / "mutants").mkdir(parents=True)
        (project / "tests" / "mutants" / "room.toml").write_text("")
        for command in ("init -q", "add .", "-c user.name=a -c user.email=a@b commit -qm a"):
            self.git(project, command)
        return project

    @staticmethod
    def git(folder: Path, command: str) -> None:
        kept = {name: value for name, value in os.environ.items() if "GIT" not in name}
        subprocess.run(["git", *command.split()], cwd=folder, env=kept, check=True)

    def test_nothing_changed_is_no_row(self, repository: Path) -> None:
        assert changed_since([row("test_least")], "HEAD", repository) == []

    @pytest.mark.parametrize("path", ["package/product.py", "test_product.py"])
    def test_a_changed_file_or_test_is(self, repository: Path, path: str) -> None:
        (repository / path).write_text("# other\n")
        rows = [row("test_least")]
        assert changed_since(rows, "HEAD", repository) == rows
        self.git(repository, "-c user.name=a -c user.email=a@b commit -qam b")
        assert changed_since(rows, "HEAD", repository) == []
        assert changed_since(rows, "HEAD~1", repository) == rows

    def test_a_new_row_of_a_known_room_is(self, repository: Path) -> None:
        known, new = row("test_least"), row("test_nothing")
        text = f'[[mutant]]\nname = "a-fault"\nfile = "{known.file}"\nbefore = "min("\n'
        text += 'after = "max("\ntests = ["test_product.py::test_least"]\n'
        (repository / "tests" / "mutants" / "room.toml").write_text(text)
        self.git(repository, "-c user.name=a -c user.email=a@b commit -qam b")
        (repository / "tests" / "mutants" / "room.toml").write_text(text + text)
        assert changed_since([known, new], "HEAD", repository) == [new]

    def test_a_base_that_git_does_not_know_is_told(self, repository: Path) -> None:
        with pytest.raises(NoSuchBase, match="nowhere"):
            changed_since([row("test_least")], "nowhere", repository)
