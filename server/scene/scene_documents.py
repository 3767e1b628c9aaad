"""Frames, tools and scene as documents of the store, and back.

Owns which document holds what: `frames` the user frames, `tools` the tools and which is selected,
`scene` the objects and the pairs that may touch; each is named after its cell. `motion` owns what
the values mean. Meshes are files of the server, so a document from outside must not name one.
"""

from __future__ import annotations

import json

from openpendant.motion.errors import SceneFileError
from openpendant.motion.frames.frame_file import frames_from_json, frames_to_json
from openpendant.motion.frames.frame_tree import FLANGE, FrameTree
from openpendant.motion.scene.scene import Mesh, Scene
from openpendant.motion.scene.scene_file import scene_from_data, scene_to_data

from ..store.documents import DocumentKind

WORLD_KINDS = (DocumentKind.TOOLS, DocumentKind.FRAMES, DocumentKind.SCENE)
"""In the order in which they are read: a user frame may hang from a tool."""


def document_of(kind: DocumentKind, frames: FrameTree, scene: Scene) -> str:
    """Return the body of a document of the planning scene."""
    if kind is DocumentKind.SCENE:
        return json.dumps(scene_to_data(scene), ensure_ascii=False)
    whole = json.loads(frames_to_json(frames))
    if kind is DocumentKind.TOOLS:
        whole["frames"] = []
    else:
        whole["tools"], whole["selected_tool"] = [], None
    return json.dumps(whole, ensure_ascii=False)


def with_frames(kind: DocumentKind, body: str, tree: FrameTree) -> FrameTree:
    """Return a tree whose user frames, or tools, are those of a document.

    Args:
        kind: frames or tools; those that the tree has of the kind are replaced.
        body: the document's.
        tree: what they are put into.

    Raises:
        MotionError: the document is none, or frames that stay hang from what goes.
    """
    selected = tree.selected_tool
    if kind is DocumentKind.TOOLS:
        bare = tree.select_tool(None)
        for tool in tree.tools:
            bare = bare.remove(tool.name)
        grown = frames_from_json(body, "tools", bare)
        return grown
    bare = tree
    for frame in reversed(tree.user_frames):
        bare = bare.remove(frame.name)
    grown = frames_from_json(body, "frames", bare)
    # A document of frames selects no tool, which is not to say that none is selected.
    return grown if grown.selected_tool == selected else grown.select_tool(selected)


def scene_from_json(body: str) -> Scene:
    """Return the scene of a document or of a file's text.

    Raises:
        MotionError: it is none, or has a mesh.
    """
    try:
        content = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise SceneFileError("scene", "", f"is not JSON: {error}"[:200]) from None
    if not isinstance(content, dict):
        raise SceneFileError("scene", "", "is not an object; accepted: one with a schema")
    scene = scene_from_data(content, "scene")
    for each in scene.objects:
        if isinstance(each.shape, Mesh):
            problem = "is a mesh; accepted: box, sphere, cylinder, capsule"
            raise SceneFileError("scene", f"object {each.name!r}", problem)
    return scene


def is_tool(tree: FrameTree, name: str) -> bool:
    """Return True if a frame is a tool, and so in the document of tools."""
    return tree[name].parent == FLANGE
