"""The JSON form of a program, `openpendant-program/1`, and its distinction from the text form.

The JSON is the body of a program's document and of messages about it. Owns that form: numbers are
SI and keep every bit; a field that is missing, unknown or of the wrong type is named in the error.
Owns the rule that a program file is text or JSON by how it begins, and what is said of a file that
is too large, of which only the beginning is read. Opens no file and knows no store.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from openpendant.simplemsg.pendant.management.program_values import ProgramError, TeachPoint
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import AnyStatement, Statement

from ...store.store_errors import BadDocument
from ...store.strict_json import parse as parse_strictly
from .lexer import MOST_BYTES
from .parser import FORMAT, Source, parse_bytes
from .program import MOST_POINTS, Program
from .program_errors import BadBlocks, JsonRefused, PointUnknown, ProgramTooLarge

MOST_JSON_BYTES = 2 << 20
"""Largest JSON of a program [bytes of UTF-8]; it is longer than its text."""


class ProgramDocument(BaseModel):
    """The fields of a program's JSON, as `Program` describes them."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    format: Literal["openpendant-program/1"]
    name: str
    robot: str
    linear_axes: tuple[int, ...] = ()
    tool: str = Program.tool
    frame: str = Program.frame
    comment: str = ""
    points: tuple[TeachPoint, ...] = Field(default=(), max_length=MOST_POINTS)
    statements: tuple[AnyStatement, ...] = Field(default=(), max_length=MOST_STATEMENTS)


POINT: TypeAdapter[TeachPoint] = TypeAdapter(TeachPoint)
"""Reads and writes the JSON of one point."""

POINTS: TypeAdapter[tuple[TeachPoint, ...]] = TypeAdapter(tuple[TeachPoint, ...])
"""Reads and writes a JSON list of points."""

STATEMENTS: TypeAdapter[tuple[Statement, ...]] = TypeAdapter(tuple[AnyStatement, ...])
"""Reads and writes a JSON list of statements."""


def program_to_json(program: Program) -> str:
    """Return a program as JSON on one line."""
    return ProgramDocument(
        format=FORMAT,
        name=program.name,
        robot=program.robot,
        linear_axes=program.linear_axes,
        tool=program.tool,
        frame=program.frame,
        comment=program.comment,
        points=program.points,
        statements=program.statements,
    ).model_dump_json()


def program_from_json(body: str | bytes, file: str = "program") -> Program:
    """Return the program that a JSON text says.

    Raises:
        ProgramTooLarge: it exceeds `MOST_JSON_BYTES`.
        ProgramError: a field is missing, unknown or wrong; or the parts do not fit each other.
    """
    raw = body if isinstance(body, bytes) else body.encode("utf-8", "surrogatepass")
    if len(raw) > MOST_JSON_BYTES:
        raise ProgramTooLarge(f"bytes in {file}", len(raw), MOST_JSON_BYTES)
    try:
        document = ProgramDocument.model_validate_json(raw)
    except ValidationError as error:
        raise _error(error, file) from None
    fields = {name: getattr(document, name) for name in Program.__dataclass_fields__}
    try:
        return Program(**fields)
    except (BadBlocks, PointUnknown) as error:
        raise JsonRefused(file, f"statements[{error.index}]", str(error), error.code) from None


def program_from_source(source: str | bytes, file: str = "program") -> Program:
    """Return the program of JSON of unknown origin; otherwise as `program_from_json`.

    A byte order mark in front is passed over, as in front of text. A key that stands twice in one
    object is refused: which of both is meant nobody can know.
    """
    # Bytes that are no UTF-8 are refused by their place with the JSON that they are in.
    raw = source if isinstance(source, bytes) else source.encode("utf-8", "surrogatepass")
    body = raw.removeprefix(BOM_UTF8)
    program = program_from_json(body, file)
    try:
        parse_strictly(body.decode(), file)
    except BadDocument as error:
        raise JsonRefused(file, error.place, error.problem) from None
    return program


def _error(error: ValidationError, file: str) -> ProgramError:
    """Return the first problem with the field that it is in, and the code of the rule it breaks."""
    first = error.errors(include_url=False, include_input=False)[0]
    cause = (first.get("ctx") or {}).get("error")
    path = ""
    for part in first["loc"]:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    if isinstance(cause, ProgramError):
        return JsonRefused(file, path, str(cause), cause.code)
    return JsonRefused(file, path, first["msg"])


MOST_READ = MOST_JSON_BYTES + 1
"""Bytes to read of a file: one more than is taken, so that a larger file is known to be one."""


def is_json(raw: bytes) -> bool:
    """Return True if a file is JSON: its first character is `{`; text begins with its format."""
    return raw[:4096].removeprefix(BOM_UTF8).lstrip()[:1] == b"{"


def source_of(raw: bytes, file: str) -> Source:
    """Return the program in a file, with the lines of its parts; 0 for each where it is JSON.

    Args:
        raw: the file's first `MOST_READ` bytes.

    Raises:
        ProgramError: it is no program; the error says where.
    """
    if len(raw) >= MOST_READ:
        limit = MOST_JSON_BYTES if is_json(raw) else MOST_BYTES
        raise ProgramTooLarge(f"bytes in {file}", len(raw), limit, is_counted=False)
    if not is_json(raw):
        return parse_bytes(raw, file)
    program = program_from_source(raw, file)
    return Source(program, (0,) * len(program.points), (0,) * len(program.statements))
