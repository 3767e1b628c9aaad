"""Generated files: their list, and the check that they match the declarations."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from .catalogue import catalogue_file
from .dissector import lua_dissector
from .firmware_header import HEADER, firmware_header
from .operations_page import operations_page
from .page import error_page, protocol_page
from .python_page import python_page
from .schemas import schema_files
from .typescript import FOLDER, typescript_files
from .vectors import vector_files

GENERATED = "generated"
"""Folder that holds nothing but generated files."""


def generated_files() -> dict[str, str]:
    """Return every generated file: its path below the documentation's folder, and its text."""
    return {
        "protocol.md": protocol_page(),
        "errors.md": error_page(),
        f"{GENERATED}/operations.md": operations_page(),
        f"{GENERATED}/python-client.md": python_page(),
        f"{GENERATED}/openpendant.lua": lua_dissector(),
        f"{GENERATED}/catalogue.json": catalogue_file(),
        **{f"{GENERATED}/vectors/{name}": text for name, text in vector_files().items()},
        **{f"{GENERATED}/schemas/{name}": text for name, text in schema_files().items()},
    }


def write_files(folder: Path) -> None:
    """Write every generated file below a folder, and remove what is generated no longer."""
    files = generated_files()
    for path, text in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8", newline="\n")
    for path in _left_over(folder, files):
        (folder / path).unlink()


def stale_files(folder: Path) -> list[str]:
    """Return one sentence for each file that is missing, differs, or is generated no longer."""
    files = generated_files()
    found = []
    for path, text in files.items():
        target = folder / path
        if not target.is_file():
            found.append(f"{path} is missing")
        elif target.read_bytes() != text.encode():
            found.append(f"{path} is stale")
    return found + [f"{path} is generated no longer" for path in _left_over(folder, files)]


def generated_sources() -> dict[str, str]:
    """Return every generated source: its path below the project's folder, and its text."""
    return {
        **{(FOLDER / name).as_posix(): text for name, text in typescript_files().items()},
        HEADER.as_posix(): firmware_header(),
    }


def write_sources(root: Path) -> None:
    """Write every generated source, of the page and of the keypad's firmware, into its folder."""
    for path, text in generated_sources().items():
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8", newline="\n")


def stale_sources(root: Path) -> list[str]:
    """Return one sentence for each generated source that is missing or differs."""
    found = []
    for path, text in generated_sources().items():
        source = root / path
        if not source.is_file() or source.read_bytes() != text.encode():
            found.append(f"{path} is stale" if source.is_file() else f"{path} is missing")
    return found


def _left_over(folder: Path, files: dict[str, str]) -> Iterator[str]:
    for target in sorted((folder / GENERATED).rglob("*")):
        path = target.relative_to(folder).as_posix()
        if target.is_file() and path not in files:
            yield path
