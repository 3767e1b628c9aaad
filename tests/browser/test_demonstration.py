"""The demonstration from the page: a workpiece is picked, carried past a wall and placed.

Each motion begins with what a person presses at the page. What is asserted of the place and of the
way is worked out from what the emulated robot did and from the set-points that reached it.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from examples.test_pick_and_place import (
    ARM,
    NEAR_ENOUGH,
    PLACE,
    START,
    WALL,
    WORKPIECE,
    apart_of_wall,
    stood,
)
from numpy.typing import NDArray

from browser.demonstrator import Demonstrator, Place
from browser.page_rig import PageRig
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Box
from openpendant.simplemsg.pendant.management.declaration import PlacedPose
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(300)]

Array = NDArray[np.float64]

TOOL_LENGTH, GRASP, LIFT = 0.12, 0.14, 0.06
"""Of the gripper; above the workpiece's centre; above where it is grasped [m]."""


@dataclass
class Shown:
    """What one demonstration did.

    Attributes:
        straight_on: what the page said of the way through the wall.
        around: what it said of the way round it.
        carried: set-points while the robot held the workpiece, (m, dof) [rad].
        gripped_at, put_at: when the robot stood there [ns]; its joints, (dof,) [rad].
        referee: what the emulator's referee found.
    """

    straight_on: str = ""
    around: str = ""
    carried: list[Array] = field(default_factory=list)
    gripped_at: int = 0
    put_at: int = 0
    gripped: Array = field(default_factory=lambda: np.zeros(ARM.robot.dof))
    put: Array = field(default_factory=lambda: np.zeros(ARM.robot.dof))
    referee: dict[str, Any] = field(default_factory=dict)

    def workpiece_at(self, joints: Array) -> Pose:
        """Return where the workpiece is that the robot carries."""
        since_gripped = ARM.forward(joints).compose(ARM.forward(self.gripped).inverse())
        return since_gripped.compose(WORKPIECE.pose)


def _grasping(centre: Place, lift: float = 0.0) -> Place:
    x, y, z = centre
    return x, y, z + GRASP + lift


def _demonstrate(person: Demonstrator, rig: PageRig) -> Shown:
    shown, here = Shown(), WORKPIECE.position
    person.mode("Automatic")
    for each in (WALL, WORKPIECE):
        assert isinstance(each.shape, Box)
        person.put(each.name, each.position, each.shape.size)
    person.go("ptp", _grasping(here, LIFT))
    person.new_program("pick")
    person.save_point()
    # Near the workpiece by hand: slowly in T1, with the enabling device held.
    person.mode("T1")
    person.page.key(True, "KeyV", "v")
    person.go("lin", _grasping(here))
    person.page.let_all_go()
    person.save_point()
    person.mode("Automatic")
    person.go("lin", _grasping(here, LIFT))
    person.task("teach")
    person.write("text.replace('move PTP P2', 'move LIN P2') + 'attach workpiece\\nmove LIN P1\\n'")
    person.break_before("workpiece")
    person.run_to_breakpoint()
    shown.gripped_at = _standing(rig)
    person.resume()
    shown.straight_on = person.plan("ptp", _grasping(PLACE, LIFT))
    shown.around = person.plan("free", _grasping(PLACE, LIFT), seed=1)
    person.execute()
    person.go("lin", _grasping(PLACE))
    shown.put_at = _standing(rig)
    begin, end = (1e-9 * each for each in (shown.gripped_at, shown.put_at))
    carried = (each.joints for each in rig.tap.seen() if begin < each.at < end and each.joints)
    shown.carried = [np.array(each[: ARM.robot.dof]) for each in carried]
    person.leave("workpiece")
    person.go("lin", _grasping(PLACE, LIFT))
    return shown


def _standing(rig: PageRig) -> int:
    """Return a moment at which the robot has stood for a while."""
    rig.tap.wait_for_rest()
    time.sleep(0.3)
    return time.monotonic_ns()


@pytest.fixture(scope="module")
def cell(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[PageRig, Path]]:
    """A cell whose robot has a gripper, near where the demonstration begins."""
    folder = tmp_path_factory.mktemp("demonstration")
    kept = ("--record", folder / "executed.csv", "--report", folder / "referee.json")
    with PageRig(folder, driver, emulate=(*kept, "--start", START)) as rig:
        # The page has no place to make tools: that is the integrator's, and done before.
        with SyncPendantClient.connect(port=rig.server) as integrator, integrator.control():
            revision = integrator.frames.show()["tools_revision"]
            gripper: PlacedPose = {"position": (0.0, 0.0, TOOL_LENGTH)}
            added = integrator.tools.add("gripper", gripper, revision)
            integrator.tools.select("gripper", added["revision"])
        yield rig, folder


@pytest.fixture(scope="module")
def shown(cell: tuple[PageRig, Path]) -> Shown:
    rig, folder = cell
    page = rig.page()
    page.ready()
    shown = _demonstrate(Demonstrator(page), rig)
    rig.end_emulator()
    began, times = rig.emulator_began, [shown.gripped_at, shown.put_at]
    shown.gripped, shown.put, _ = stood(folder / "executed.csv", began, times)
    shown.referee = json.loads((folder / "referee.json").read_text("utf-8"))
    return shown


def test_the_workpiece_stands_within_1_mm_of_its_place(shown: Shown) -> None:
    placed = shown.workpiece_at(shown.put)
    assert np.linalg.norm(placed.position - PLACE) <= NEAR_ENOUGH
    corner = np.array([0.03, 0.03, 0.15])
    assert np.linalg.norm(placed.rotation @ corner - corner) <= NEAR_ENOUGH


def test_the_wall_is_in_the_way_and_the_page_says_so(shown: Shown) -> None:
    assert "cannot run: PATH_IN_COLLISION: wall and workpiece touch" in shown.straight_on
    assert "This plan can run" in shown.around


def test_what_is_carried_passes_the_wall_without_touching_it(shown: Shown) -> None:
    assert len(shown.carried) > 100
    assert min(apart_of_wall(shown.workpiece_at(each)) for each in shown.carried) > 0.0


def test_the_referee_is_silent(shown: Shown) -> None:
    assert shown.referee["violations"] == 0, shown.referee["first"]
