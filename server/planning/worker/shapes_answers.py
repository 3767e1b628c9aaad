"""Shapes answers: what a robot looks like, and the bytes of its meshes.

Runs in the process for questions and nowhere else: it reads files. Owns which robots may be asked
about, the ones of the catalogue and the cell's own, and that of a mesh only the file is read that
the robot file names. The bytes are those of the import, never parsed here; whoever asked compares
the hash.
"""

from __future__ import annotations

import base64
import json
from functools import cache
from typing import Any

from openpendant.motion.bounded_file import open_regular
from openpendant.motion.description.robot import (
    ParallelRobot,
    Robot,
    load_robot,
    mesh_folder,
    robot_names,
)
from openpendant.motion.errors import BadArgument, MotionError, UnknownRobot, shortened
from openpendant.motion.robot_report.shapes_report import meshes_report, shapes_report
from openpendant.simplemsg.pendant.management.shapes import (
    MOST_OF_CHUNK,
    ListMeshes,
    ReadMesh,
    ShapeQuestion,
    ShowShapes,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal, refusal_of
from ..jobs import ShapesFound


def answer_shapes(robot: str, asked: ShapeQuestion) -> ShapesFound | Refusal:
    """Answer a question of a cell with this robot, or say why there is no answer."""
    try:
        told = _told(robot, asked)
    except MotionError as error:
        return refusal_of(error)
    if isinstance(told, Refusal):
        return told
    return ShapesFound(json.dumps(told, ensure_ascii=False, separators=(",", ":")))


def _told(robot: str, asked: ShapeQuestion) -> dict[str, Any] | Refusal:
    match asked:
        case ShowShapes(robot=str(name)):
            # Not `load_robot` alone: that would take a path, too.
            if name not in robot_names():
                raise UnknownRobot(name, robot_names())
            return shapes_report(load_robot(name))
        case ListMeshes():
            return {"meshes": meshes_report(_own(robot))}
        case ReadMesh():
            return _chunk(robot, asked)
    raise TypeError(asked)


@cache
def _own(robot: str) -> Robot:
    """Return the robot of a cell; its file is read once, as by the server."""
    return load_robot(robot)


def _chunk(robot: str, asked: ReadMesh) -> dict[str, Any] | Refusal:
    own = _own(robot)
    meshes = () if isinstance(own, ParallelRobot) else own.meshes
    mesh = next((each for each in meshes if each.hash == asked.hash), None)
    if mesh is None:
        text = f"no mesh of {own.name} has the hash {shortened(asked.hash)}"
        return Refusal(VerdictCode.UNKNOWN_MESH, text)
    if asked.offset > mesh.bytes:
        raise BadArgument("offset", asked.offset, f"0 to {mesh.bytes}, the bytes of this mesh")
    try:
        with open_regular(mesh_folder(robot) / mesh.file_name) as file:
            file.seek(asked.offset)
            data = file.read(min(MOST_OF_CHUNK, mesh.bytes - asked.offset))
    except OSError as error:
        text = f"the file of mesh {mesh.hash} cannot be read: {error.strerror}"
        return Refusal(VerdictCode.UNKNOWN_MESH, text)
    ends = asked.offset + len(data)
    if ends < mesh.bytes and not data:
        text = f"the file of mesh {mesh.hash} has {ends} bytes, not {mesh.bytes}"
        return Refusal(VerdictCode.UNKNOWN_MESH, text)
    return {
        "bytes_total": mesh.bytes,
        "offset": asked.offset,
        "data": base64.b64encode(data).decode(),
        "more": ends < mesh.bytes,
    }
