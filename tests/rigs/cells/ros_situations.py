"""Situations of a server whose ROS-I client asks for motion, and what its tests ask of it."""

from rigs.cells.server_rig import ServerRig, jobs_in, ready
from rigs.peers.server_clients import RosClient

from openpendant.server.events.events import Port
from openpendant.server.planning.jobs import RosPathJob
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import CommType, ControllerMode, Status
from openpendant.simplemsg.pendant import Activity

PATH = ((0.0, 0.0), (0.5, 0.1), (1.0, 0.2))
TOPIC = CommType.TOPIC


def jobs(rig: ServerRig) -> list[RosPathJob]:
    return [job for job in jobs_in(item for _, item in rig.log) if isinstance(job, RosPathJob)]


def idle(*, plans_at_once: bool = True, **settings: object) -> tuple[ServerRig, RosClient]:
    rig = ready(plans_at_once=plans_at_once, **settings)
    return rig, rig.ros()


def moving() -> tuple[ServerRig, RosClient]:
    rig, client = idle()
    client.trajectory(*PATH)
    rig.wait(400)
    assert rig.activity() is Activity.MOVING
    return rig, client


def status_of(rig: ServerRig) -> Status:
    (reply,) = rig.ros(port=Port.ROS_STATE).send(Status(0, 0, 0, 0, 0, 0, 0, comm_type=2))
    assert isinstance(reply, Status)
    return reply


def manual(rig: ServerRig) -> None:
    rig.controller.mode = ControllerMode.MANUAL
    rig.wait(10)


def unknown_mode(rig: ServerRig) -> None:
    rig.controller.mode = ControllerMode.UNKNOWN
    rig.wait(10)


def latched(rig: ServerRig) -> None:
    rig.pendant().stop()


def down(rig: ServerRig) -> None:
    rig.path(ControllerPath.MOTION, False)


def e_stopped(rig: ServerRig) -> None:
    rig.controller.e_stopped = True
    rig.wait(10)


def collecting() -> tuple[ServerRig, RosClient]:
    rig, client = idle()
    client.trajectory(*PATH)
    return rig, client


def left() -> ServerRig:
    """Return a rig whose client sent two of three points, and is gone."""
    rig, client = idle()
    client.trajectory(*PATH[:2])
    client.close()
    return rig


def planning() -> tuple[ServerRig, RosClient]:
    rig, client = idle(plans_at_once=False)
    client.trajectory(*PATH)
    rig.wait(160)
    assert rig.activity() is Activity.PLANNING
    return rig, client


def superseding() -> tuple[ServerRig, RosClient]:
    rig, client = moving()
    rig.controller.coasts = True
    client.trajectory((0.0, 0.0), (0.1, 0.1))
    rig.wait(160)
    assert rig.activity() is Activity.STOPPING
    return rig, client
