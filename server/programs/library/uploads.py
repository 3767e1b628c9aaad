"""Uploads of programs that are too long for one frame, part by part.

Owns the order of the parts and the bound on waiting text; one program for each connection.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from openpendant.simplemsg.pendant.management.programs import SaveProgram

from ..language.lexer import MOST_BYTES
from ..language.program_errors import BadValue, ProgramTooLarge
from ..language.program_json import MOST_JSON_BYTES


@dataclass(slots=True)
class _Upload:
    """Upload in progress, with the parts received so far."""

    name: str
    parts: int
    bodies: list[str] = field(default_factory=list)
    characters: int = 0


class Uploads:
    """Uploads of all connections."""

    def __init__(self) -> None:
        self._under_way: dict[int, _Upload] = {}

    def forget(self, session: int) -> None:
        """Drop the parts that a connection has sent."""
        self._under_way.pop(session, None)

    def add(self, session: int, asked: SaveProgram) -> str | None:
        """Add a part; return the whole text after the last.

        Raises:
            BadValue: another part is due.
            ProgramTooLarge: the whole would be too long.
        """
        upload = self._under_way.pop(session, None)
        if asked.part == 1:
            upload = _Upload(asked.name, asked.parts)
        due = 1 if upload is None else len(upload.bodies) + 1
        fits = upload is not None and (upload.name, upload.parts) == (asked.name, asked.parts)
        if upload is None or not fits or asked.part != due or asked.part > asked.parts:
            text = f"is {asked.part} of {asked.parts} of {asked.name!r}; accepted: from 1 on, each"
            raise BadValue("the part", f"{text} in its turn")
        upload.bodies.append(asked.body)
        upload.characters += len(asked.body)
        most = MOST_BYTES if asked.format == "text" else MOST_JSON_BYTES
        if upload.characters > most:
            raise ProgramTooLarge("characters of a program", upload.characters, most)
        if asked.part == asked.parts:
            return "".join(upload.bodies)
        self._under_way[session] = upload
        return None
