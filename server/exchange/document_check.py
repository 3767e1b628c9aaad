"""Document check of each kind, for documents that are imported or exported as text.

The one module that knows the kinds of the store together with the modules that own them: each reads
its own kind, this one names file, document and field of a refusal. The store itself takes any JSON.
Opens no file.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from openpendant.motion.description.robot import SerialRobot, robot_names, serial_robot
from openpendant.motion.errors import FrameFileError, MotionError, SceneFileError
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.simplemsg.pendant.management.program_values import BadValue, ProgramError

from ..access.accounts import read_account
from ..positions.position_document import BadPositions, positions_from_json
from ..programs.editing.program_tasks import ReadSource, check_to_be_kept, read_source
from ..programs.language.printer import print_program
from ..programs.language.program import OwnRobot, Program, check_robot
from ..programs.language.program_errors import JsonRefused, ProgramSyntaxError
from ..programs.language.program_json import (
    MOST_READ,
    program_from_json,
    program_to_json,
    source_of,
)
from ..refusal import field_fault
from ..scene.document_reading import scene_from_json, with_frames
from ..store.documents import DocumentKind
from ..store.recording_format import RecordingDocument, column_fault
from ..store.store_errors import BadDocument
from .text_format import ImportedDocument

KeptBody = Callable[[DocumentKind, str], str | None]
"""Returns the body of a document that is kept; None if there is none."""


class _Unfit(Exception):
    """Body that is not one of its kind.

    Attributes:
        field: what is at fault; empty for the whole.
    """

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(f"{field}: {problem}")
        self.field, self.problem = field, problem


def check_entries(
    entries: Sequence[ImportedDocument], file: str, kept: KeptBody
) -> tuple[ImportedDocument, ...]:
    """Return documents as they are to be stored; refuse one that its reader could not use.

    Args:
        kept: the documents that are there already; frames may hang from their tools.

    Raises:
        BadDocument: one of them is none of its kind; the error names document and field.
    """
    new = {(entry.kind, entry.name): entry.body for entry in entries}

    def other(kind: DocumentKind, name: str) -> str | None:
        return new[kind, name] if (kind, name) in new else kept(kind, name)

    checked = []
    for entry in entries:
        try:
            checked.append(_checked(entry, other))
        except _Unfit as error:
            body = f"{entry.where}.body" if entry.where else ""
            place = ".".join(part for part in (body, error.field) if part)
            what = f"{entry.kind} {entry.name!r}: {error.problem}"
            raise BadDocument(file, what, place=place) from None
    return tuple(checked)


def _checked(entry: ImportedDocument, other: KeptBody) -> ImportedDocument:
    match entry.kind:
        case DocumentKind.PROGRAM:
            return _program_to_be_kept(entry)
        case DocumentKind.RECORDING:
            _check_recording(entry)
        case DocumentKind.FRAMES | DocumentKind.TOOLS:
            _check_frames(entry, other)
        case DocumentKind.SCENE:
            try:
                scene_from_json(entry.body)
            except MotionError as error:
                raise _of_motion(error) from None
        case DocumentKind.POSITIONS:
            try:
                positions_from_json(entry.body)
            except BadPositions as error:
                raise _Unfit("", str(error)) from None
        case DocumentKind.ACCOUNT:
            try:
                read_account(entry.name, entry.body)
            except BadDocument as error:
                raise _Unfit(error.place, error.problem) from None
        case DocumentKind.SETTING:
            pass  # settings have no reader yet: any JSON object is one
    return entry


def _program_to_be_kept(entry: ImportedDocument) -> ImportedDocument:
    """Check a program by the rule for pendants that save; return it as a server keeps it."""
    try:
        read = read_source(ReadSource(entry.body, "json", "program"))
        _, own = robot_of_program(read.head)
        check_to_be_kept(read, own, entry.name)
    except JsonRefused as error:
        problem = str(error).removeprefix(f"{error.file}: ").removeprefix(f"{error.field}: ")
        raise _Unfit(error.field, problem) from None
    except BadValue as error:
        raise _Unfit(error.part, error.problem) from None
    except ProgramError as error:
        raise _Unfit("", str(error)) from None
    return replace(entry, body=read.body)


def robot_of_program(body: str) -> tuple[str, OwnRobot | None]:
    """Return the robot that a program names; None beside it for one that only its own cell knows.

    Args:
        body: JSON of the program, or of its head.
    """
    name = program_from_json(body).robot
    try:
        found = serial_robot(name) if name in robot_names() else None
    except MotionError:  # one with another mechanism, such as a platform on six legs
        return name, None
    return name, None if found is None else OwnRobot(found.name, found.limits)


def _check_recording(entry: ImportedDocument) -> None:
    try:
        document = RecordingDocument.model_validate_json(entry.body)
    except ValidationError as error:
        field, _, problem = field_fault(error).partition(": ")
        raise _Unfit(field, problem) from None
    fault = column_fault(document.columns)
    if fault is not None:
        where = "" if fault.place is None else f"[{fault.place}]"
        raise _Unfit(f"columns{where}", fault.problem)


def _check_frames(entry: ImportedDocument, other: KeptBody) -> None:
    """Read a document of frames or tools as the server does: the tools first."""
    tree = FrameTree()
    tools, frames = (
        entry.body if kind is entry.kind else other(kind, entry.name)
        for kind in (DocumentKind.TOOLS, DocumentKind.FRAMES)
    )
    try:
        if tools is not None:
            tree = with_frames(DocumentKind.TOOLS, tools, tree)
    except MotionError as error:
        if entry.kind is DocumentKind.TOOLS:
            raise _of_motion(error) from None
        # Stored tools that cannot be read are no fault of these frames.
    try:
        if frames is not None:
            with_frames(DocumentKind.FRAMES, frames, tree)
    except MotionError as error:
        if entry.kind is DocumentKind.FRAMES:
            raise _of_motion(error) from None
        unfit = _of_motion(error)
        problem = f"does not go with the document frames {entry.name!r}: {unfit}"
        raise _Unfit("", problem) from None


def _of_motion(error: MotionError) -> _Unfit:
    if isinstance(error, FrameFileError | SceneFileError):
        return _Unfit(error.field, error.problem)
    return _Unfit("", str(error))


def program_entry(text: str, file: str, name: str | None = None) -> ImportedDocument:
    """Return the document for a program's own text or JSON.

    Args:
        name: what the program is to be called; as it says itself if None.

    Raises:
        BadDocument: it is no program; the error says where.
    """
    try:
        program = source_of(text.encode()[:MOST_READ], file).program
        if name is not None:
            program = replace(program, name=name)
    except ProgramSyntaxError as error:
        accepted = f"; accepted: {error.accepted}" if error.accepted else ""
        place = f"column {error.column}"
        raise BadDocument(
            file, f"{error.problem}{accepted}", line=error.line, place=place
        ) from None
    except ProgramError as error:
        raise BadDocument(file, str(error).removeprefix(f"{file}: ")) from None
    return ImportedDocument(DocumentKind.PROGRAM, program.name, program_to_json(program))


def program_text(name: str, body: str) -> str:
    """Return the text of a kept program.

    Raises:
        BadDocument: the document is none that can be printed.
    """
    try:
        return print_program(program_from_json(body, name))
    except ProgramError as error:
        raise BadDocument(f"program {name!r}", str(error)) from None


def program_of_points(
    name: str,
    points: Sequence[Mapping[str, Any]],
    kept: str | None,
    robot: str | None,
    *,
    replacing: bool,
) -> ImportedDocument:
    """Return the document of a program with other points, or of a new one with nothing else.

    Args:
        kept: the body of the program that has this name; None for a new one.
        robot: of a new program, name or file; of a kept one left out.
        replacing: put the points in the place of those that are kept.

    Raises:
        BadDocument: there is no robot for a new program, the name is taken and nothing is to be
            replaced, or the points are none of it.
    """
    what = f"program {name!r}"
    if kept is not None and not replacing:
        problem = "is there already; accepted: --replace, to give it these points, or another name"
        raise BadDocument(what, problem)
    if kept is not None:
        if robot is not None:
            raise BadDocument(what, "names its robot itself; accepted: without --robot")
        body = json.loads(kept) | {"points": points}
        return ImportedDocument(DocumentKind.PROGRAM, name, json.dumps(body, ensure_ascii=False))
    if robot is None:
        problem = "is new, and points do not name their robot; say --robot, such as --robot ur5"
        raise BadDocument(what, problem)
    try:
        found = serial_robot(robot)
        axes = tuple(i for i, prismatic in enumerate(found.limits.prismatic) if prismatic)
        body = json.loads(program_to_json(Program(name, found.name, axes))) | {"points": points}
        entry = ImportedDocument(DocumentKind.PROGRAM, name, json.dumps(body, ensure_ascii=False))
        check_robot(program_from_json(entry.body, what), found.name, found.limits)
    except (MotionError, ProgramError) as error:
        raise BadDocument(what, str(error).removeprefix(f"{what}: ")) from None
    return entry


def robot_of_samples(name: str, robot: str | None) -> SerialRobot:
    """Return the robot that a table of samples is said to be of.

    Args:
        robot: name or file of the robot; None where nobody said.

    Raises:
        BadDocument: nobody said, or there is no such robot.
    """
    what = f"recording {name!r}"
    if robot is None:
        problem = "samples do not name their robot; say --robot, such as --robot ur5"
        raise BadDocument(what, problem)
    try:
        return serial_robot(robot)
    except MotionError as error:
        raise BadDocument(what, str(error)) from None


def check_samples(name: str, robot: SerialRobot, file: str, columns: Sequence[str]) -> None:
    """Refuse a table that its robot could not play.

    Raises:
        BadDocument: its columns are not those of the robot's joints.
    """
    fault = column_fault(columns, robot.limits.dof)
    if fault is not None:
        place = "" if fault.place is None else f"column {fault.place + 1}"
        what = f"recording {name!r} of {robot.name!r}"
        raise BadDocument(file, f"{what}: {fault.problem}", line=1, place=place)
