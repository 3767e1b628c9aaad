"""Frame tree: the named frames of a robot, and points, vectors and twists between them.

Owns the names of the four frames that every robot has, the accepted names, and the rules of
changing the tree. A tree is a value: a change returns a new one. It holds no time: `frame_history`
has the poses of moving frames. Knows no robot and no file. Poses are `pose.Pose` [m], each of a
frame in its parent.

    base                     the controller's own base frame
    ├── root                 the chain's root link, which for many robots is the base
    ├── flange               moves: the robot file's tool link, which tools are bolted to
    │   ├── tool             the selected tool's centre point; the flange where none is selected
    │   └── named tools      each TCP in the flange
    ├── other moving links   named when the tree is made
    └── user frames          each in any parent

Owns also the three rules of transforming, which differ: a point shifts and rotates, a free vector
only rotates, and a twist rotates and changes with the place of its linear part. Poses use
`Pose.compose`. These rules know no tree: the transform is the source frame in the target frame, as
of `FrameTree.transform`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from ..errors import BadArgument, FrameCycle, FrameExists, FrameInUse, FramePredefined, FrameUnknown
from ..pickled_pieces import PickledPieces, unpickled
from ..pose import Array, Pose, checked_vector, composed
from ..steps import Stepwise
from ..text_pieces import joined, made_once
from .grasp import DEFAULT_GRASP, Grasp

BASE, ROOT, FLANGE, TOOL = "base", "root", "flange", "tool"

LONGEST_NAME = 64


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Frame:
    """Frame of the tree.

    Attributes:
        name: unique in the tree.
        parent: the frame that it hangs from; None for the base alone.
        pose: its pose in its parent; None if it moves.
        predefined: True if it belongs to the robot, and so cannot be changed.
        grasp: of a tool that says where it grasps; None for any other frame.
    """

    name: str
    parent: str | None
    pose: Pose | None
    predefined: bool = False
    grasp: Grasp | None = None

    def __reduce__(self) -> tuple[type[Frame], tuple[object, ...]]:
        return Frame, (self.name, self.parent, self.pose, self.predefined, self.grasp)

    def __repr__(self) -> str:
        # As it was before tools had grasps, where there is none: journals hold these words.
        grasp = "" if self.grasp is None else f", grasp={self.grasp!r}"
        return (
            f"Frame(name={self.name!r}, parent={self.parent!r}, pose={self.pose!r},"
            f" predefined={self.predefined!r}{grasp})"
        )

    @property
    def moving(self) -> bool:
        """True if the pose depends on time."""
        return self.pose is None


def predefined_frames() -> Mapping[str, Frame]:
    """Return base, root, flange and tool: no root apart from the base, and no tool selected."""
    return MappingProxyType(
        {
            BASE: Frame(BASE, None, Pose.identity(), True),
            ROOT: Frame(ROOT, BASE, Pose.identity(), True),
            FLANGE: Frame(FLANGE, BASE, None, True),
            TOOL: Frame(TOOL, FLANGE, Pose.identity(), True),
        }
    )


def check_name(name: str) -> None:
    """Check that a frame may have a name.

    Raises:
        BadArgument: it is empty, longer than 64 characters, begins or ends with a space, or holds
            a character that cannot be printed.
    """
    if not (0 < len(name) <= LONGEST_NAME and name.isprintable() and name == name.strip()):
        accepted = f"1 to {LONGEST_NAME} printable characters, no space at the ends"
        raise BadArgument("name", name, accepted)


MOST_FRAMES = 1000

Places: TypeAlias = Mapping[str, Pose]
"""Pose of each moving frame in its parent."""


_UNMOVED = Pose.identity()


@dataclass(frozen=True, slots=True, eq=False)
class FrameTree:
    """Frames by name; `FrameTree()` has base, root, flange and tool.

    Attributes:
        frames: every frame, the predefined ones first.
        selected_tool: the tool that the frame `tool` stands for; None for the bare flange.

    Raises:
        FrameUnknown: in every method, for a name of no frame.
        FrameExists: for a new name that is in use.
        FramePredefined: for a change of a frame of the robot, or a frame placed in `tool`.
    """

    frames: Mapping[str, Frame] = field(default_factory=predefined_frames)
    selected_tool: str | None = None
    _pickles: PickledPieces[Frame] | None = field(default=None, init=False, repr=False)
    _texts: tuple[str, ...] | None = field(default=None, init=False, repr=False)

    @classmethod
    def of_robot(cls, root: Pose | None = None, links: Iterable[str] = ()) -> FrameTree:
        """Return the tree of a robot.

        Args:
            root: the root link in the base frame, as `to_base(Pose.identity(), "root")` of its
                kinematics returns it; None where they coincide.
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
        if self._pickles is None:
            for _ in self.pickle_steps(None):
                pass
        assert self._pickles is not None
        return _restore, (self._pickles.pickles, self.selected_tool)

    def pickle_steps(self, before: FrameTree | None) -> Stepwise[None]:
        """Pickle the frames in steps, and keep that.

        Args:
            before: a tree of which what is the same is kept.
        """
        known = None if before is None else before._pickles
        pickles = yield from PickledPieces.steps(tuple(self.frames.values()), known)
        object.__setattr__(self, "_pickles", pickles)

    def __repr__(self) -> str:
        return "".join(self.text_pieces())

    def text_pieces(self) -> Iterator[str]:
        """Return the text of `repr` in pieces of a millisecond or less each, made once."""
        return made_once(self, self._make_texts())

    def _make_texts(self) -> Iterator[str]:
        yield "FrameTree(frames=mappingproxy({"
        entries = tuple(self.frames.items())
        yield from joined(entries, lambda entry: f"{entry[0]!r}: {entry[1]!r}")
        yield f"}}), selected_tool={self.selected_tool!r})"

    def __getitem__(self, name: str) -> Frame:
        """Return a frame, or raise `FrameUnknown`."""
        try:
            return self.frames[name]
        except (KeyError, TypeError):
            raise FrameUnknown(name, tuple(self.frames)) from None

    @property
    def user_frames(self) -> tuple[Frame, ...]:
        """Frames of users that are no tools, parents before children."""
        own = [frame for frame in self.frames.values() if not frame.predefined]
        frames = [frame for frame in own if frame.parent != FLANGE]
        depths: dict[str, int] = {}  # how many frames are above each
        for frame in frames:
            way: list[str] = []
            upper: str | None = frame.name
            while upper is not None and upper not in depths:
                way.append(upper)
                upper = self.frames[upper].parent
            depth = -1 if upper is None else depths[upper]
            while way:
                depth += 1
                depths[way.pop()] = depth
        return tuple(sorted(frames, key=lambda frame: depths[frame.name]))

    @property
    def tools(self) -> tuple[Frame, ...]:
        """Named tools."""
        own = (frame for frame in self.frames.values() if not frame.predefined)
        return tuple(frame for frame in own if frame.parent == FLANGE)

    def add(self, name: str, pose: Pose, parent: str = BASE) -> FrameTree:
        """Return the tree with another user frame; under the flange it is a tool.

        Args:
            name: 1 to 64 printable characters, no space at either end.
            pose: its pose in its parent.
            parent: any frame but `tool`, which stands for another.

        Raises:
            BadArgument: the name is no name, or there are 1,000 frames already.
        """
        growing = GrowingTree(self)
        growing.add(name, pose, parent)
        return growing.tree

    def add_tool(self, name: str, tcp: Pose, grasp: Grasp | None = None) -> FrameTree:
        """Return the tree with another tool.

        Args:
            tcp: its centre point in the flange.
            grasp: where it grasps; None for the default.

        Raises:
            BadArgument: the name is no name, or there are 1,000 frames already.
        """
        growing = GrowingTree(self)
        growing.add(name, tcp, FLANGE, grasp)
        return growing.tree

    def move_tool(self, name: str, tcp: Pose, grasp: Grasp | None = None) -> FrameTree:
        """Return the tree with a tool of another centre point and grasp; as of `add_tool`."""
        moved = self.move(name, tcp, FLANGE)
        return moved._with(replace(moved[name], grasp=grasp))

    @property
    def grasp(self) -> Grasp:
        """Where the selected tool grasps, in its own frame."""
        selected = None if self.selected_tool is None else self.frames[self.selected_tool].grasp
        return selected or DEFAULT_GRASP

    def select_tool(self, name: str | None) -> FrameTree:
        """Return the tree in which the frame `tool` is a named tool, or with None the flange."""
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
        """Return the tree with a frame at another pose; the frames that hang from it move with it.

        Args:
            name: a user frame or a tool.
            parent: a new parent; None for the present one.

        Raises:
            FrameCycle: the parent hangs from the frame.
            FrameInUse: the selected tool would leave the flange.
        """
        frame = self._own(name, "moved")
        upper = self._parent(parent or frame.parent or BASE)
        if name in self.ancestors(upper):
            raise FrameCycle(name, upper)
        if name == self.selected_tool and upper != FLANGE:
            raise FrameInUse(name, (TOOL,))
        grasp = frame.grasp if upper == FLANGE else None
        tree = self._with(replace(frame, pose=pose, parent=upper, grasp=grasp))
        return tree.select_tool(name) if name == self.selected_tool else tree

    def rename(self, name: str, new_name: str) -> FrameTree:
        """Return the tree with a frame under another name, in its place in the order.

        Raises:
            BadArgument: the new name is no name.
        """
        self._own(name, "renamed")
        if new_name == name:
            return self
        self._new_name(new_name)
        frames = {}
        for frame in self.frames.values():
            if frame.name == name:
                frames[new_name] = replace(frame, name=new_name)
            elif frame.parent == name:
                frames[frame.name] = replace(frame, parent=new_name)
            else:
                frames[frame.name] = frame
        selected = new_name if self.selected_tool == name else self.selected_tool
        return FrameTree(MappingProxyType(frames), selected)

    def remove(self, name: str) -> FrameTree:
        """Return the tree without a frame; `FrameInUse` for a parent, or the selected tool."""
        self._own(name, "removed")
        users = [frame.name for frame in self.frames.values() if frame.parent == name]
        if name == self.selected_tool:
            users.append(TOOL)
        if users:
            raise FrameInUse(name, tuple(users))
        frames = {key: frame for key, frame in self.frames.items() if key != name}
        return replace(self, frames=MappingProxyType(frames))

    def without(self, names: Collection[str]) -> FrameTree:
        """Return the tree without some frames; `FrameInUse` where one that stays needs one of them.

        As if they were removed one by one, those that need others first.
        """
        for name in names:
            self._own(name, "removed")
        needed: dict[str, list[str]] = {}
        for frame in self.frames.values():
            if frame.parent is not None and frame.parent in names and frame.name not in names:
                needed.setdefault(frame.parent, []).append(frame.name)
        if self.selected_tool is not None and self.selected_tool in names:
            needed.setdefault(self.selected_tool, []).append(TOOL)
        for name in names:
            if name in needed:
                raise FrameInUse(name, tuple(needed[name]))
        frames = {key: frame for key, frame in self.frames.items() if key not in names}
        return replace(self, frames=MappingProxyType(frames))

    def ancestors(self, name: str) -> tuple[str, ...]:
        """Return the frame, its parent, and so on up to the base."""
        way, frame = [name], self[name]
        while frame.parent is not None:
            way.append(frame.parent)
            frame = self[frame.parent]
        return tuple(way)

    def moving_between(self, source: str, target: str) -> tuple[str, ...]:
        """Return the moving frames whose places `transform` needs."""
        if source == target and self[source]:
            return ()
        ways = set(self.ancestors(source)) ^ set(self.ancestors(target))
        return tuple(name for name in self.frames if name in ways and self[name].moving)

    def transform(self, source: str, target: str, places: Places | None = None) -> Pose:
        """Return the pose of the frame `source` in the frame `target`.

        Its `compose` transforms poses from one to the other; `transform_point`, `transform_vector`
        and `transform_twist` do the same for points, vectors and twists.

        Args:
            places: poses of the frames of `moving_between` in their parents.

        Raises:
            FrameUnknown: there is no such frame, or `places` lacks one that moves.
        """
        if source == target and self[source]:
            return _UNMOVED  # as most goals are given in base
        known = places or {}
        up, down = self.ancestors(source), self.ancestors(target)
        shared = set(up) & set(down)
        return self._below(down, shared, known).inverse().compose(self._below(up, shared, known))

    def standing_in_base(self, frame: str) -> Pose:
        """Return the pose in base of a frame that stands still.

        It costs more to find than to bring one pose into base: ask once for all of a path's.

        Raises:
            FrameUnknown: there is no such frame.
            BadArgument: the frame moves.
        """
        if self.moving_between(frame, BASE):
            raise BadArgument("frame", frame, "base, root or a frame that stands still")
        return self.transform(frame, BASE)

    def _below(self, way: tuple[str, ...], shared: set[str], places: Places) -> Pose:
        """Return the pose of the first frame of an upward path in the first shared frame on it."""
        below: list[Pose] = []
        for name in way:
            if name in shared:
                break
            local = self[name].pose or places.get(name)
            if local is None:
                raise FrameUnknown(name, tuple(places))
            below.append(local)
        return composed(below[::-1])

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


class GrowingTree:
    """A tree to which many frames are added, each in a time that does not depend on how many."""

    def __init__(self, tree: FrameTree) -> None:
        """Begin with a tree, which stays as it is."""
        self._frames = dict(tree.frames)
        # A view: what is asked of it is answered by the frames that were added meanwhile, too.
        self._view = FrameTree(MappingProxyType(self._frames), tree.selected_tool)

    def add(self, name: str, pose: Pose, parent: str = BASE, grasp: Grasp | None = None) -> None:
        """Add a frame; arguments and refusals are those of `FrameTree.add` and `add_tool`."""
        if len(self._frames) >= MOST_FRAMES:
            raise BadArgument("frames", len(self._frames) + 1, f"at most {MOST_FRAMES}")
        frame = Frame(self._view._new_name(name), self._view._parent(parent), pose, grasp=grasp)
        self._frames[name] = frame

    @property
    def tree(self) -> FrameTree:
        """The tree with all that was added."""
        return FrameTree(MappingProxyType(dict(self._frames)), self._view.selected_tool)


def _restore(pickles: Sequence[bytes], selected_tool: str | None) -> FrameTree:
    frames = {frame.name: frame for frame in unpickled(pickles)}
    return FrameTree(MappingProxyType(frames), selected_tool)


def transform_point(transform: Pose, point: Sequence[float] | Array) -> Array:
    """Return the (3,) place [m] in the target frame of a (3,) place in the source frame.

    Args:
        transform: the source frame in the target frame, as of `FrameTree.transform`.

    Raises:
        BadArgument, NotFinite: not three finite values.
    """
    moved: Array = transform.position + transform.rotation @ checked_vector(point, 3, "point")
    return moved


def transform_vector(transform: Pose, vector: Sequence[float] | Array) -> Array:
    """Return a (3,) free vector, such as a velocity or a force, along the target frame's axes.

    Raises:
        BadArgument, NotFinite: not three finite values.
    """
    turned: Array = transform.rotation @ checked_vector(vector, 3, "vector")
    return turned


def transform_twist(transform: Pose, twist: Sequence[float] | Array) -> Array:
    """Return a rigid body's twist as seen in the target frame.

    The linear part of a twist is the velocity of the body's point at the *origin of the frame it
    is expressed in*, so it changes with the frame: v' = R v + p × R ω, ω' = R ω, the adjoint of
    Lynch and Park, Modern Robotics, section 3.3.2, in the order [v; ω]. The velocity of one and
    the same point is two free vectors instead: `transform_vector` each.

    Args:
        transform: the source frame in the target frame; the two do not move against each other.
        twist: (6,) [v; ω], m/s and rad/s.

    Raises:
        BadArgument, NotFinite: not six finite values.
    """
    values = checked_vector(twist, 6, "twist")
    rotation = transform.rotation
    angular = rotation @ values[3:]
    return np.concatenate((rotation @ values[:3] + np.cross(transform.position, angular), angular))
