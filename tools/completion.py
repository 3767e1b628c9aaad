"""`openpendant completion`: a script by which a shell completes commands, options and robots.

The script is made from the table of commands, the sub-commands of each and the options that their
help texts name, so that it knows what this version of openpendant knows. Exit codes: 0 done, 2 no
such shell.
"""

from __future__ import annotations

import argparse
import importlib
import re
from collections.abc import Mapping

from openpendant.motion.description.robot import robot_names

from .cli import COMMANDS, main_of
from .help_text import run_for_help

_OPTION = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*")
_COMMANDS_HEAD = re.compile(r"^(?:commands|tools):$", re.MULTILINE | re.IGNORECASE)
_ROBOT_ARGUMENT = re.compile(r"[]{[] ?NAME\|FILE")
_COMMAND = re.compile(r"^  ([a-z][a-z-]*)(?:  |$)")

ROBOT = "--robot"
"""The words that may follow this option stand under its name."""


def known_words() -> dict[str, list[str]]:
    """Return the words that may follow each command, by the command's words; "" is `openpendant`.

    What a command whose libraries are not installed takes is not known, and left out.
    """
    plain = [name for name in COMMANDS if " " not in name]
    robots = list(robot_names())
    words = {"": [*plain, "--help", "--version"], ROBOT: robots}
    for name, command in COMMANDS.items():
        first, _, second = name.partition(" ")
        if second:
            words.setdefault(first, []).append(second)
        try:
            text = _help_text(command.module)
        except ModuleNotFoundError:
            continue
        subcommands = _subcommands(text)
        words.setdefault(name, []).extend([*subcommands, *_options(text)])
        for each in subcommands:
            text = _help_text(command.module, each)
            words[f"{name} {each}"] = [*(robots if _takes_robot(text) else ()), *_options(text)]
    return words


def _help_text(module: str, *words: str) -> str:
    return run_for_help(main_of(importlib.import_module(module)), [*words, "--help"])[1]


def _options(text: str) -> list[str]:
    return sorted(set(_OPTION.findall(text)))


def _takes_robot(text: str) -> bool:
    """Return True if the usage in a help text has a robot without an option before it."""
    return _ROBOT_ARGUMENT.search(text.split("\n\n")[0]) is not None


def _subcommands(text: str) -> list[str]:
    """Return the commands that a help text lists under its head of that name."""
    head = _COMMANDS_HEAD.search(text)
    if head is None:
        return []
    listed = text[head.end() :].lstrip("\n").split("\n\n")[0]
    return [found[1] for line in listed.split("\n") if (found := _COMMAND.match(line))]


_POSIX = """# Completion of openpendant for {shell}, made by: openpendant completion {shell}
_openpendant_words() {{
  case "$1" in
{cases}
  esac
}}
_openpendant_follow() {{
  # Prints the words that may follow those given: sub-commands lead on, options do not.
  local at="" last="" word
  for word in "$@"; do
    last="$word"
    case "$word" in
      -*) ;;
      *) [ -n "$(_openpendant_words "${{at:+$at }}$word")" ] && at="${{at:+$at }}$word" ;;
    esac
  done
  [ "$last" = --robot ] && at=--robot
  _openpendant_words "$at"
}}
"""

_BASH = """_openpendant() {
  local given=("${COMP_WORDS[@]:1:COMP_CWORD-1}")
  COMPREPLY=($(compgen -W "$(_openpendant_follow "${given[@]}")" -- "${COMP_WORDS[COMP_CWORD]}"))
}
complete -o default -F _openpendant openpendant
"""

_ZSH = """_openpendant() {
  compadd -- ${=$(_openpendant_follow "${(@)words[2,CURRENT-1]}")}
  _files
}
compdef _openpendant openpendant
"""

_FISH = """# Completion of openpendant for fish, made by: openpendant completion fish
function __openpendant_words
  switch "$argv[1]"
{cases}
  end
end
function __openpendant_follow
  set -l given (commandline -opc)[2..-1]
  set -l at ""
  set -l last ""
  for word in $given
    set last $word
    if not string match -q -- '-*' $word
      set -l next (string trim "$at $word")
      if test -n "$(__openpendant_words $next)"
        set at $next
      end
    end
  end
  if test "$last" = --robot
    set at --robot
  end
  __openpendant_words "$at"
end
complete -c openpendant -a '(__openpendant_follow)'
"""


def script(shell: str, words: Mapping[str, list[str]]) -> str:
    """Return the script of a shell: bash, zsh or fish."""
    if shell == "fish":
        cases = "\n".join(
            f"    case '{at}'\n      printf '%s\\n' {' '.join(each)}" for at, each in words.items()
        )
        return _FISH.format(cases=cases)
    cases = "\n".join(f"    '{at}') echo '{' '.join(each)}' ;;" for at, each in words.items())
    return _POSIX.format(shell=shell, cases=cases) + (_BASH if shell == "bash" else _ZSH)


def main(argv: list[str]) -> int:
    """Run `openpendant completion` with arguments; return the exit code."""
    reader = argparse.ArgumentParser(
        prog="openpendant completion",
        description="Print a script by which a shell completes the words of openpendant. bash:"
        " source the file of the example in ~/.bashrc. zsh: source it after compinit."
        " fish: write it to ~/.config/fish/completions/openpendant.fish.",
        epilog="Exit codes: 0 done, 2 wrong usage.",
    )
    reader.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell it is for")
    arguments = reader.parse_args(argv)
    print(script(arguments.shell, known_words()), end="")
    return 0
