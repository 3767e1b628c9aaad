"""What breaks each condition of a motion, for tests of `why`."""

from rigs.cells.server_rig import ServerRig
from rigs.motion.jog_pad import JogPad

from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import OperatingMode


def lose_the_link(rig: ServerRig, pad: JogPad) -> None:
    rig.path(ControllerPath.MOTION, False)


def lose_the_reports(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.reports = False
    rig.wait(200)


def give_the_authority_back(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.release()


def stand_outside(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.position = (2.1, 0.0)
    rig.wait(20)


def turn_to_automatic(rig: ServerRig, pad: JogPad) -> None:
    pad.mode(OperatingMode.AUTOMATIC)


def turn_to_recovery(rig: ServerRig, pad: JogPad) -> None:
    pad.mode(OperatingMode.RECOVERY)


def stop(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.stop("tea")


def stop_the_controller(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.e_stopped = True
    rig.wait(20)


def turn_to_manual(rig: ServerRig, pad: JogPad) -> None:
    pad.mode(OperatingMode.MANUAL_REDUCED)


def lower_the_override(rig: ServerRig, pad: JogPad) -> None:
    pad.speed(0.0)
