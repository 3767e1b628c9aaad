"""Reading of the documents of a planning scene: user frames, tools, and the objects of a scene.

Owns what a document of each kind may change. `motion` owns what the values mean. Meshes are files
of the server, so a document from outside must not name one.
"""

from __future__ import annotations

import json

from openpendant.motion.errors import SceneFileError
from openpendant.motion.frames.frame_file import frames_from_json
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.scene.scene import Mesh, Scene
from openpendant.motion.scene.scene_file import scene_from_data

from ..store.documents import DocumentKind


def with_frames(kind: DocumentKind, body: str, tree: FrameTree) -> FrameTree:
    """Return a tree whose user frames, or tools, are those of a document.

    Args:
        kind: frames or tools; those that the tree has of the kind are replaced.

    Raises:
        MotionError: the document is none, or frames that stay hang from what goes.
    """
    selected = tree.selected_tool
    if kind is DocumentKind.TOOLS:
        bare = tree.select_tool(None).without({tool.name: None for tool in tree.tools})
        grown = frames_from_json(body, "tools", bare)
        return grown
    bare = tree.without({frame.name: None for frame in tree.user_frames})
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
