"""What a fault script may say, and what its author is told when it says something else."""

from pathlib import Path

import pytest

from openpendant.tools.packets.faults import main
from openpendant.tools.packets.faulty.fault_catalogue import CORRECT_PEER, explain, list_faults
from openpendant.tools.packets.faulty.fault_script import (
    RULE_CLASSES,
    FaultScriptError,
    load_script,
)

EXAMPLES = sorted((Path(__file__).parents[3] / "examples" / "faults").glob("*.toml"))
DELAY = '[[rule]]\nfault = "delay"\n'

WRONG: dict[str, tuple[str | bytes, str]] = {
    "no TOML": ("[[rule]", "is no TOML: "),
    "no UTF-8": (b"\xff", "is no TOML: "),
    "no rules": ("", "rule: is missing"),
    "a rule that is none": ("rule = 3", "rule: Input should be a valid tuple"),
    "an unknown fault": ('[[rule]]\nfault = "explode"', "rule 1: fault: expected one of delay, "),
    "no fault": ("[[rule]]\nms = 3", "rule 1: fault: expected one of delay, "),
    "a missing key": (DELAY, "rule 1: ms: is missing"),
    "a key too many": (DELAY + "ms = 1\nfoo = 2", "rule 1: foo: unknown key; known here: match, "),
    "a wrong value": (DELAY + "ms = -1", "rule 1: ms: Input should be greater than or equal to 0"),
    "a wrong kind": (DELAY + 'ms = "soon"', "rule 1: ms: Input should be a valid number"),
    "a wrong match": (DELAY + "ms = 1\nmatch = {foo = 1}", "rule 1: match.foo: unknown key; known"),
    "a wrong direction": (
        DELAY + 'ms = 1\nmatch = {direction = "up"}',
        "rule 1: match.direction: Input should be 'to_server' or 'to_client'; got 'up'",
    ),
    "an unknown type": (
        DELAY + 'ms = 1\nmatch = {type = "jump"}',
        "rule 1: match.type: 'jump' is no message of the standard dialect",
    ),
    "the second rule": (DELAY + "ms = 1\n" + DELAY, "rule 2: ms: is missing"),
    "no way to cut": ('[[rule]]\nfault = "split"', "rule 1: give either at or size"),
    "an unknown key on top": ("sed = 3\nrule = []", "sed: unknown key; known here: about, "),
    "nesting without end": ("a = " + "[" * 20_000, "is no TOML: "),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_script_is_one_line_with_file_rule_and_key(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, reason = WRONG[case]
    file = tmp_path / "script.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert main(["--explain", str(file)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{file}: {reason}")
    assert len(line) < 500


def test_a_script_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(FaultScriptError, match="cannot be read: No such file"):
        load_script(tmp_path / "nowhere.toml")


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda path: path.name)
def test_the_examples_are_scripts_and_can_be_explained(file: Path) -> None:
    script = load_script(file)
    lines = explain(script).splitlines()
    assert lines[0] == script.about
    assert [line for line in lines if line.startswith("rule ")] != []


def test_a_script_is_explained_in_words(tmp_path: Path) -> None:
    file = tmp_path / "script.toml"
    file.write_text(DELAY + 'ms = 20\nmatch = {direction = "to_server", type = 11, nth = 2}')
    assert explain(load_script(file)).splitlines() == [
        "messages: standard, seed: 0",
        "rule 1: every frame from client to server of type 11 but only no. 2: delay, which holds a"
        " frame back; what follows it waits too, as on a slow line (ms 20, jitter_ms 0)",
        "every other frame passes as it is",
    ]


def test_every_fault_is_listed_with_what_a_correct_peer_does(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert set(CORRECT_PEER) == set(RULE_CLASSES)
    assert main(["--list"]) == 0
    printed = capsys.readouterr().out
    assert printed.rstrip("\n") == list_faults()
    for name in RULE_CLASSES:
        assert f"\n{name}: " in f"\n{printed}"


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "a script is needed"),
        ([str(EXAMPLES[0])], "--listen and --to are needed"),
        ([str(EXAMPLES[0]), "--listen", "0"], "1 --listen need as many --to, not 0"),
    ],
)
def test_what_is_missing_is_said(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert reason in capsys.readouterr().err
