"""Records and saves until it is killed; run as a script by the tests of the store.

`store_child.py STORE` says on standard output what was acknowledged, one line each, after it was:
`p N` for revision N of the program, `c N` for chunk N of the recording.

Without an argument it forks a child for each line `STORE FIFO` on its standard input, so that its
libraries are loaded once for all of them. Such a child says the same into the FIFO, and first its
process id: `i N`.
"""

import json
import os
import signal
import sys
from pathlib import Path
from queue import SimpleQueue

from openpendant.server.store.documents import Document, DocumentKind, Extent, Heading
from openpendant.server.store.recording_format import pack_rows
from openpendant.server.store.requests import (
    Answer,
    AppendChunk,
    Load,
    MeasureRecording,
    Request,
    Save,
)
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.store.store_client import StoreWriter
from openpendant.server.store.store_errors import NotFound

PROGRAM, RECORDING = "taught", "motion"
COLUMNS = ("t", "j1", "j2", "j3", "j4", "j5", "j6")
ROWS = 100


def program_body(revision: int) -> str:
    points = [{"name": f"p{number}", "joints": [revision + number] * 6} for number in range(50)]
    return json.dumps({"revision": revision, "points": points})


def chunk(sequence: int) -> bytes:
    return pack_rows([sequence + row / ROWS] * len(COLUMNS) for row in range(ROWS))


def main(path: Path) -> None:
    writer = StoreWriter(lambda: open_store(path), lambda call: call())

    def ask(request: Request) -> Answer:
        answers: SimpleQueue[Answer] = SimpleQueue()
        writer.submit(request, answers.put)
        return answers.get()

    loaded = ask(Load(DocumentKind.PROGRAM, PROGRAM))
    revision = loaded.heading.revision if isinstance(loaded, Document) else 0
    extent = ask(MeasureRecording(RECORDING))
    if isinstance(extent, NotFound):
        body = json.dumps({"columns": COLUMNS})
        assert isinstance(ask(Save(DocumentKind.RECORDING, RECORDING, body, 0, "child")), Heading)
        extent = Extent(0, 0)
    assert isinstance(extent, Extent)
    sequence = extent.chunks
    while True:
        body = program_body(revision + 1)
        saved = ask(Save(DocumentKind.PROGRAM, PROGRAM, body, revision, "child"))
        assert isinstance(saved, Heading), saved
        revision = saved.revision
        os.write(1, b"p %d\n" % revision)
        appended = ask(AppendChunk(RECORDING, sequence, chunk(sequence)))
        assert isinstance(appended, Extent), appended
        os.write(1, b"c %d\n" % sequence)
        sequence = appended.chunks


def fork_for_each_line() -> None:
    # Nobody waits for the children: the end of what they say is their end.
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    for line in sys.stdin:
        store, fifo = line.split()
        if os.fork() == 0:
            os.dup2(os.open(fifo, os.O_WRONLY), 1)
            os.write(1, b"i %d\n" % os.getpid())
            main(Path(store))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        fork_for_each_line()
