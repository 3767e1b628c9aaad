"""Every input that ever broke something, the seeds, and a short run of the fuzzer itself."""

import importlib
import importlib.util
import random
from pathlib import Path
from typing import Any

import pytest
from fuzz import run

every_target = pytest.mark.parametrize("name", run.TARGETS)
REGRESSIONS = sorted(run.REGRESSIONS.glob("*/*"))


def target(name: str) -> Any:
    return importlib.import_module(f"fuzz.{name}")


@pytest.mark.parametrize("path", REGRESSIONS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_what_once_broke_a_target_no_longer_does(path: Any) -> None:
    target(path.parent.name).TestOneInput(path.read_bytes())


@every_target
def test_the_seeds_break_nothing(name: str) -> None:
    seeds = list(target(name).seeds())
    assert len(seeds) >= 5
    for seed in seeds:
        target(name).TestOneInput(seed)


@every_target
def test_seeds_with_some_bytes_changed_break_nothing(name: str) -> None:
    chance = random.Random(name)
    for seed in target(name).seeds():
        changed = bytearray(seed)
        for _ in range(3):
            changed[chance.randrange(len(changed))] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
        target(name).TestOneInput(bytes(changed))
        target(name).TestOneInput(bytes(changed[: chance.randrange(len(changed))]))


@every_target
def test_two_thousand_inputs_of_the_fuzzer_break_nothing(name: str, tmp_path: Path) -> None:
    if importlib.util.find_spec("atheris") is None:
        pytest.skip("atheris is not installed")
    outcome = run.fuzz(name, "-runs=2000", tmp_path, seed=1)
    assert (outcome.exit_code, outcome.found) == (0, ()), outcome.log
    assert outcome.executions >= 2_000
