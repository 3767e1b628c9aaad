"""The tree that the links of a URDF form, and where in it an arm ends.

Owns what a tree of links must be, what a gripper is, and which tip is meant where none is named.
What becomes of the chain to that tip is `urdf_chain`'s.

A gripper is a link from which several branches move by one motor: the fingers, of which one has the
motor and the others mimic it. An arm ends before it, because how far a gripper is open does not
tell where the tool is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from ..errors import RobotFileError
from .urdf import UrdfJoint, UrdfModel, UrdfType

# Where two tips differ by fixed joints only, the first of these is the tool.
_TOOL_NAMES = ("tool0", "tcp", "tool", "tool_link", "flange", "ee_link", "end_effector")
_SHOWN = 8  # names in a message


@dataclass(frozen=True, slots=True)
class LinkTree:
    """Links joined in one open tree.

    Attributes:
        root: the link that hangs on nothing.
        above: the joint that each other link hangs on.
        below: the joints that hang on each link, none for an end.
    """

    root: str
    above: Mapping[str, UrdfJoint]
    below: Mapping[str, Sequence[UrdfJoint]]

    @classmethod
    def of(cls, model: UrdfModel) -> LinkTree:
        """Return the tree of a URDF's links.

        Raises:
            RobotFileError: a joint names no link, a link hangs on two joints or on itself, or not
                exactly one hangs on nothing.
        """
        if not model.links:
            raise RobotFileError(model.file, "", "has no links; accepted: two or more")
        above = _joints_above(model)
        roots = [link for link in model.links if link not in above]
        if len(roots) > 1:
            raise RobotFileError(
                model.file,
                "",
                f"has {len(roots)} links that hang on nothing"
                f" ({', '.join(roots[:_SHOWN])}); accepted: one",
            )
        below: dict[str, list[UrdfJoint]] = {link: [] for link in model.links}
        for joint in model.joints:
            below[joint.parent].append(joint)
        reached = {link for root in roots for link in _beyond(root, below)}
        for link in model.links:
            if link not in reached:
                raise RobotFileError(
                    model.file,
                    f"link {link!r}",
                    f"is carried by itself through joint {above[link].name!r}, so the chain is"
                    " closed; accepted: open chains",
                )
        return cls(roots[0], above, below)

    @property
    def ends(self) -> tuple[str, ...]:
        """The links that carry nothing, but for the root."""
        return tuple(link for link in self.above if not self.below[link])

    def way(self, link: str) -> list[UrdfJoint]:
        """Return the joints from the root to a link, in this order."""
        way: list[UrdfJoint] = []
        while link in self.above:
            way.append(self.above[link])
            link = self.above[link].parent
        return way[::-1]

    def without_grippers(self) -> LinkTree:
        """Return the tree without the fingers, so that an arm with a gripper ends at its palm."""
        cut = _fingers(_beyond(self.root, self.below), self.below)
        below = {
            link: [joint for joint in joints if joint.name not in cut]
            for link, joints in self.below.items()
        }
        kept = _beyond(self.root, below)
        return LinkTree(
            self.root,
            {link: self.above[link] for link in kept if link != self.root},
            {link: below[link] for link in kept},
        )


@dataclass(frozen=True, slots=True)
class TipChoice:
    """The links a chain could end at, the likeliest first; `clear` if there is no real doubt.

    `fork` is the link at which the ways to them part: an arm could end there too.
    """

    tips: tuple[str, ...]
    clear: bool
    fork: str


def possible_tips(model: UrdfModel) -> TipChoice:
    """Return where the chain could end: of the links at an end, those beyond most joints that move.

    Raises:
        RobotFileError: the links form no tree, or nothing in it moves.
    """
    tree = LinkTree.of(model)
    arm = tree.without_grippers()
    if any(_moves(joint) for joint in arm.above.values()):
        tree = arm
    ways = {end: tree.way(end) for end in tree.ends}
    moving = {end: tuple(joint.name for joint in ways[end] if _moves(joint)) for end in ways}
    most = max((len(joints) for joints in moving.values()), default=0)
    if most == 0:
        raise RobotFileError(model.file, "", "has no joint that moves; accepted: one or more")
    best = sorted((end for end in moving if len(moving[end]) == most), key=_tool_rank)
    fork = tree.root
    for joints in zip(*(ways[end] for end in best), strict=False):
        if len({joint.name for joint in joints}) > 1:
            break
        fork = joints[0].child
    return TipChoice(tuple(best), len({moving[end] for end in best}) == 1, fork)


def _joints_above(model: UrdfModel) -> dict[str, UrdfJoint]:
    above: dict[str, UrdfJoint] = {}
    for joint in model.joints:
        for field, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in model.links:
                raise RobotFileError(
                    model.file,
                    f"joint {joint.name!r}.{field}",
                    f"is {link!r}, which is no link of the file; accepted: the name of one",
                )
        if joint.child in above:
            raise RobotFileError(
                model.file,
                f"link {joint.child!r}",
                f"hangs on two joints, {above[joint.child].name!r} and {joint.name!r}, so the"
                " chain is closed; accepted: open chains, each link on one joint",
            )
        above[joint.child] = joint
    return above


def _beyond(link: str, below: Mapping[str, Sequence[UrdfJoint]]) -> list[str]:
    """Return a link and all that it carries, each before what hangs on it."""
    reached = [link]
    for each in reached:
        reached += [joint.child for joint in below[each]]
    return reached


def _fingers(links: Sequence[str], below: Mapping[str, Sequence[UrdfJoint]]) -> set[str]:
    """Return the joints at which the fingers of grippers begin; `links` from the root outwards."""
    motors = _motors([joint for link in links for joint in below[link] if _moves(joint)])
    movers: dict[str, set[str]] = {}  # what moves the links beyond each one; two stand for more
    bearers: set[str] = set()  # links beyond which there is a motor
    fingers: set[str] = set()
    for link in reversed(links):
        moving = [joint for joint in below[link] if _moves(joint) or movers[joint.child]]
        found = {motors[joint.name] for joint in moving if _moves(joint)}
        found |= {motor for joint in moving for motor in movers[joint.child]}
        movers[link] = set(islice(found, 2))
        for joint in moving:
            if joint.child in bearers or motors.get(joint.name) == joint.name:
                bearers.add(link)
        if len(moving) > 1 and len(movers[link]) == 1 and link in bearers:
            fingers |= {joint.name for joint in moving}
    return fingers


def _motors(joints: Sequence[UrdfJoint]) -> dict[str, str]:
    """Return the joint with the motor for each joint that moves: itself, or whom it mimics."""
    leaders = {joint.name: joint.mimic.joint for joint in joints if joint.mimic is not None}
    motors: dict[str, str] = {}
    for joint in joints:
        passed = {joint.name: None}
        name = joint.name
        while name not in motors and (leader := leaders.get(name, name)) not in passed:
            passed[name := leader] = None
        motors.update(dict.fromkeys(passed, motors.get(name, name)))
    return motors


def _moves(joint: UrdfJoint) -> bool:
    return joint.type is not UrdfType.FIXED


def _tool_rank(link: str) -> int:
    return _TOOL_NAMES.index(link) if link in _TOOL_NAMES else len(_TOOL_NAMES)
