"""Help texts: one style and an example for every command, and the words that shells complete."""

import re
import shlex
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from openpendant.tools.cli import COMMANDS, main
from openpendant.tools.completion import known_words, script
from openpendant.tools.help_text import EXAMPLES, asks_for_help, in_one_style, run_for_help

COLUMNS = 80

words = cache(known_words)


def commands() -> list[str]:
    """Return all commands and sub-commands."""
    return [each for each in words() if each and not each.startswith("-")]


@cache
def help_of(command: str) -> str:
    """Return the help text of a command as its user sees it."""
    code, text = run_for_help(lambda argv: main(argv), [*command.split(), "--help"])
    assert code == 0
    return text


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))


def test_every_command_has_a_help_text_of_one_style_with_an_example() -> None:
    assert len(commands()) > 50
    for command in commands():
        lines = help_of(command).rstrip("\n").split("\n")
        assert lines[0].lstrip().startswith(f"Usage: openpendant {command}"), command
        assert lines[-1].startswith(f"Example: openpendant {command}"), command
        assert not {"usage:", "options:", "positional arguments:"} & set(lines), command


def test_every_help_text_has_one_example() -> None:
    assert {each for each in commands() if help_of(each).count("Example:") != 1} == set()


def test_every_help_text_fits_eighty_columns() -> None:
    for command in ("", *commands()):
        too_long = [each for each in help_of(command).split("\n") if len(each) > COLUMNS]
        assert too_long == [], command


_OPTION = re.compile(r"(?<![\w-])--?[a-z][a-z0-9-]*")


def test_no_example_has_an_option_that_its_command_does_not_know() -> None:
    for command, example in EXAMPLES.items():
        path = max((each for each in commands() if f"{example} ".startswith(f"{each} ")), key=len)
        known = set(_OPTION.findall(help_of(path).partition("\n\nExample:")[0]))
        typed = {each for each in shlex.split(example) if _OPTION.fullmatch(each)}
        assert typed <= known, f"{command}: {example}"


def test_examples_are_of_commands_that_exist() -> None:
    assert set(EXAMPLES) == set(commands())


@pytest.mark.parametrize(
    ("arguments", "asks"),
    [(["fk", "--help"], True), (["-h"], True), (["run", "--", "--help"], False), ([], False)],
)
def test_a_help_text_is_asked_for_by_its_options_alone(arguments: list[str], asks: bool) -> None:
    assert asks_for_help(arguments) == asks


def test_heads_are_changed_where_they_are_heads_only() -> None:
    text = "usage: x\n\noptions:\n  --a  the usage: of options: here\n"
    assert in_one_style(text, ["unknown"]) == (
        "Usage: x\n\nOptions:\n  --a  the usage: of options: here"
    )


def test_robots_are_offered_to_every_command_that_takes_one_by_its_name() -> None:
    offered = {each for each in commands() if "ur5" in words()[each]}
    names = ("show", "draw", "check", "home-check", "fk", "jacobian", "ik")
    assert offered == {f"robots {each}" for each in names}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell_names_every_command_and_is_read_by_it(
    shell: str, tmp_path: Path
) -> None:
    text = script(shell, words())
    assert all(f"'{command}'" in text for command in commands())
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell}: its script is made, and not read")
    file = tmp_path / "script"
    file.write_text(text)
    subprocess.run([shell, "-n", str(file)], check=True, capture_output=True)


def test_the_robots_are_words_of_their_option() -> None:
    assert "ur5" in words()["--robot"]
    assert set(words()[""]) >= {each for each in COMMANDS if " " not in each}
