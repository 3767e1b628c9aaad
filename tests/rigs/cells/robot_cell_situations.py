"""Situations of a server whose pendant asks for motion, and what its tests ask of it."""

from rigs.cells.server_rig import ServerRig, ready
from rigs.motion.jog_pad import JogPad
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg.pendant import Activity, AuthorityBeat
from openpendant.simplemsg.verdicts import VerdictCode as V

GOAL = (1.0, 0.5)


def codes(pendant: Pendant) -> list[V]:
    return [code for _, code in pendant.outcomes()]


def in_control(*, plans_at_once: bool = True, **settings: object) -> tuple[ServerRig, Pendant]:
    """Return a rig that is ready, and a pendant that has the authority."""
    rig = ready(plans_at_once=plans_at_once, **settings)
    return rig, rig.holder()


def at_a_pad(*, plans_at_once: bool = True, **settings: object) -> tuple[ServerRig, JogPad]:
    """Return a rig that is ready, and the hands of who has the authority."""
    rig = ready(plans_at_once=plans_at_once, **settings)
    return rig, JogPad(rig)


def enabled(
    mode: str = "manual_reduced", *, plans_at_once: bool = True, **settings: object
) -> tuple[ServerRig, JogPad]:
    """Return a rig in a manual mode, and hands that squeeze the enabling device."""
    rig, pad = at_a_pad(plans_at_once=plans_at_once, modes={"initial": mode}, **settings)
    pad.squeeze()
    return rig, pad


def moving(milliseconds: int = 300) -> tuple[ServerRig, Pendant]:
    """Return a rig in the middle of a motion, and who asked for it."""
    rig, pendant = in_control()
    assert pendant.move(*GOAL) is V.ACCEPTED
    rig.wait(milliseconds)
    assert rig.activity() is Activity.MOVING
    return rig, pendant


def planning() -> tuple[ServerRig, Pendant]:
    """Return a rig that plans a motion until told otherwise, and who asked for it."""
    rig, pendant = in_control(plans_at_once=False)
    pendant.path((0.1, 0.1), GOAL)
    return rig, pendant


def keep_beating(rig: ServerRig, pendant: Pendant, milliseconds: int) -> None:
    for _ in range(0, milliseconds, 500):
        pendant.send(AuthorityBeat())
        rig.wait(min(500, milliseconds))


def stale(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.reports = False
    rig.wait(110)


def emergency_stop(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.e_stopped = True
    rig.wait(10)


def error(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.error_code = 7
    rig.wait(10)


def no_power(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.powered = False
    rig.wait(10)


def in_idle(rig: ServerRig, pendant: Pendant) -> None:
    return


def in_planning(rig: ServerRig, pendant: Pendant) -> None:
    rig.plans_at_once = False
    pendant.path((0.1, 0.1), GOAL)


def in_motion(rig: ServerRig, pendant: Pendant) -> None:
    pendant.move(*GOAL)
    rig.wait(300)


def in_settling(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.coasts = True
    pendant.move(0.1, 0.0)
    rig.wait(200)
    rig.controller.reports = False
    rig.wait(160)


def in_stopping(rig: ServerRig, pendant: Pendant) -> None:
    in_motion(rig, pendant)
    rig.controller.coasts = True
    pendant.release()
    pendant.take()
