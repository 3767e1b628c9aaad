"""The named frames of a robot: base, flange, tool, and those that users define.

Owns the tree and the rules of changing it. A tree is a value: a change returns a new one. It holds
no time; where moving frames are, or were, is told by `frame_history`. Knows no robot and no file.
Poses are `pose.Pose` [m], each of a frame in its parent.

    base                     the controller's own base frame
    ├── root                 the chain's root link, which for many robots is the base
    ├── flange               moves: what the tool is bolted to (the robot file's tool link)
    │   ├── tool             the selected tool's centre point; the flange where none is selected
    │   └── named tools      each TCP in the flange
    ├── other moving links   named when the tree is made
    └── user frames          each in any parent
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeAlias

from .errors import (
    BadArgument,
    FrameCycle,
    FrameExists,
    FrameInUse,
    FramePredefined,
    FrameUnknown,
)
from .frame import BASE, FLANGE, ROOT, TOOL, Frame, check_name, predefined_frames
from .pose import Pose

__all__ = ["BASE", "FLANGE", "MOST_FRAMES", "ROOT", "TOOL", "Frame", "FrameTree", "Places"]

MOST_FRAMES = 1000

Places: TypeAlias = Mapping[str, Pose]
"""Where each moving frame is, in its parent."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameTree:
    """Frames by name; `FrameTree()` has base, root, flange and tool.

    Attributes:
        frames: every frame, the predefined ones first.
        selected_tool: the tool that the frame `tool` stands for; None for the bare flange.
    """

    frames: Mapping[str, Frame] = field(default_factory=predefined_frames)
    selected_tool: str | None = None

    @classmethod
    def of_robot(cls, root: Pose | None = None, links: Iterable[str] = ()) -> FrameTree:
        """Make the tree of a robot.

        Args:
            root: the root link in the base frame, as `to_base(Pose.identity(), "root")` of its
                kinematics tells; None where they coincide.
            links: links, such as those behind each joint, that move and are placed in the base.

        Raises:
            FrameExists: a link has the name of another or of a predefined frame.
            BadArgument: a link's name is no frame name.
        """
        tree = cls()
        if root is not None:
            tree = tree._with(Frame(ROOT, BASE, root, True))
        for link in links:
            tree = tree._with(Frame(tree._new_name(link), BASE, None, True))
        return tree

    def __reduce__(self) -> tuple[Callable[..., FrameTree], tuple[object, ...]]:
        # A read-only view of a mapping cannot travel to the planning process by itself.
        return _restore, (dict(self.frames), self.selected_tool)

    def __getitem__(self, name: str) -> Frame:
        """Return a frame.

        Raises:
            FrameUnknown: there is none of that name.
        """
        try:
            return self.frames[name]
        except (KeyError, TypeError):
            raise FrameUnknown(name, tuple(self.frames)) from None

    @property
    def user_frames(self) -> tuple[Frame, ...]:
        """What users defined and is no tool, parents before children."""
        own = [frame for frame in self.frames.values() if not frame.predefined]
        frames = [frame for frame in own if frame.parent != FLANGE]
        return tuple(sorted(frames, key=lambda frame: len(self.way_up(frame.name))))

    @property
    def tools(self) -> tuple[Frame, ...]:
        """The named tools."""
        own = (frame for frame in self.frames.values() if not frame.predefined)
        return tuple(frame for frame in own if frame.parent == FLANGE)

    def add(self, name: str, pose: Pose, parent: str = BASE) -> FrameTree:
        """Return the tree with a user frame more; under the flange it is a tool.

        Args:
            name: 1 to 64 printable characters, none of them at the ends a space.
            pose: where it is in its parent.
            parent: any frame but `tool`, which stands for another.

        Raises:
            FrameExists: the name is in use.
            FrameUnknown: there is no such parent.
            FramePredefined: the parent is `tool`.
            BadArgument: the name is no name, or there are 1,000 frames already.
        """
        if len(self.frames) >= MOST_FRAMES:
            raise BadArgument("frames", len(self.frames) + 1, f"at most {MOST_FRAMES}")
        return self._with(Frame(self._new_name(name), self._parent(parent), pose))

    def add_tool(self, name: str, tcp: Pose) -> FrameTree:
        """Return the tree with a tool more; `tcp` is its centre point in the flange.

        Raises:
            FrameExists: the name is in use.
            BadArgument: the name is no name, or there are 1,000 frames already.
        """
        return self.add(name, tcp, FLANGE)

    def select_tool(self, name: str | None) -> FrameTree:
        """Return the tree in which the frame `tool` is a named tool, or with None the flange.

        Raises:
            FrameUnknown: there is no such tool.
        """
        if name is None:
            tcp = Pose.identity()
        else:
            known = {tool.name: tool.pose for tool in self.tools}
            found = known.get(name)
            if found is None:
                raise FrameUnknown(name, tuple(known))
            tcp = found
        return replace(self._with(Frame(TOOL, FLANGE, tcp, True)), selected_tool=name)

    def move(self, name: str, pose: Pose, parent: str | None = None) -> FrameTree:
        """Return the tree with a frame elsewhere; what hangs from it goes along.

        Args:
            name: a user frame or a tool.
            pose: where it is to be, in its parent.
            parent: a new parent; None for the one it has.

        Raises:
            FrameUnknown: there is no such frame or parent.
            FramePredefined: the frame belongs to the robot, or the parent is `tool`.
            FrameCycle: the parent hangs from the frame.
            FrameInUse: the selected tool would leave the flange.
        """
        frame = self._own(name, "moved")
        upper = self._parent(parent or frame.parent or BASE)
        if name in self.way_up(upper):
            raise FrameCycle(name, upper)
        if name == self.selected_tool and upper != FLANGE:
            raise FrameInUse(name, (TOOL,))
        tree = self._with(replace(frame, pose=pose, parent=upper))
        return tree.select_tool(name) if name == self.selected_tool else tree

    def rename(self, name: str, new_name: str) -> FrameTree:
        """Return the tree with a frame under another name, in its place in the order.

        Raises:
            FrameUnknown: there is no such frame.
            FrameExists: the new name is in use.
            FramePredefined: the frame belongs to the robot.
            BadArgument: the new name is no name.
        """
        self._own(name, "renamed")
        if new_name == name:
            return self
        self._new_name(new_name)
        names: dict[str | None, str] = {name: new_name}
        frames = {}
        for frame in self.frames.values():
            called = names.get(frame.name, frame.name)
            parent = names.get(frame.parent, frame.parent)
            frames[called] = replace(frame, name=called, parent=parent)
        selected = names.get(self.selected_tool, self.selected_tool)
        return FrameTree(MappingProxyType(frames), selected)

    def remove(self, name: str) -> FrameTree:
        """Return the tree without a frame.

        Raises:
            FrameUnknown: there is no such frame.
            FramePredefined: the frame belongs to the robot.
            FrameInUse: other frames hang from it, or it is the selected tool.
        """
        self._own(name, "removed")
        users = [frame.name for frame in self.frames.values() if frame.parent == name]
        if name == self.selected_tool:
            users.append(TOOL)
        if users:
            raise FrameInUse(name, tuple(users))
        frames = {key: frame for key, frame in self.frames.items() if key != name}
        return replace(self, frames=MappingProxyType(frames))

    def way_up(self, name: str) -> tuple[str, ...]:
        """Return the frame, its parent, and so on up to the base.

        Raises:
            FrameUnknown: there is no such frame.
        """
        way, frame = [name], self[name]
        while frame.parent is not None:
            way.append(frame.parent)
            frame = self[frame.parent]
        return tuple(way)

    def moving_between(self, source: str, target: str) -> tuple[str, ...]:
        """Return the moving frames whose places `transform` needs.

        Raises:
            FrameUnknown: there is no such frame.
        """
        ways = set(self.way_up(source)) ^ set(self.way_up(target))
        return tuple(name for name in self.frames if name in ways and self[name].moving)

    def transform(self, source: str, target: str, places: Places | None = None) -> Pose:
        """Return where the frame `source` is in the frame `target`.

        Its `compose` takes poses from one to the other; `frame_transforms` has what takes points,
        vectors and twists.

        Args:
            source: the frame that something is given in.
            target: the frame that it is wanted in.
            places: where the frames of `moving_between` are in their parents.

        Raises:
            FrameUnknown: there is no such frame, or `places` lacks one that moves.
        """
        known = places or {}
        up, down = self.way_up(source), self.way_up(target)
        shared = set(up) & set(down)
        return self._below(down, shared, known).inverse().compose(self._below(up, shared, known))

    def _below(self, way: tuple[str, ...], shared: set[str], places: Places) -> Pose:
        """Return where the first frame of a way is in the first one of it that is shared."""
        pose = Pose.identity()
        for name in way:
            if name in shared:
                break
            local = self[name].pose or places.get(name)
            if local is None:
                raise FrameUnknown(name, tuple(places))
            pose = local.compose(pose)
        return pose

    def _with(self, frame: Frame) -> FrameTree:
        return replace(self, frames=MappingProxyType({**self.frames, frame.name: frame}))

    def _own(self, name: str, action: str) -> Frame:
        frame = self[name]
        if frame.predefined:
            raise FramePredefined(name, action)
        return frame

    def _parent(self, name: str) -> str:
        if name == TOOL:
            raise FramePredefined(TOOL, "a parent, because it stands for the selected tool")
        return self[name].name

    def _new_name(self, name: str) -> str:
        check_name(name)
        if name in self.frames:
            raise FrameExists(name)
        return name


def _restore(frames: dict[str, Frame], selected_tool: str | None) -> FrameTree:
    return FrameTree(MappingProxyType(frames), selected_tool)
