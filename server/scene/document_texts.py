"""Texts of the documents of a planning scene: JSON, made entry by entry in steps.

Owns that the text of an entry that stayed is not made again, so that a change of one object among
hundreds costs the event loop little. The layouts are those of `motion.scene.scene_file` and
`motion.frames.frame_file`: a text is what `json.dumps` makes of their data.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

from openpendant.motion.frames.frame_file import SCHEMA as FRAMES_SCHEMA
from openpendant.motion.frames.frame_file import frame_to_data, tool_to_data
from openpendant.motion.frames.frame_tree import Frame, FrameTree
from openpendant.motion.scene.scene import Scene, SceneObject
from openpendant.motion.scene.scene_file import SCENE_SCHEMA, object_to_data
from openpendant.motion.steps import Stepwise, at_once

from ..store.documents import DocumentKind

SPACED, COMPACT = (", ", ": "), (",", ":")
"""Separators of a document, and of a reply."""

Making: TypeAlias = Stepwise[str]
"""Makes a text in steps."""

_A_STEP = 64  # entries
_PAIRS_A_STEP = 512

# About how long it takes on an ordinary machine [µs].
_PER_NEW = 8.0
_PER_KNOWN = 0.3
_PER_PAIR = 0.5
_PER_SORTED = 0.4


class _Named(Protocol):
    @property
    def name(self) -> str: ...


_Entry = TypeVar("_Entry", bound=_Named)


class _Entries(Generic[_Entry]):
    """Texts of the entries of one list after the other."""

    def __init__(
        self,
        to_data: Callable[[_Entry], Any],
        is_same: Callable[[_Entry, _Entry], bool],
        separators: tuple[str, str],
    ) -> None:
        self._to_data = to_data
        self._is_same = is_same
        self._separators = separators
        self._known: dict[str, tuple[_Entry, str]] = {}

    def steps(self, entries: Sequence[_Entry]) -> Making:
        made: dict[str, tuple[_Entry, str]] = {}
        for first in range(0, len(entries), _A_STEP):
            some = entries[first : first + _A_STEP]
            new = sum(self._known_text(each) is None for each in some)
            yield _PER_NEW * new + _PER_KNOWN * len(some)
            for each in some:
                text = self._known_text(each)
                made[each.name] = each, self._text(each) if text is None else text
        yield _PER_KNOWN * len(made)
        self._known = made
        return f"[{self._separators[0].join([text for _, text in made.values()])}]"

    def _known_text(self, each: _Entry) -> str | None:
        known = self._known.get(each.name)
        return known[1] if known is not None and self._is_same(known[0], each) else None

    def _text(self, each: _Entry) -> str:
        data = self._to_data(each)
        return json.dumps(data, ensure_ascii=False, separators=self._separators)


class SceneText:
    """Text of one scene after the other."""

    def __init__(self, separators: tuple[str, str] = SPACED) -> None:
        """Have no text yet."""
        self._separators = separators
        self._objects: _Entries[SceneObject] = _Entries(
            object_to_data, lambda one, other: one is other, separators
        )

    def steps(self, scene: Scene) -> Making:
        """Make the text of a scene in steps, and return it."""
        objects = yield from self._objects.steps(scene.objects)
        yield _PER_SORTED * len(scene.allowed)
        allowed = sorted(scene.allowed)
        texts: list[str] = []
        for first in range(0, len(allowed), _PAIRS_A_STEP):
            some = allowed[first : first + _PAIRS_A_STEP]
            yield _PER_PAIR * len(some)
            texts.append(self._json(some)[1:-1])
        parts = {
            "schema": self._json(SCENE_SCHEMA),
            "revision": self._json(scene.revision),
            "objects": objects,
            "allowed": f"[{self._separators[0].join(texts)}]",
        }
        return joined(parts, self._separators)

    def _json(self, value: Any) -> str:
        return json.dumps(value, ensure_ascii=False, separators=self._separators)


def _is_placed_alike(one: Frame, other: Frame) -> bool:
    return one.pose is other.pose and one.parent == other.parent and one.grasp == other.grasp


class FramesText:
    """Texts of user frames and of tools, of one tree after the other."""

    def __init__(self, separators: tuple[str, str] = SPACED) -> None:
        """Have no text yet."""
        self._separators = separators
        self._frames: _Entries[Frame] = _Entries(frame_to_data, _is_placed_alike, separators)
        self._tools: _Entries[Frame] = _Entries(tool_to_data, _is_placed_alike, separators)

    def steps(self, tree: FrameTree, *, frames: bool = True, tools: bool = True) -> Making:
        """Make the text of a tree, or of its user frames or tools only, and return it."""
        yield _PER_KNOWN * 3 * len(tree.frames)
        selected = tree.selected_tool if tools else None
        parts = {
            "schema": json.dumps(FRAMES_SCHEMA),
            "tools": (yield from self._tools.steps(tree.tools if tools else ())),
            "selected_tool": json.dumps(selected, ensure_ascii=False),
            "frames": (yield from self._frames.steps(tree.user_frames if frames else ())),
        }
        return joined(parts, self._separators)


def joined(parts: Mapping[str, str], separators: tuple[str, str]) -> str:
    """Return the text of an object from those of its values."""
    between, behind = separators
    return (
        f"{{{between.join([f'{json.dumps(key)}{behind}{text}' for key, text in parts.items()])}}}"
    )


def document_of(kind: DocumentKind, frames: FrameTree, scene: Scene) -> str:
    """Return the body of a document of a planning scene, made at once."""
    if kind is DocumentKind.SCENE:
        return at_once(SceneText().steps(scene))
    is_tools = kind is DocumentKind.TOOLS
    return at_once(FramesText().steps(frames, frames=not is_tools, tools=is_tools))
