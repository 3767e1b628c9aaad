"""Reading of the documents of a planning scene: user frames, tools, and the objects of a scene.

Owns what a document of each kind may change. `motion` owns what the values mean. Meshes are files
of the server, so a document from outside must not name one. A large one is read in steps.
"""

from __future__ import annotations

import json
from typing import Any

from openpendant.motion.errors import SceneFileError
from openpendant.motion.frames.frame_file import FramesFile, read_frames
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.scene.scene import Mesh, Scene
from openpendant.motion.scene.scene_file import read_scene
from openpendant.motion.steps import Stepwise, at_once

from ..store.documents import DocumentKind

# About how long it takes on an ordinary machine [µs].
_PER_FRAME = 0.8  # to leave frames out of a tree
_PER_CHARACTER = 0.01  # to parse JSON


def with_frames(kind: DocumentKind, body: str, tree: FrameTree) -> FrameTree:
    """Return a tree whose user frames, or tools, are those of a document.

    Args:
        kind: frames or tools; those that the tree has of the kind are replaced.

    Raises:
        MotionError: the document is none, or frames that stay hang from what goes.
    """
    return at_once(placed(kind, at_once(read_frames(body, kind.value)), tree))


def placed(kind: DocumentKind, read: FramesFile, tree: FrameTree) -> Stepwise[FrameTree]:
    """Return what `with_frames` does of a document that was read, in steps."""
    yield _PER_FRAME * len(tree.frames)
    selected = tree.selected_tool
    if kind is DocumentKind.TOOLS:
        bare = tree.select_tool(None).without({tool.name: None for tool in tree.tools})
        return (yield from read.added_to(bare))
    bare = tree.without({frame.name: None for frame in tree.user_frames})
    grown = yield from read.added_to(bare)
    # A document of frames selects no tool, which is not to say that none is selected.
    return grown if grown.selected_tool == selected else grown.select_tool(selected)


def scene_from_json(body: str) -> Scene:
    """Return the scene of a document or of a file's text.

    Raises:
        MotionError: it is none, or has a mesh.
    """
    return at_once(scene_of(body))


def scene_of(body: str) -> Stepwise[Scene]:
    """Return what `scene_from_json` does, in steps."""
    yield _PER_CHARACTER * len(body)
    scene = yield from read_scene(_object_in(body), "scene")
    for each in scene.objects:
        if isinstance(each.shape, Mesh):
            problem = "is a mesh; accepted: box, sphere, cylinder, capsule"
            raise SceneFileError("scene", f"object {each.name!r}", problem)
    return scene


def _object_in(body: str) -> dict[str, Any]:
    try:
        content = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise SceneFileError("scene", "", f"is not JSON: {error}"[:200]) from None
    if not isinstance(content, dict):
        raise SceneFileError("scene", "", "is not an object; accepted: one with a schema")
    return content
