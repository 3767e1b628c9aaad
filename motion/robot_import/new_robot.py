"""New robot from an imported chain, in the first paper's four steps of configuration.

Owns the content and the order of the steps: 1 the model, 2 limits, home and collision pairs for
planning, 3 the controller's view of the joints, 4 the names on the pendant. Each fact goes through
`Decisions`, so that nothing is assumed without a report. Returns data; asks and prints nothing
itself.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..description.robot import SerialRobot, robot_from_content
from ..description.schema import (
    SCHEMA,
    CouplingType,
    DhTable,
    JointType,
    Placement,
    default_display_names,
)
from ..errors import BadArgument
from .decisions import Decisions, ImportStep, MissingFact, on_screen
from .dh_derivation import derive_table, table_residual
from .imported_chain import UNTURNED, ImportedChain
from .planning_step import allowed_pairs, checked_home, home, limits

DH_TOLERANCE = 1e-9
"""Greatest difference of a table from the chain to be part of a robot file [m, rad]."""

_NAME_LENGTH = 64
_ORDER = (
    *("schema", "name", "kind", "manufacturer", "model", "dof"),
    *("root_link", "base_frame", "tool_link", "tool_convention", "zero_pose", "home", "coupling"),
    *("acceleration_ramp_s", "joints", "link_mass_kg", "dh"),
    *("collision", "collision_source", "meshes", "allowed_collisions", "sources", "notes"),
)
_COUPLING_AXES = 3


@dataclass(frozen=True, slots=True)
class Wishes:
    """Decisions of the caller beforehand; None leaves one to the description or the defaults.

    Attributes:
        home: chain-side position of the driven joints [rad or m].
        coupling: the factor that ties joint 3 to joint 2, as in the schema: -1, 0 or 1.
    """

    name: str | None = None
    home: tuple[float, ...] | None = None
    coupling: int | None = None
    manufacturer: str | None = None
    model: str | None = None


def configure(
    chain: ImportedChain, wishes: Wishes, decisions: Decisions, meshes: Path | None = None
) -> dict[str, Any]:
    """Return the mapping of a robot file, or raise `RobotFileError` with what is missing.

    Args:
        meshes: the folder where the meshes of the chain are put aside, and their hulls.
    """
    content: dict[str, Any] = {"schema": SCHEMA, **_model(chain, wishes, decisions)}
    content |= limits(chain, decisions)
    content |= home(chain, wishes.home, wishes.coupling or 0, content, decisions)
    stated_home = wishes.home is not None or chain.home is not None
    content |= allowed_pairs(_provisional(chain, wishes, content, meshes), stated_home, decisions)
    content |= checked_home(_provisional(chain, wishes, content, meshes), stated_home, decisions)
    content |= _controller(chain, wishes, decisions)
    content |= _pendant(chain, wishes, decisions, content)
    decisions.finish()
    content["notes"] = [*chain.remarks, *decisions.assumptions]
    robot_from_content(content, chain.file, meshes)
    return dict(sorted(content.items(), key=lambda item: _ORDER.index(item[0])))


def _provisional(
    chain: ImportedChain, wishes: Wishes, content: Mapping[str, Any], meshes: Path | None
) -> SerialRobot:
    # Contacts do not depend on the base frame, and on joint 3's coupling only by the values that
    # are sampled, so planning need not wait for step 3.
    factor = wishes.coupling or 0
    base = {"parent": chain.root, **UNTURNED.model_dump(mode="json")}
    facts = {**content, **_coupling(factor), "base_frame": base}
    robot = robot_from_content(facts, chain.file, meshes)
    assert isinstance(robot, SerialRobot)
    return robot


def robot_name(text: str) -> str:
    """Return a description's name as a robot's: lower-case letters, digits and underscores."""
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")[:_NAME_LENGTH]


def _model(chain: ImportedChain, wishes: Wishes, decisions: Decisions) -> dict[str, Any]:
    step = ImportStep.MODEL
    name = wishes.name or robot_name(chain.name)
    if not name:
        name = decisions.decide(
            MissingFact(step, "name", "a name for the robot", "the description has none"),
            "imported_robot",
            str,
            str,
        )
    decisions.done(
        step,
        "chain",
        f"{chain.source}, {len(chain.links)} links from {chain.root} to {chain.tip},"
        f" {len(chain.driven)} driven joints",
    )
    for remark in chain.remarks:
        decisions.done(step, "remark", remark)
    bare = chain.unchecked
    decisions.done(
        step,
        "collision shapes",
        f"{len(chain.collision)} of {len(chain.links)} links have some"
        + (f"; never checked: {', '.join(bare)}" if bare else ""),
    )
    dh = _dh(chain, decisions)
    return {
        "name": name,
        "kind": "serial",
        "dof": len(chain.driven),
        "root_link": chain.root,
        "tool_link": chain.tip,
        "link_mass_kg": {link: chain.masses.get(link) for link in chain.links},
        **({} if dh is None else {"dh": dh.model_dump(mode="json")}),
        "collision": {
            link: [shape.model_dump(mode="json") for shape in shapes]
            for link, shapes in chain.collision.items()
        },
        "collision_source": f"bounding shapes of the {chain.source}" if chain.collision else "",
        **(
            {"meshes": [mesh.model_dump(mode="json") for mesh in chain.meshes]}
            if chain.meshes
            else {}
        ),
        "sources": [f"{chain.source} {chain.file}"],
    }


def _dh(chain: ImportedChain, decisions: Decisions) -> DhTable | None:
    if chain.dh is not None:
        table, residual = chain.dh, max(table_residual(chain.joints, chain.dh))
    else:
        derived = derive_table(chain.joints)
        if derived is None:
            decisions.done(
                ImportStep.MODEL, "dh", "not expressible as standard DH: nearly parallel axes"
            )
            return None
        table, residual = derived.table, derived.residual
    if residual > DH_TOLERANCE:
        decisions.done(
            ImportStep.MODEL,
            "dh",
            f"not expressible as standard DH: the nearest table differs by {residual:.1e} m or rad",
        )
        return None
    decisions.done(ImportStep.MODEL, "dh", f"standard table, residual {residual:.1e} m and rad")
    return table


def _controller(chain: ImportedChain, wishes: Wishes, decisions: Decisions) -> dict[str, Any]:
    step = ImportStep.CONTROLLER
    names = ", ".join(joint.name for joint in chain.driven)
    decisions.done(step, "joint order", f"root to tip: {names}")
    decisions.done(step, "tool", chain.tip)
    base = chain.base_frame
    if base is None:
        base = UNTURNED
        decisions.assumed(step, "base frame", f"that of {chain.root}; the description has none")
    else:
        decisions.done(step, "base frame", _placement_in_words(base, chain.root))
    factor = wishes.coupling
    coupled = len(chain.driven) >= _COUPLING_AXES and all(
        joint.type is JointType.REVOLUTE for joint in chain.driven[1:_COUPLING_AXES]
    )
    if factor is not None:
        decisions.done(step, "coupling", _coupling_in_words(factor))
    elif coupled:
        factor = decisions.decide(
            MissingFact(
                step,
                "coupling",
                "factor of joint 2 in joint 3 (0 none, 1 as FANUC, -1 as ABB's parallel rod)",
                "no description of this kind states it",
            ),
            0,
            _coupling_in_words,
            _factor,
        )
    return {
        "base_frame": {"parent": chain.root, **base.model_dump(mode="json")},
        **_coupling(factor or 0),
        "tool_convention": f"{chain.tip} as in the {chain.source}",
        "zero_pose": f"all joints zero in the {chain.source}",
    }


def _placement_in_words(placement: Placement, parent: str) -> str:
    xyz = ", ".join(on_screen(value, "m") for value in placement.xyz)
    rpy = ", ".join(on_screen(value, "rad") for value in placement.rpy)
    return f"at {xyz}, turned {rpy} in {parent}"


def _coupling(factor: int) -> dict[str, Any]:
    kind = CouplingType.J2_J3 if factor else CouplingType.NONE
    return {"coupling": {"type": kind.value, "state_factor": factor}}


def _coupling_in_words(factor: int) -> str:
    return (
        "none" if factor == 0 else f"joint 3 of the chain = the controller's {factor:+d} · joint 2"
    )


def _factor(text: str) -> int:
    if text not in ("-1", "0", "1", "+1"):
        raise BadArgument("coupling", text, "-1, 0 or 1")
    return int(text)


def _pendant(
    chain: ImportedChain, wishes: Wishes, decisions: Decisions, content: Mapping[str, Any]
) -> dict[str, Any]:
    step = ImportStep.PENDANT
    names = chain.display_names
    if names is None:
        names = decisions.decide(
            MissingFact(
                step,
                "display names",
                f"{len(chain.driven)} names, separated by commas",
                "six turning axes: those of the first paper; else the joint's own name",
            ),
            default_display_names(
                [joint.name for joint in chain.driven],
                [joint.type is JointType.PRISMATIC for joint in chain.driven],
            ),
            ", ".join,
            lambda text: _names(text, len(chain.driven)),
        )
    else:
        decisions.done(step, "display names", ", ".join(names))
    shown = dict(zip((joint.name for joint in chain.driven), names, strict=True))
    for joint in content["joints"]:
        if joint["name"] in shown:
            joint["display_name"] = shown[joint["name"]]
    decisions.done(step, "units", "degrees and millimetres on screens, radians and metres in files")
    return {"manufacturer": wishes.manufacturer or "", "model": wishes.model or chain.name}


def _names(text: str, count: int) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if len(names) != count or not all(1 <= len(name) <= _NAME_LENGTH for name in names):
        raise BadArgument("display names", text, f"{count} names, separated by commas")
    return names
