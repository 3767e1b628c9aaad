"""Imports of frames, tools and scenes whose content was read where there is time for it.

Owns what a planning process makes of a large body of such a request: the event loop gets entries
that are checked and ready, in pieces, and unpickles and joins them in steps. What is wrong with the
content goes with them, and is told when the request acts, as if it had been found then.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_file import FramesFile, read_frames
from openpendant.motion.scene.scene_transfer import SceneInTransfer
from openpendant.motion.steps import Stepwise, at_once
from openpendant.simplemsg.pendant import PROTOCOL_VERSION
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.pendant.management.frames import ImportFrames, ImportTools
from openpendant.simplemsg.pendant.management.scene import ImportScene

from ..events.management_requests import parse
from ..refusal import Refusal, refusal_of
from ..store.documents import DocumentKind
from .document_reading import scene_from_json


@dataclass(frozen=True, slots=True, eq=False)
class FramesImport(ImportFrames):
    """An import of frames; its content is empty, as it is in what was read."""

    read: FramesFile


@dataclass(frozen=True, slots=True, eq=False)
class ToolsImport(ImportTools):
    """An import of tools, likewise."""

    read: FramesFile


@dataclass(frozen=True, slots=True, eq=False)
class SceneImport(ImportScene):
    """An import of a scene, likewise.

    Attributes:
        read: the scene, or what is wrong with the content.
        is_any_held: whether a link holds an object of it.
    """

    read: SceneInTransfer | Refusal
    is_any_held: bool


def read_apart(body: bytes, version: int = PROTOCOL_VERSION) -> tuple[str, Request[Any] | Refusal]:
    """Read a body as `parse` does, and what it imports, too; takes a while."""
    operation, asked = parse(body, version)
    match asked:
        case ImportFrames(content=content, expected_revision=revision):
            return operation, FramesImport({}, revision, at_once(reading(_FRAMES, content)))
        case ImportTools(content=content, expected_revision=revision):
            return operation, ToolsImport({}, revision, at_once(reading(_TOOLS, content)))
        case ImportScene(content=content, expected_revision=revision):
            return operation, SceneImport({}, revision, _scene_in(content), is_any_held(content))
    return operation, asked


_FRAMES, _TOOLS = DocumentKind.FRAMES, DocumentKind.TOOLS

_PER_CHARACTER = 0.1  # µs on an ordinary machine: to parse a body, and to write it anew


def reading(kind: DocumentKind, content: Mapping[str, Any]) -> Stepwise[FramesFile]:
    """Read the content of an import of frames or tools, in steps."""
    text = json.dumps(content)
    # That its body was parsed belongs to the same turn.
    yield _PER_CHARACTER * len(text)
    return (yield from read_frames(text, kind.value))


def is_any_held(content: Mapping[str, Any]) -> bool:
    """Return True if a link holds an object of a scene's content, which may be unsound."""
    objects = content.get("objects")
    entries = objects if isinstance(objects, list) else []
    return any(isinstance(each, dict) and each.get("link") is not None for each in entries)


def _scene_in(content: Mapping[str, Any]) -> SceneInTransfer | Refusal:
    try:
        return SceneInTransfer.of(scene_from_json(json.dumps(content)))
    except MotionError as error:
        return refusal_of(error)
