"""The command `openpendant`: one table of sub-commands, each imported only when it is called.

Owns what all sub-commands share: help, version, unknown commands, missing extras, interrupts and
closed pipes. Must import nothing but the standard library and `console`, so that `openpendant
emulate` starts where the server's libraries do not exist. Arguments of a sub-command belong to its
own room.

Exit codes: 0 done, 2 wrong usage, 69 something is not installed, 70 a fault of this program, 74 the
output cannot be written, 130 interrupted, 141 the reader of the output went away; other codes are
the sub-command's own.
"""

from __future__ import annotations

import difflib
import gc
import importlib
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from .console import ExitCode, as_typed, complain, discard_output
from .help_text import asks_for_help, in_one_style, run_for_help

TRACEBACK_VARIABLE = "OPENPENDANT_TRACEBACK"
"""Environment variable: when set, an unforeseen error shows its traceback."""


@dataclass(frozen=True, slots=True)
class Command:
    """A sub-command: where its `main(argv: list[str]) -> int` is, and what it does."""

    module: str
    help: str


COMMANDS: Mapping[str, Command] = {
    "start": Command(
        "openpendant.tools.start", "an emulated robot, its server and a pendant, all at once"
    ),
    "demo": Command("openpendant.tools.demo", "watch a pendant move an emulated robot"),
    "serve": Command("openpendant.server.cli.serve", "run the pendant server of a cell"),
    "emulate": Command(
        "openpendant.controller_emulator.shell.cli", "run an emulated robot controller"
    ),
    "pendant": Command("openpendant.tools.pendants.terminal.cli", "a teach pendant in a terminal"),
    "gamepad": Command(
        "openpendant.tools.pendants.gamepad.cli", "a gamepad or a SpaceMouse as a pendant"
    ),
    "keypad": Command(
        "openpendant.tools.pendants.keypad.cli", "the keypad pendant with its LCD on a serial line"
    ),
    "emulate-keypad": Command(
        "openpendant.tools.pendants.keypad.emulator_cli",
        "an emulated keypad on screen, for `keypad` to serve",
    ),
    "web": Command("openpendant.tools.pendants.web.cli", "the pendant as a page for browsers"),
    "stop": Command("openpendant.tools.pendants.commands.stop", "stop the robot; anybody may"),
    "reset": Command("openpendant.tools.pendants.commands.reset", "reset the latched stop"),
    "home": Command("openpendant.tools.pendants.commands.home", "move the robot to its home"),
    "run": Command("openpendant.tools.pendants.commands.run", "run a stored program"),
    "robots": Command("openpendant.motion.cli.robots", "list, show, check, draw and import robots"),
    "plan": Command(
        "openpendant.tools.plan", "plan a motion, offline or at a served cell; facts and files"
    ),
    "store": Command(
        "openpendant.server.cli.store_commands", "show, carry and check saved documents"
    ),
    "users": Command("openpendant.server.cli.users_commands", "list, add and change the accounts"),
    "users pair": Command(
        "openpendant.tools.pendants.commands.pair", "ask a server for the pairing code of a class"
    ),
    "cells": Command(
        "openpendant.tools.pendants.commands.cells", "list the cells of a server, without a login"
    ),
    "connections": Command(
        "openpendant.tools.pendants.commands.connections",
        "show and close the connections of a server, bar an address",
    ),
    "audit": Command("openpendant.server.cli.audit_commands", "show and check the audit log"),
    "program": Command(
        "openpendant.server.cli.program_commands", "check, print and convert programs"
    ),
    "why": Command("openpendant.tools.why", "ask a server why its robot does not move"),
    "packets": Command("openpendant.tools.packets.cli", "decode and encode simple message packets"),
    "completion": Command("openpendant.tools.completion", "print what completes words in a shell"),
}

EXTRA_OF_LIBRARY: Mapping[str, str] = {
    "pinocchio": "server",
    "toppra": "server",
    "matplotlib": "plot",
    "ompl": "plan",
    "ruckig": "motion",
    "textual": "terminal",
    "aiohttp": "web",
    "serial": "serial",
    "serial_asyncio": "serial",
    "uvloop": "fast",
}
"""The extra of the distribution that installs a library which not every sub-command needs."""


def _checkout() -> Path | None:
    """Return the folder of the sources that run here; None for an installed wheel."""
    folder = Path(__file__).resolve().parents[1]
    return folder if (folder / "pyproject.toml").is_file() else None


CHECKOUT = _checkout()
"""Where missing libraries are installed from: openpendant is on no package index."""


def main(argv: Sequence[str] | None = None, *, commands: Mapping[str, Command] = COMMANDS) -> int:
    """Run the command `openpendant`."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    code: int = ExitCode.OK
    try:
        try:
            code = _dispatch(arguments, commands)
        finally:
            if sys.stdout is not None:  # None where the process was started without one
                sys.stdout.flush()  # here, where a closed pipe is still caught
        return code
    except KeyboardInterrupt:
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        discard_output()
        return ExitCode.PIPE_CLOSED
    except OSError as error:
        discard_output()
        # A sub-command that failed has said why already, maybe for this very reason.
        reason = f"cannot write to standard output: {error.strerror or error}"
        return code or _complain(reason, ExitCode.OUTPUT_FAILED)


def _dispatch(arguments: list[str], commands: Mapping[str, Command]) -> int:
    match arguments:
        case []:
            print(_help(commands), file=sys.stderr)
            return ExitCode.USAGE
        case ["-h" | "--help", *_]:
            print(_help(commands))
            return ExitCode.OK
        case ["-V" | "--version", *_]:
            print(f"openpendant {_version()}")
            return ExitCode.OK
        case [first, second, *rest] if f"{first} {second}" in commands:
            return _run(commands[f"{first} {second}"], rest, arguments)
        case [name, *rest] if name in commands:
            return _run(commands[name], rest, arguments)
        case [name, *_]:
            return _complain(_unknown(name, commands), ExitCode.USAGE)
    raise AssertionError("every list of arguments is matched above")


def _run(command: Command, arguments: list[str], line: Sequence[str]) -> int:
    """Run a command with its arguments; `line` is all that was typed after `openpendant`."""
    try:
        main = _imported(command)
        if not asks_for_help(arguments):
            return main(arguments)
        code, text = run_for_help(main, arguments)
        print(in_one_style(text, line) if code == ExitCode.OK else text)
        return code
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library == "openpendant" or not library:
            return _internal_error(error)
        return _complain(_not_installed(library), ExitCode.UNAVAILABLE)
    except BrokenPipeError:
        raise
    except Exception as error:
        return _internal_error(error)


def _imported(command: Command) -> Callable[[list[str]], int]:
    # What is imported stays; looking for garbage among it takes a tenth of the time.
    gc.disable()
    try:
        return main_of(importlib.import_module(command.module))
    finally:
        gc.enable()


def main_of(module: ModuleType) -> Callable[[list[str]], int]:
    """Return what runs the command of a module."""
    main: Callable[[list[str]], int] = module.main
    return main


def _internal_error(error: Exception) -> int:
    if os.environ.get(TRACEBACK_VARIABLE):
        raise error
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    message = f"internal error: {what} (set {TRACEBACK_VARIABLE}=1 to see where)"
    return _complain(message, ExitCode.INTERNAL_ERROR)


def _complain(message: str, code: ExitCode) -> int:
    complain(f"openpendant: {message}")
    return code


def _help(commands: Mapping[str, Command]) -> str:
    width = max(len(name) for name in commands)
    return "\n".join(
        [
            "Usage: openpendant [--help] [--version] COMMAND ...",
            "",
            "A virtual teach pendant, speaking ROS-Industrial simple message.",
            "",
            "Commands:",
            *(f"  {name:<{width}}  {command.help}" for name, command in commands.items()),
            "",
            "`openpendant COMMAND --help` lists a command's own options, with an example.",
            *_typed_otherwise(),
            "",
            "Example: openpendant start --robot ur5",
        ]
    )


def _typed_otherwise() -> list[str]:
    """Return how the command is typed here, where its name alone does not reach it."""
    typed = as_typed()
    return [] if typed == "openpendant" else [f"For `openpendant` type `{typed}` here."]


def _unknown(name: str, commands: Mapping[str, Command]) -> str:
    kind = "option" if name.startswith("-") else "command"
    candidates = ["--help", "--version"] if kind == "option" else list(commands)
    close = difflib.get_close_matches(name, candidates, n=1)
    hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(candidates)}"
    return f"unknown {kind} {name!r}; {hint}"


def _not_installed(library: str) -> str:
    extra = EXTRA_OF_LIBRARY.get(library)
    wanted = f"{CHECKOUT or 'WHEEL'}[{extra}]" if extra else f"{CHECKOUT or 'WHEEL'}"
    pip = f"{sys.executable} -m pip install"
    if CHECKOUT is None:
        how = f"{pip} '{wanted}', where WHEEL is the file that openpendant came in"
    else:
        how = f"{pip} -e '{wanted}'"
    return f"this needs {library}, which is not installed: {how}"


def _version() -> str:
    from openpendant.simplemsg import __version__

    return __version__
