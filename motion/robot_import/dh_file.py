"""Denavit–Hartenberg table in a CSV, JSON or YAML file, read as a chain of joints.

Owns the file's form, its declared units, and both conventions:

    standard: tool = base · ∏ Rz(theta) Tz(d) Tx(a) Rx(alpha) · tool
    modified: tool = base · ∏ Rx(alpha) Tx(a) Rz(theta) Tz(d) · tool

Standard is that of Denavit and Hartenberg (1955), modified that of J. J. Craig, "Introduction to
Robotics", ch. 3, whose row i holds alpha and a of index i - 1. Both name theta and d of the row the
joint that moves; the value in the file is what is added to the joint's position.

The CSV form is read as the mapping that the YAML form holds: declarations stand in comments
(`# convention: standard`), then one line names the columns, then there is a line per joint. What is
no sound table raises `RobotFileError`, which names the row and what is accepted.
"""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from ..bounded_file import read_text
from ..description.robot import validated
from ..description.rules import MAX_FIXED_ANGLE, MAX_LENGTH
from ..description.schema import (
    DhRow,
    DhTable,
    Facts,
    JointType,
    Name,
    Placement,
    Rate,
    Real,
    Variable,
    Vector,
)
from ..description.yaml_file import MAX_FILE_BYTES, read_mapping
from ..errors import RobotFileError
from ..pose import Array
from .imported_chain import ImportedChain, ImportedJoint, to_matrix, to_placement
from .urdf_shapes import placement_of

MAX_ROWS = 64
"""Most joints of a table; no robot has as many."""

_NUMBER_COLUMNS = frozenset(
    {"theta", "d", "a", "alpha", "lower", "upper", "velocity", "acceleration"}
)


def read_dh_csv(path: Path) -> dict[str, Any]:
    """Return the content of a table's YAML form: declarations, and `joints` as a list of rows."""
    file = str(path)
    text = read_text(path, MAX_FILE_BYTES, RobotFileError, "utf-8-sig")
    lines = text.splitlines()
    content: dict[str, Any] = {}
    for line in lines:
        key, colon, value = line.strip().removeprefix("#").partition(":")
        if line.strip().startswith("#") and colon:
            _declare(content, key.strip(), value.strip(), file)
    rows = [line for line in lines if line.strip() and not line.strip().startswith("#")]
    if len(rows) > MAX_ROWS + 1:
        problem = f"has {len(rows) - 1} rows; accepted: at most {MAX_ROWS}"
        raise RobotFileError(file, "joints", problem)
    try:
        reader = csv.DictReader(rows, strict=True, skipinitialspace=True)
        columns = [name.strip() for name in reader.fieldnames or ()]
        _refuse_repeated(columns, file)
        content["joints"] = [
            _csv_row(row, number, columns, file) for number, row in enumerate(reader, start=1)
        ]
    except csv.Error as error:
        raise RobotFileError(file, "", f"is not valid CSV: {error}") from error
    return content


def _declare(content: dict[str, Any], key: str, value: str, file: str) -> None:
    # Two declarations that differ are refused: they make different robots.
    said = content.setdefault(key, value)
    if said != value:
        problem = f"is declared twice, as {said[:40]!r} and {value[:40]!r}; accepted: one of them"
        raise RobotFileError(file, key[:40], problem)


def _refuse_repeated(columns: Sequence[str], file: str) -> None:
    for name, count in Counter(columns).items():
        if count > 1:
            problem = f"are {count} of the name {name[:40]!r}; accepted: each name once"
            raise RobotFileError(file, "columns", problem)


def _csv_row(
    row: Mapping[str | None, Any], number: int, columns: Sequence[str], file: str
) -> dict[str, Any]:
    where = f"row {number}"
    cells = sum(cell is not None for name, cell in row.items() if name is not None)
    cells += len(row.get(None, ()))
    if cells != len(columns):
        accepted = f"{len(columns)}, one per column ({', '.join(columns)[:80]})"
        raise RobotFileError(file, where, f"has {cells} cells; accepted: {accepted}")
    found: dict[str, Any] = {}
    for column, cell in row.items():
        name, text = str(column).strip(), str(cell).strip()
        if not text:
            continue
        try:
            found[name] = float(text) if name in _NUMBER_COLUMNS else text
        except ValueError:
            problem = f"is {text[:40]!r}; accepted: a number"
            raise RobotFileError(file, f"{where}.{name[:40]}", problem) from None
    return found


ENDINGS = (".csv", ".json", ".yaml", ".yml")

_ROOT, _TOOL = "base_link", "tool0"


class Convention(StrEnum):
    """Order of a row's a and alpha and the joint's motion."""

    STANDARD = "standard"
    MODIFIED = "modified"


class AngleUnit(StrEnum):
    """The unit of every angle of the file."""

    DEGREES = "degrees"
    RADIANS = "radians"


class LengthUnit(StrEnum):
    """The unit of every length of the file."""

    MILLIMETRES = "mm"
    METRES = "m"


class _End(Facts):
    """Constant placement at an end of the chain, in the file's units."""

    xyz: Vector = (0.0, 0.0, 0.0)
    rpy: Vector | None = None
    quat: tuple[Real, Real, Real, Real] | None = None


class _Row(Facts):
    """Row of the table: theta and d are offsets where they are variable; limits are the joint's."""

    joint: Name
    theta: Real = 0.0
    d: Real = 0.0
    a: Real = 0.0
    alpha: Real = 0.0
    variable: Variable = Variable.THETA
    lower: Real | None = None
    upper: Real | None = None
    velocity: Rate | None = None
    acceleration: Rate | None = None
    display_name: Name | None = None


class _DhFile(Facts):
    """Whole file."""

    name: str = ""
    convention: Convention
    angles: AngleUnit
    lengths: LengthUnit
    base: _End = Field(default_factory=_End)
    tool: _End = Field(default_factory=_End)
    joints: Annotated[tuple[_Row, ...], Field(min_length=1, max_length=MAX_ROWS)]
    home: tuple[Real, ...] | None = None


def read_dh_file(path: Path) -> ImportedChain:
    """Read a Denavit–Hartenberg table; the file's ending sets its form."""
    file = str(path)
    content = read_dh_csv(path) if path.suffix.lower() == ".csv" else read_mapping(path)
    table = validated(_DhFile, content, file)
    angle = math.pi / 180.0 if table.angles is AngleUnit.DEGREES else 1.0
    length = 0.001 if table.lengths is LengthUnit.MILLIMETRES else 1.0
    base, tool = (
        _placement(end, angle, length, file, field)
        for end, field in ((table.base, "base"), (table.tool, "tool"))
    )
    _check_limits(table, file)
    rows = [_in_si(row, angle, length) for row in table.joints]
    _check_units(rows, file)
    standard = table.convention is Convention.STANDARD
    joints = _standard(rows, base, tool) if standard else _modified(rows, base, tool)
    told = [row.display_name for row in rows if row.display_name is not None]
    return ImportedChain(
        file=file,
        source=f"{table.convention} Denavit–Hartenberg table",
        name=table.name,
        joints=joints,
        home=None if table.home is None else tuple(_home(table.home, rows, angle, length)),
        dh=_table(rows, base, tool) if standard else None,
        display_names=tuple(told) if len(told) == len(rows) else None,
    )


def _placement(end: _End, angle: float, length: float, file: str, where: str) -> Placement:
    x, y, z = (length * value for value in end.xyz)
    if end.quat is None:
        roll, pitch, yaw = (angle * value for value in end.rpy or (0.0, 0.0, 0.0))
        return Placement(xyz=(x, y, z), rpy=(roll, pitch, yaw))
    if end.rpy is not None:
        raise RobotFileError(file, where, "has both rpy and quat; accepted: one of them")
    return placement_of((x, y, z), end.quat, file, f"{where}.quat")


def _in_si(row: _Row, angle: float, length: float) -> _Row:
    own = length if row.variable is Variable.D else angle
    scaled = {"theta": angle, "alpha": angle, "d": length, "a": length}
    scaled |= dict.fromkeys(("lower", "upper", "velocity", "acceleration"), own)
    values = {field: getattr(row, field) for field in scaled}
    return row.model_copy(
        update={
            field: None if value is None else value * scaled[field]
            for field, value in values.items()
        }
    )


def _check_limits(table: _DhFile, file: str) -> None:
    # Before the units are converted, so that people read the numbers that they wrote.
    for index, row in enumerate(table.joints):
        unit = table.lengths if row.variable is Variable.D else table.angles
        where = f"joints[{index}] ({row.joint})"
        match row.lower, row.upper:
            case (None, None):
                continue
            case (None, upper):
                missing, problem = "lower", f"is missing beside upper = {upper:g} {unit}"
            case (lower, None):
                missing, problem = "upper", f"is missing beside lower = {lower:g} {unit}"
            case (lower, upper) if lower < upper:
                continue
            case (lower, upper):
                accepted = f"less than upper = {upper:g} {unit}"
                problem = f"is {lower:g} {unit}; accepted: {accepted}"
                raise RobotFileError(file, f"{where}.lower", problem)
        raise RobotFileError(file, f"{where}.{missing}", f"{problem}; accepted: both, or neither")


def _check_units(rows: list[_Row], file: str) -> None:
    for index, row in enumerate(rows):
        for field, most, doubt in (
            ("theta", MAX_FIXED_ANGLE, "are the angles declared right?"),
            ("alpha", MAX_FIXED_ANGLE, "are the angles declared right?"),
            ("d", MAX_LENGTH, "are the lengths declared right?"),
            ("a", MAX_LENGTH, "are the lengths declared right?"),
        ):
            value = getattr(row, field)
            if abs(value) > most:
                unit = "rad" if most == MAX_FIXED_ANGLE else "m"
                raise RobotFileError(
                    file,
                    f"joints[{index}] ({row.joint}).{field}",
                    f"is {value:g} {unit}; accepted: at most {most:.4g} {unit} ({doubt})",
                )


def _home(
    home: tuple[float, ...], rows: list[_Row], angle: float, length: float
) -> Iterator[float]:
    scales = [length if row.variable is Variable.D else angle for row in rows]
    scales += [1.0] * (len(home) - len(rows))
    return (value * scale for value, scale in zip(home, scales, strict=False))


def _standard(rows: list[_Row], base: Placement, tool: Placement) -> tuple[ImportedJoint, ...]:
    # Rz and Tz of the same axis commute, so the whole constant row may follow the joint's motion.
    before = to_matrix(base)
    joints = []
    for index, row in enumerate(rows):
        joints.append(_joint(row, index, before))
        before = _about_z(row) @ _along_x(row)
    return (*joints, _last(rows, before @ to_matrix(tool)))


def _modified(rows: list[_Row], base: Placement, tool: Placement) -> tuple[ImportedJoint, ...]:
    # For the same reason the whole constant row may go before the motion here.
    before = to_matrix(base)
    joints = []
    for index, row in enumerate(rows):
        joints.append(_joint(row, index, before @ _along_x(row) @ _about_z(row)))
        before = np.eye(4)
    return (*joints, _last(rows, to_matrix(tool)))


def _joint(row: _Row, index: int, origin: Array) -> ImportedJoint:
    return ImportedJoint(
        name=row.joint,
        type=JointType.PRISMATIC if row.variable is Variable.D else JointType.REVOLUTE,
        parent=f"link_{index}" if index else _ROOT,
        child=f"link_{index + 1}",
        origin=to_placement(origin),
        axis=(0.0, 0.0, 1.0),
        lower=row.lower,
        upper=row.upper,
        velocity=row.velocity,
        acceleration=row.acceleration,
    )


def _last(rows: list[_Row], origin: Array) -> ImportedJoint:
    link = f"link_{len(rows)}"
    return ImportedJoint(f"{link}-{_TOOL}", JointType.FIXED, link, _TOOL, to_placement(origin))


def _table(rows: list[_Row], base: Placement, tool: Placement) -> DhTable:
    return DhTable(
        convention="standard",
        base=base,
        rows=tuple(
            DhRow(
                joint=row.joint,
                theta_offset=row.theta,
                d=row.d,
                a=row.a,
                alpha=row.alpha,
                variable=row.variable,
            )
            for row in rows
        ),
        tool=tool,
    )


def _about_z(row: _Row) -> Array:
    """Return Rz(theta) Tz(d), (4, 4)."""
    cosine, sine = math.cos(row.theta), math.sin(row.theta)
    matrix = np.eye(4)
    matrix[:2, :2] = ((cosine, -sine), (sine, cosine))
    matrix[2, 3] = row.d
    return matrix


def _along_x(row: _Row) -> Array:
    """Return Tx(a) Rx(alpha), (4, 4)."""
    cosine, sine = math.cos(row.alpha), math.sin(row.alpha)
    matrix = np.eye(4)
    matrix[1:3, 1:3] = ((cosine, -sine), (sine, cosine))
    matrix[0, 3] = row.a
    return matrix
