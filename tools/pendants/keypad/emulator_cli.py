"""`openpendant emulate-keypad`: a keypad on screen, on a pseudo-terminal or a socket.

Owns its arguments, the commands of a program that presses its keys, and the exit codes: 0 ended by
its user, 2 wrong usage or no terminal, 3 the port is taken, 69 textual is not installed.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...console import ExitCode, command, complain, emit_json, run
from .emulated_keypad import EmulatedKeypad
from .emulator_line import EmulatedLine, PtyLine, RunningKeypad, SocketLine
from .keys import KEYS, LABELS
from .settings import BAUDS

app = command()

_LONGEST_COMMAND = 200


class _Unusable(Exception):
    """Arguments that cannot be used; the text is for the user."""


class _PortTaken(Exception):
    """The port to listen at is taken; the text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant emulate-keypad` and return its exit code."""
    faults = {_Unusable: ExitCode.USAGE, _PortTaken: ExitCode.REFUSED}
    told = "openpendant emulate-keypad"
    return run(app, "emulate-keypad", argv, faults, lambda text: complain(f"{told}: {text}"))


@app.command()
def emulate(
    link: Annotated[
        Path | None, typer.Option(help="Keep this link to the pseudo-terminal; for --port.")
    ] = None,
    listen: Annotated[
        int | None,
        typer.Option(min=0, max=65_535, help="Listen at a port of this machine instead; 0: any."),
    ] = None,
    baud: Annotated[int, typer.Option(help="What its own page shows.")] = 115_200,
    characters: Annotated[
        bool, typer.Option("--characters", help="Its jumper is set: plain characters, no frames.")
    ] = False,
    no_button: Annotated[
        bool, typer.Option("--no-button", help="It has no enabling button.")
    ] = False,
    commands: Annotated[
        bool,
        typer.Option(
            "--commands",
            help="No screen: a program presses its keys by lines on standard input, as `down 1`,"
            " `up 1`, `button on`, `lcd`, `reset`, `power off`, `pull`, `plug`, `quit`.",
        ),
    ] = False,
) -> None:
    """An emulated keypad pendant: the bytes of the firmware, without a board.

    On its screen Space and F8 are STOP, Esc lets go of all keys. `openpendant keypad` is the bridge
    that serves it.
    """
    if baud not in BAUDS:
        raise _Unusable(f"{baud} baud; accepted: {', '.join(map(str, BAUDS))}")
    if link is not None and listen is not None:
        raise _Unusable("--link goes with a pseudo-terminal, --listen with a socket: choose one")
    if link is not None and link.exists() and not link.is_symlink():
        raise _Unusable(f"{link} is there already, and is no link")
    if not commands:
        if not all(each.isatty() for each in (sys.stdin, sys.stdout, sys.stderr)):
            raise _Unusable("this is no terminal; --commands takes keys from a program")
        importlib.import_module("textual")
    keypad = EmulatedKeypad(baud, button_fitted=not no_button, characters=characters)
    if commands:
        asyncio.run(_by_commands(keypad, link, listen))
    else:
        from .keypad_screen import KeypadApp

        KeypadApp(keypad, lambda: opened_line(link, listen)).run()


async def opened_line(link: Path | None, listen: int | None) -> EmulatedLine:
    """Return the line of an emulated keypad.

    Raises:
        _PortTaken: the port to listen at is taken.
    """
    if listen is None:
        return PtyLine(link)
    line = SocketLine()
    try:
        await line.listen(listen)
    except OSError as error:
        raise _PortTaken(f"cannot listen at port {listen}: {error.strerror}") from None
    return line


async def _by_commands(keypad: EmulatedKeypad, link: Path | None, listen: int | None) -> None:
    running = RunningKeypad(keypad, await opened_line(link, listen))
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader(limit=_LONGEST_COMMAND)
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    going_on = asyncio.ensure_future(running.run())
    loop.add_signal_handler(signal.SIGTERM, going_on.cancel)
    emit_json({"port": running.line.name}, compact=True, flush=True)
    try:
        while not going_on.done():
            line = asyncio.ensure_future(reader.readline())
            await asyncio.wait({line, going_on}, return_when=asyncio.FIRST_COMPLETED)
            if not line.done():
                line.cancel()
                break
            words = line.result().decode("ascii", "replace").split()
            if not line.result() or words == ["quit"]:
                break
            emit_json(carried_out(running, words), compact=True, flush=True)
    finally:
        going_on.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await going_on
        running.line.close()


def carried_out(running: RunningKeypad, words: Sequence[str]) -> dict[str, Any]:
    """Carry out a command of a program that presses keys; return what is answered."""
    keypad = running.keypad
    match words:
        case ["down", label] if (key := _key(label)) is not None:
            keypad.press(key)
        case ["up", "all"]:
            keypad.pressed.clear()
        case ["up", label] if (key := _key(label)) is not None:
            keypad.let_go(key)
        case ["button", "on" | "off" as way]:
            keypad.button = way == "on"
        case ["power", "on" | "off" as way]:
            running.switch(on=way == "on")
        case ["reset"]:
            running.reset()
        case ["pull"]:
            running.line.pull()
        case ["plug"]:
            running.line.plug()
        case ["lcd"]:
            return {"lcd": list(keypad.lcd)}
        case _:
            return {"error": f"no command {' '.join(words)!r}"}
    return {"done": " ".join(words)}


def _key(label: str) -> int | None:
    """Return a key by its label; None for none."""
    key = LABELS.find(label) if len(label) == 1 else -1
    return key if 0 <= key < KEYS else None
