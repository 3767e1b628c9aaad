"""Writes the frozen evidence anew: journals of conversations, bodies, calls, questions and files.

Run by hand, and only where a format, a message or a rule is changed on purpose: what is in this
folder says how the product behaved before a change that must not be seen from outside. Look at
the difference of what was written, and say in the changelog what has changed. The version is in
every hello: where it is changed alone, the journals are recorded anew with it.

    PYTHONPATH=tests .venv/bin/python tests/frozen/record.py --help
    PYTHONPATH=tests .venv/bin/python tests/frozen/record.py journals          # or some of them:
    PYTHONPATH=tests .venv/bin/python tests/frozen/record.py journals jog pose

Machines differ in the last bit of what is calculated, so nothing is recorded in which that shows:
no value that is zero but for rounding, and none with all its digits that does not come out even.
"""

import contextlib
import gzip
import tempfile
from pathlib import Path
from typing import Annotated

import typer
from frozen.cell_to_record import Lines, recorded_cell
from frozen.conversations import CONVERSATIONS, Conversation
from frozen.frozen_files import BODIES, JOURNALS, QUESTIONS, READINGS, SIGNATURES
from rigs.clock.virtual_clock import VirtualLoop

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.callback()
def record() -> None:
    """Write some of the frozen evidence anew."""


@app.command()
def journals(names: Annotated[list[str] | None, typer.Argument()] = None) -> None:
    """Write the journals of all conversations, or of those that are named."""
    JOURNALS.mkdir(exist_ok=True)
    for name in names or CONVERSATIONS:
        for kind, lines in recorded(CONVERSATIONS[name]).items():
            file = JOURNALS / f"{name}.{kind}.journal.gz"
            file.write_bytes(gzip.compress(lines.content, 9, mtime=0))
            typer.echo(
                f"{file.name}: {len(lines.content)} bytes, {file.stat().st_size} in the file"
            )


@app.command()
def bodies() -> None:
    """Write all management requests of the file, and what it lacks, with their answers."""
    # Here, because it needs all rigs of the server.
    from frozen.bodies_to_ask import AskedCell, line_of, steps

    cells: dict[str, AskedCell] = {}
    lines = []
    for name, step in steps(BODIES):
        cell = cells.get(name) or cells.setdefault(name, AskedCell())
        lines.append(line_of(name, step, cell.make(step)))
    BODIES.write_text("".join(f"{line}\n" for line in lines), "utf-8")
    typer.echo(f"{BODIES.name}: {len(lines)} lines")


@app.command()
def signatures() -> None:
    """Write the calls of both Python clients."""
    from frozen.client_calls import Calls

    SIGNATURES.write_text("".join(f"{line}\n" for line in Calls().lines()), "utf-8")


@app.command()
def questions() -> None:
    """Write one question of each kind, as a journal notes it."""
    from frozen.questions import lines

    QUESTIONS.write_text("".join(f"{line}\n" for line in lines()), "utf-8")


@app.command()
def files() -> None:
    """Make the files that nobody wrote by hand, and write down what is found in all of them."""
    from frozen.files_to_make import as_text, copy_files, make_files, readings

    make_files()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        copy_files(Path(folder))
        READINGS.write_text(as_text(readings()), "utf-8")


def recorded(conversation: Conversation) -> dict[str, Lines]:
    """Hold a conversation on the virtual clock; return the journals of server and emulator."""
    kept = {"server": Lines(), "emulator": Lines()}

    async def live(folder: Path) -> None:
        cells, tables = conversation.cells, conversation.tables
        async with recorded_cell(folder, kept, cells=cells, **tables) as cell:
            await conversation.talk(cell)

    with tempfile.TemporaryDirectory() as folder:
        loop = VirtualLoop()
        try:
            loop.run_until_complete(live(Path(folder)))
        finally:
            loop.close()
    return kept


if __name__ == "__main__":
    app()
