"""What is frozen says nothing of the machine that wrote it, nor of the modules of that time."""

import gzip
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from frozen.frozen_files import FROZEN

DATA = sorted(
    file
    for file in FROZEN.rglob("*")
    if file.is_file() and file.suffix != ".py" and "__pycache__" not in file.parts
)

OF_MODULES = re.compile(
    # No `tools`: operations begin so.
    rb"\b(?:openpendant|server|motion|simplemsg|controller_emulator|tests)"
    rb"(?:\.[a-z_]+)+\b|\w\.py\b|Traceback|\bat 0x[0-9a-f]"
)
OF_MACHINES = re.compile(rb"/(?:tmp|home|root|work|Users|var|usr|opt|private)\b|[A-Z]:\\")
ADDRESSES = re.compile(rb"\b\d+\.\d+\.\d+\.\d+\b")
NOBODYS = re.compile(rb"127\.0\.0\.1|192\.0\.2\.\d+")
MAIL = re.compile(rb"[A-Za-z][\w.+-]*@[\w-]+\.[A-Za-z]{2,}")

_HEX = re.compile(rb'(?<="hex": ")[0-9a-f]*')
_BASE64 = re.compile(rb'"[A-Za-z0-9+/]{200,}=*"')

MOST_BYTES = 1_500_000


def contents(file: Path) -> Iterator[bytes]:
    """Yield what is in a file: its text without what is encoded in it, and each of that."""
    data = file.read_bytes()
    if file.suffix == ".gz":
        data = gzip.decompress(data)
    yield from (bytes.fromhex(match.decode()) for match in _HEX.findall(data))
    yield _BASE64.sub(b"", _HEX.sub(b"", data))


def traces(data: bytes) -> list[bytes]:
    found = [match.group() for rule in (OF_MODULES, OF_MACHINES) for match in rule.finditer(data)]
    return found + [each for each in ADDRESSES.findall(data) if not NOBODYS.fullmatch(each)]


def test_nothing_tells_of_modules_and_machines() -> None:
    found = {}
    for file in DATA:
        *encoded, text = contents(file)
        told = {trace for data in (*encoded, text) for trace in traces(data)}
        found[file.name] = told | set(MAIL.findall(text))
    assert {name: told for name, told in found.items() if told} == {}
    assert len(found) > 30


@pytest.mark.parametrize(
    "told",
    [
        b"openpendant.server.core",
        b"server.programs.statements.Move",
        b"core.py",
        b"<object at 0x7f2a>",
        b"/tmp/pytest-of-somebody",
        b"192.168.1.7",
    ],
)
def test_what_tells_of_them_would_be_found(told: bytes, tmp_path: Path) -> None:
    file = tmp_path / "some.journal"
    for line in (b'{"note": "%s"}' % told, b'{"out": "1", "hex": "%s"}' % told.hex().encode()):
        file.write_bytes(line)
        assert [trace for data in contents(file) for trace in traces(data)]


def test_all_of_it_is_small() -> None:
    assert sum(file.stat().st_size for file in DATA) < MOST_BYTES
