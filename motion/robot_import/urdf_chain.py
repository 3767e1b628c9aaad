"""The one chain of a URDF from its root to a tip, as a robot file can hold it.

Owns what becomes of the branches that are left (rigid ones give their shapes to the chain, moving
ones are left out), and how mimic joints become dependent ones. What tree the links form, and which
tip is meant, is `urdf_tree`'s.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import RobotFileError
from ..robot_schema import Dependence, JointType, Placement, Shape, Term
from .imported_chain import UNTURNED, ImportedChain, ImportedJoint
from .placements import compose
from .urdf import UrdfJoint, UrdfModel, UrdfType
from .urdf_tree import LinkTree

_SHOWN = 8  # names in a message
_BASE_NAME = "base"  # ROS-Industrial's name for the controller's own base frame
_JOINT_TYPES = {
    UrdfType.REVOLUTE: JointType.REVOLUTE,
    UrdfType.CONTINUOUS: JointType.REVOLUTE,
    UrdfType.PRISMATIC: JointType.PRISMATIC,
    UrdfType.FIXED: JointType.FIXED,
}


def chain_to(model: UrdfModel, tip: str) -> ImportedChain:
    """Take the chain from the root to a tip out of a URDF.

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
        raise RobotFileError(
            model.file, f"link {tip!r}", "has no motor between itself and the root"
        )
    links = [tree.root, *(joint.child for joint in way)]
    shapes: dict[str, tuple[Shape, ...]] = {link: model.links[link].shapes for link in links}
    remarks = [remark for link in links for remark in model.links[link].remarks]
    remarks += _fold_branches(model, tree, links, shapes)
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
    )


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
    model: UrdfModel, tree: LinkTree, links: list[str], shapes: dict[str, tuple[Shape, ...]]
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
