"""Increments and undos as a pendant asks for them in tests, and a planner that refuses."""

from collections.abc import Callable

from rigs.cells.server_rig import ServerRig
from rigs.motion.jog_pad import JogPad

from openpendant.server.refusal import Refusal
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import Activity, JogSpace, JogStep, JogUndo
from openpendant.simplemsg.verdicts import VerdictCode as V

UNREACHABLE = Refusal(V.UNREACHABLE, "out of reach")


def step(pad: JogPad, *increments: float, speed: float = 1.0) -> V | None:
    values = joint_array(increments)
    pad.pendant.last_request += 1
    return pad.pendant.code(
        JogStep(pad.pendant.last_request, speed, JogSpace.JOINTS, "base", len(increments), values)
    )


def undo(pad: JogPad, speed: float = 1.0) -> V | None:
    pad.pendant.last_request += 1
    return pad.pendant.code(JogUndo(pad.pendant.last_request, speed))


def at_rest(pad: JogPad) -> tuple[float, ...]:
    """Let what is under way come to its end; return where the robot stands."""
    for _ in range(100):
        if pad.rig.activity() is Activity.IDLE:
            break
        pad.hold(100)
    assert pad.rig.activity() is Activity.IDLE
    return pad.rig.controller.position


def refused_by_the_planner(rig: ServerRig, ask: Callable[[], V | None]) -> None:
    """Have the planner find no way for what is asked; nothing moves."""
    points = len(rig.points)
    rig.plans_at_once = False
    assert ask() is None
    rig.plan(UNREACHABLE)
    rig.plans_at_once = True
    assert len(rig.points) == points
