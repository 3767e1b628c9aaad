"""The one chain of a URDF from its root to a tip, as a robot file can hold it.

Owns what a tree of links must be, which tip is meant where none is named, what becomes of the
branches that are left (rigid ones give their shapes to the chain, moving ones are left out), and
how mimic joints become dependent ones.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ..errors import RobotFileError
from ..robot_schema import Dependence, JointType, Placement, Shape, Term
from .imported_chain import UNTURNED, ImportedChain, ImportedJoint
from .placements import compose
from .urdf import UrdfJoint, UrdfModel, UrdfType

# Where two tips differ by fixed joints only, the first of these is the tool.
_TOOL_NAMES = ("tool0", "tcp", "tool", "tool_link", "flange", "ee_link", "end_effector")
_SHOWN = 8  # names in a message
_BASE_NAME = "base"  # ROS-Industrial's name for the controller's own base frame
_JOINT_TYPES = {
    UrdfType.REVOLUTE: JointType.REVOLUTE,
    UrdfType.CONTINUOUS: JointType.REVOLUTE,
    UrdfType.PRISMATIC: JointType.PRISMATIC,
    UrdfType.FIXED: JointType.FIXED,
}


@dataclass(frozen=True, slots=True)
class TipChoice:
    """The links a chain could end at, the likeliest first; `clear` if there is no real doubt."""

    tips: tuple[str, ...]
    clear: bool


def possible_tips(model: UrdfModel) -> TipChoice:
    """Return where the chain could end: of the links at an end, those beyond most motors.

    Raises:
        RobotFileError: the links form no tree, or nothing in it moves.
    """
    root, above = _tree(model)
    ends = [link for link in model.links if link not in {joint.parent for joint in model.joints}]
    moving = {end: _moving(_way(end, above)) for end in ends if end != root}
    most = max((len(joints) for joints in moving.values()), default=0)
    if most == 0:
        raise RobotFileError(model.file, "", "has no joint that moves; accepted: one or more")
    best = sorted((end for end in moving if len(moving[end]) == most), key=_tool_rank)
    same_motors = len({moving[end] for end in best}) == 1
    return TipChoice(tuple(best), clear=same_motors)


def chain_to(model: UrdfModel, tip: str) -> ImportedChain:
    """Take the chain from the root to a tip out of a URDF.

    Raises:
        RobotFileError: the links form no tree, the tip is no link of it, or a joint on the way is
            of a kind that no robot file can hold.
    """
    root, above = _tree(model)
    if tip not in model.links or tip == root:
        children = _children(model)
        ends = ", ".join([link for link in above if not children[link]][:_SHOWN])
        raise RobotFileError(model.file, f"link {tip!r}", f"is no tip; accepted: {ends or 'none'}")
    way = _way(tip, above)
    joints = tuple(_imported(joint, way, model) for joint in way)
    if not any(joint.driven for joint in joints):
        raise RobotFileError(
            model.file, f"link {tip!r}", "has no motor between itself and the root"
        )
    links = [root, *(joint.child for joint in way)]
    shapes: dict[str, tuple[Shape, ...]] = {link: model.links[link].shapes for link in links}
    remarks = [remark for link in links for remark in model.links[link].remarks]
    remarks += _fold_branches(model, links, shapes)
    remarks += _readings(way)
    return ImportedChain(
        file=model.file,
        source="URDF",
        name=model.name,
        joints=joints,
        collision={link: found for link, found in shapes.items() if found},
        masses={link: mass for link in links if (mass := model.links[link].mass) is not None},
        base_frame=_base_frame(above),
        remarks=tuple(remarks),
    )


def _tree(model: UrdfModel) -> tuple[str, dict[str, UrdfJoint]]:
    # The root, and the joint above each other link; together they prove that this is one tree.
    above: dict[str, UrdfJoint] = {}
    for joint in model.joints:
        for field, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in model.links:
                raise RobotFileError(
                    model.file,
                    f"joint {joint.name!r}.{field}",
                    f"is {link!r}, which is no link of the file",
                )
        if joint.child in above:
            raise RobotFileError(
                model.file,
                f"link {joint.child!r}",
                f"hangs on two joints, {above[joint.child].name!r} and {joint.name!r}, so the"
                " chain is closed; accepted: open chains, each link on one joint",
            )
        above[joint.child] = joint
    roots = [link for link in model.links if link not in above]
    if not model.links:
        raise RobotFileError(model.file, "", "has no links")
    if len(roots) > 1:
        raise RobotFileError(
            model.file,
            "",
            f"has {len(roots)} links that hang on nothing"
            f" ({', '.join(roots[:_SHOWN])}); accepted: one",
        )
    reached = set(roots)
    children = _children(model)
    waiting = list(roots)
    while waiting:
        for joint in children[waiting.pop()]:
            reached.add(joint.child)
            waiting.append(joint.child)
    for link in model.links:
        if link not in reached:
            raise RobotFileError(
                model.file,
                f"link {link!r}",
                f"is carried by itself through joint {above[link].name!r}, so the chain is closed;"
                " accepted: open chains",
            )
    return roots[0], above


def _children(model: UrdfModel) -> Mapping[str, list[UrdfJoint]]:
    children: dict[str, list[UrdfJoint]] = defaultdict(list)
    for joint in model.joints:
        children[joint.parent].append(joint)
    return children


def _way(tip: str, above: Mapping[str, UrdfJoint]) -> list[UrdfJoint]:
    way: list[UrdfJoint] = []
    link = tip
    while link in above:
        way.append(above[link])
        link = above[link].parent
    return way[::-1]


def _moving(way: list[UrdfJoint]) -> tuple[str, ...]:
    return tuple(joint.name for joint in way if joint.type is not UrdfType.FIXED)


def _tool_rank(link: str) -> int:
    return _TOOL_NAMES.index(link) if link in _TOOL_NAMES else len(_TOOL_NAMES)


def _imported(joint: UrdfJoint, way: list[UrdfJoint], model: UrdfModel) -> ImportedJoint:
    kind = _JOINT_TYPES.get(joint.type)
    if kind is None:
        raise RobotFileError(
            model.file,
            f"joint {joint.name!r}.type",
            f"is {joint.type}, which is more than one axis; accepted: {', '.join(_JOINT_TYPES)}",
        )
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
            raise RobotFileError(
                model.file,
                where,
                f"is {follower.mimic.joint!r}; accepted: a moving joint between root and tip",
            )
        if leader.name in seen:
            raise RobotFileError(
                model.file, where, "leads back to itself; accepted: a driven joint"
            )
        seen.add(leader.name)
        follower = leader
    if names.index(follower.name) > names.index(joint.name):
        raise RobotFileError(
            model.file,
            where,
            f"is {follower.name!r}, which is further from the root; accepted: a joint before it",
        )
    return Dependence(terms=(Term(joint=follower.name, gain=gain),), offset=offset)


def _fold_branches(
    model: UrdfModel, links: list[str], shapes: dict[str, tuple[Shape, ...]]
) -> Iterator[str]:
    children = _children(model)
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


def _base_frame(above: Mapping[str, UrdfJoint]) -> Placement | None:
    if _BASE_NAME not in above:
        return None
    way = _way(_BASE_NAME, above)
    if any(joint.type is not UrdfType.FIXED for joint in way):
        return None
    placement = UNTURNED
    for joint in way:
        placement = compose(placement, joint.origin)
    return placement
