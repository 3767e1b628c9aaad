"""URDF tree: a URDF's links, and its one chain from root to tip as a robot file can hold it.

Owns the rules of a tree of links, of a gripper, and of the tip that is meant where none is named.
Owns also the treatment of the other branches (rigid ones give their shapes to the chain, moving
ones are left out), and the conversion of mimic joints into dependent ones.

A gripper is a link from which several branches move by one motor: the fingers, of which one has the
motor and the others mimic it. An arm ends before it, because the opening of a gripper does not
determine the tool's pose.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from ..description.schema import (
    MAX_MESHES,
    Dependence,
    JointType,
    MeshFacts,
    Placement,
    Shape,
    Term,
)
from ..errors import RobotFileError
from .imported_chain import UNTURNED, ImportedChain, ImportedJoint, compose
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
            shown = ", ".join(roots[:_SHOWN])
            problem = f"has {len(roots)} links that hang on nothing ({shown}); accepted: one"
            raise RobotFileError(model.file, "", problem)
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
        """Links that carry nothing, except the root."""
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
    """Links where a chain could end, the likeliest first; `clear` if there is no real doubt.

    `fork` is the link at which the ways to them part: an arm could end there too.
    """

    tips: tuple[str, ...]
    clear: bool
    fork: str


def possible_tips(model: UrdfModel) -> TipChoice:
    """Return the possible ends of the chain: of the end links, those beyond most joints that move.

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
                problem = f"is {link!r}, which is no link of the file; accepted: the name of one"
                raise RobotFileError(model.file, f"joint {joint.name!r}.{field}", problem)
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
    """Return a link and all links that it carries, each before those that hang on it."""
    reached = [link]
    for each in reached:
        reached += [joint.child for joint in below[each]]
    return reached


def _fingers(links: Sequence[str], below: Mapping[str, Sequence[UrdfJoint]]) -> set[str]:
    """Return the joints at which the fingers of grippers begin; `links` from the root outwards."""
    motors = _motors([joint for link in links for joint in below[link] if _moves(joint)])
    movers: dict[str, set[str]] = {}  # motors of the links beyond each one; two stand for more
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
    """Return the joint with the motor for each joint that moves: itself, or the one it mimics."""
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


_BASE_NAME = "base"  # ROS-Industrial's name for the controller's own base frame
_JOINT_TYPES = {
    UrdfType.REVOLUTE: JointType.REVOLUTE,
    UrdfType.CONTINUOUS: JointType.REVOLUTE,
    UrdfType.PRISMATIC: JointType.PRISMATIC,
    UrdfType.FIXED: JointType.FIXED,
}


def chain_to(model: UrdfModel, tip: str) -> ImportedChain:
    """Return the chain from the root to a tip of a URDF.

    Raises:
        RobotFileError: the links form no tree, the tip is no link of it, or a joint on the way is
            of a kind that no robot file can hold.
    """
    tree = LinkTree.of(model)
    if tip not in model.links or tip == tree.root:
        ends = ", ".join(tree.ends[:_SHOWN])
        raise RobotFileError(model.file, f"link {tip!r}", f"is no tip; accepted: {ends or 'none'}")
    way = tree.way(tip)
    joints = tuple(_imported(joint, way, model) for joint in way)
    if not any(joint.driven for joint in joints):
        problem = "has no motor between itself and the root"
        raise RobotFileError(model.file, f"link {tip!r}", problem)
    links = [tree.root, *(joint.child for joint in way)]
    shapes: dict[str, tuple[Shape, ...]] = {link: model.links[link].shapes for link in links}
    remarks = [remark for link in links for remark in model.links[link].remarks]
    meshes = [mesh for link in links for mesh in model.links[link].meshes]
    refused = [mesh for link in links for mesh in model.links[link].refused]
    remarks += _fold_branches(model, tree, links, shapes, meshes, refused)
    if len(meshes) > MAX_MESHES:
        remarks.append(f"only the first {MAX_MESHES} of {len(meshes)} meshes are kept")
    remarks += _readings(way)
    return ImportedChain(
        file=model.file,
        source="URDF",
        name=model.name,
        joints=joints,
        collision={link: found for link, found in shapes.items() if found},
        masses={link: mass for link in links if (mass := model.links[link].mass) is not None},
        base_frame=_base_frame(tree),
        remarks=tuple(remarks),
        meshes=tuple(meshes[:MAX_MESHES]),
        refused_meshes=tuple(dict.fromkeys(refused)),
    )


def _imported(joint: UrdfJoint, way: list[UrdfJoint], model: UrdfModel) -> ImportedJoint:
    kind = _JOINT_TYPES.get(joint.type)
    if kind is None:
        problem = (
            f"is {joint.type}, which is more than one axis; accepted: {', '.join(_JOINT_TYPES)}"
        )
        raise RobotFileError(model.file, f"joint {joint.name!r}.type", problem)
    if kind is JointType.FIXED:
        return ImportedJoint(joint.name, kind, joint.parent, joint.child, joint.origin)
    bounded = joint.lower is not None or joint.upper is not None
    continuous = joint.type is UrdfType.CONTINUOUS
    return ImportedJoint(
        name=joint.name,
        type=kind,
        parent=joint.parent,
        child=joint.child,
        origin=joint.origin,
        axis=joint.axis,
        lower=(joint.lower or 0.0) if bounded and not continuous else None,
        upper=(joint.upper or 0.0) if bounded and not continuous else None,
        velocity=joint.velocity,
        acceleration=joint.acceleration,
        effort=joint.effort,
        dependent=_dependence(joint, way, model),
        continuous=continuous,
    )


def _dependence(joint: UrdfJoint, way: list[UrdfJoint], model: UrdfModel) -> Dependence | None:
    if joint.mimic is None:
        return None
    where = f"joint {joint.name!r}.mimic.joint"
    by_name = {each.name: each for each in way}
    names = [each.name for each in way]
    gain, offset, follower = 1.0, 0.0, joint
    seen = {joint.name}
    while follower.mimic is not None:
        # q = multiplier · leader + offset, put into what was already known of q.
        gain, offset = gain * follower.mimic.multiplier, offset + gain * follower.mimic.offset
        leader = by_name.get(follower.mimic.joint)
        if leader is None or leader.type is UrdfType.FIXED:
            problem = f"is {follower.mimic.joint!r}; accepted: a moving joint between root and tip"
            raise RobotFileError(model.file, where, problem)
        if leader.name in seen:
            problem = "leads back to itself; accepted: a driven joint"
            raise RobotFileError(model.file, where, problem)
        seen.add(leader.name)
        follower = leader
    if names.index(follower.name) > names.index(joint.name):
        problem = (
            f"is {follower.name!r}, which is further from the root; accepted: a joint before it"
        )
        raise RobotFileError(model.file, where, problem)
    return Dependence(terms=(Term(joint=follower.name, gain=gain),), offset=offset)


def _fold_branches(
    model: UrdfModel,
    tree: LinkTree,
    links: list[str],
    shapes: dict[str, tuple[Shape, ...]],
    meshes: list[MeshFacts],
    refused: list[str],
) -> Iterator[str]:
    children = tree.below
    on_chain = set(links)
    for link in links:
        waiting = [(joint, UNTURNED) for joint in children[link] if joint.child not in on_chain]
        while waiting:
            joint, parent = waiting.pop()
            if joint.type is not UrdfType.FIXED:
                yield f"branch at joint {joint.name!r} moves; it is left out, with all beyond it"
                continue
            placement = compose(parent, joint.origin)
            found = tuple(_placed(shape, placement) for shape in model.links[joint.child].shapes)
            shapes[link] = (*shapes[link], *found)
            refused += model.links[joint.child].refused
            for mesh in model.links[joint.child].meshes:
                moved = compose(placement, mesh)
                to = {"link": link, "xyz": moved.xyz, "rpy": moved.rpy}
                meshes.append(mesh.model_copy(update=to))
            what = f"its {len(found)} shapes are" if found else "without shapes, it is"
            yield f"branch {joint.child!r} is fixed to {link!r}: {what} made part of it"
            waiting += [(below, placement) for below in children[joint.child]]


def _placed(shape: Shape, placement: Placement) -> Shape:
    moved = compose(placement, shape)
    return shape.model_copy(update={"xyz": moved.xyz, "rpy": moved.rpy})


def _readings(way: list[UrdfJoint]) -> Iterator[str]:
    for joint in way:
        if joint.type is not UrdfType.CONTINUOUS and (joint.lower is None) != (joint.upper is None):
            missing = "lower" if joint.lower is None else "upper"
            yield f"joint {joint.name!r} does not state {missing}, which URDF then reads as 0"
        if joint.mimic is not None:
            yield f"joint {joint.name!r} mimics {joint.mimic.joint!r}: it has no motor of its own"


def _base_frame(tree: LinkTree) -> Placement | None:
    if _BASE_NAME not in tree.above:
        return None
    way = tree.way(_BASE_NAME)
    if any(joint.type is not UrdfType.FIXED for joint in way):
        return None
    placement = UNTURNED
    for joint in way:
        placement = compose(placement, joint.origin)
    return placement
