"""The workpiece of the example is picked, carried past a wall and placed; a moved one is missed.

What is asserted of the place and of the way is worked out from what the emulated robot did and from
the set-points that reached it, never from what was asked for, nor from the scene of the server.
"""

import csv
import json
import runpy
import sys
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from promises.promise_figures import tell
from rigs.clock.busy_machine import PATIENCE, PATIENT
from rigs.processes.promise_rig import Arrival, PromiseRig, promise_rig

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.frames.grasp import Grasp
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.grasping import gripped
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.simplemsg.pendant.management.declaration import PlacedPose
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(600)]

Array = NDArray[np.float64]

EXAMPLE = Path(__file__).parent.parent.parent / "examples" / "pick_and_place.py"
ROBOT = "kawasaki_ra10n"
ARM = Kinematics(serial_robot(ROBOT))

NEAR_ENOUGH = 1e-3
"""How far from its place the workpiece may stand [m]."""

WALL = SceneObject("wall", Box((0.06, 0.7, 0.26)), (0.0, 0.85, 0.13))
WORKPIECE = SceneObject("workpiece", Box((0.06, 0.06, 0.3)), (-0.2, 0.75, 0.15))
PLACE = (0.2, 0.75, 0.15)
"""As the text of the example has them; held against it by a test."""

TO_ABOVE, DOWN, UP, ROUND, PUT, AWAY, TO_NOTHING = range(7)
"""The motions of one run, in their order."""


@dataclass
class Demonstration:
    """What one run of the example said and did.

    Attributes:
        facts: its constants, by name.
        said: its lines.
        sent: of each motion the set-points that reached the controller, (m, 6) [rad].
        begins: when the first set-point of each motion reached the controller [ns].
        rests: where the emulated robot stood, (6,) each [rad]; before each motion and at the end.
        program: lines of the text of its program, as the server keeps it.
    """

    facts: dict[str, Any]
    said: list[str]
    sent: list[Array]
    begins: list[int]
    rests: list[Array]
    program: list[str]

    @property
    def placed(self) -> Pose:
        """Where the robot put the workpiece down: moved as the flange was since it was gripped."""
        gripped_at, put_at = (ARM.forward(self.rests[at]) for at in (DOWN + 1, PUT + 1))
        return put_at.compose(gripped_at.inverse()).compose(WORKPIECE.pose)

    def workpiece_at(self, joints: Array) -> Pose:
        """Return where the workpiece is that the robot carries."""
        gripped_at = ARM.forward(self.rests[DOWN + 1])
        return ARM.forward(joints).compose(gripped_at.inverse()).compose(WORKPIECE.pose)


class Bench:
    """Server and emulated robot, in which the example is run."""

    def __init__(self, rig: PromiseRig) -> None:
        self._rig = rig
        with SyncPendantClient.connect("127.0.0.1", rig.pendant_port) as pendant:
            pendant.wait_until(lambda state: state.motion_possible == 1, within=PATIENCE)
            # From now on the process that answers runs.
            pendant.kinematics.ik(
                {"position": (0.0, 0.75, 0.5), "orientation": (1.0, 0.0, 0.0, 0.0)}
            )

    def run(self, *arguments: str) -> Demonstration:
        """Run the example; where the robot stood is known when the emulator has ended."""
        began, said = len(self._rig.controller.arrivals), StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(said):
            patch.setattr(sys, "argv", [EXAMPLE.name, str(self._rig.pendant_port), *arguments])
            facts = runpy.run_path(str(EXAMPLE), run_name="__main__")
        motions = self._motions(began)
        sent = [np.array([joints_of(each) for each in motion]) for motion in motions]
        begins = [motion[0].time for motion in motions]
        lines = said.getvalue().splitlines()
        return Demonstration(facts, lines, sent, begins, [], self._program())

    def _motions(self, began: int) -> list[list[Arrival]]:
        motions: list[list[Arrival]] = []
        for arrival in self._rig.controller.arrivals[began:]:
            if arrival.joint_positions is None:
                continue
            if arrival.sequence == 0:
                motions.append([])
            motions[-1].append(arrival)
        return motions

    def _program(self) -> list[str]:
        with SyncPendantClient.connect("127.0.0.1", self._rig.pendant_port) as pendant:
            return list(pendant.programs.load("pick")["body"].splitlines())


def joints_of(arrival: Arrival) -> tuple[float, ...]:
    assert arrival.joint_positions is not None
    return arrival.joint_positions[: ARM.robot.dof]


def stood(executed: Path, began: int, times: list[int]) -> list[Array]:
    """Return where the emulated robot was at some times [ns], by its own log, and at its end.

    Args:
        executed: the log, with a row every few milliseconds.
        began: from when it counts [ns].
        times: rising.
    """
    with executed.open(encoding="ascii") as stream:
        rows = list(csv.DictReader(stream))
    names = [name for name in rows[0] if name.endswith(".position")]
    places = np.array([[float(row[name]) for name in names] for row in rows])
    reported = [began + round(float(row["time"]) * 1e9) for row in rows]
    last = np.searchsorted(reported, times, side="right") - 1
    return [*places[last], places[-1]]


START = "[-0.24, 0.28, -2.07, 0.0, -0.78, 0.26]"
"""Near where the example goes first, so that it takes less long [rad]."""


class Begun:
    """A bench in its processes, from their start to their end."""

    def __init__(self, folder: Path) -> None:
        self._executed = folder / "executed.csv"
        arguments = ("--record", str(self._executed), "--start", START)
        settings = tomllib.loads(PATIENT)
        self._running = ExitStack()
        self.rig = self._running.enter_context(
            promise_rig(folder, robot=ROBOT, emulator_arguments=arguments, **settings)
        )
        self._bench = Bench(self.rig)

    def end(self) -> None:
        """End the processes, unless they have ended."""
        self._running.close()

    def run(self, *arguments: str) -> Demonstration:
        """Run the example; where the robot stood is not known yet."""
        return self._bench.run(*arguments)

    def judge(self, *shown: Demonstration) -> dict[str, Any]:
        """End the processes, note where the robot stood, and return what the referee says."""
        self.end()
        begins = [begin for run in shown for begin in run.begins]
        rests = stood(self._executed, self.rig.emulator_began, begins)
        for run in shown:
            # The last rest of a run is the first of the next.
            run.rests, rests = rests[: len(run.begins) + 1], rests[len(run.begins) :]
        told: dict[str, Any] = json.loads(self.rig.referee.read_text("utf-8"))
        return told


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Begun]:
    made = Begun(tmp_path_factory.mktemp("demonstration"))
    yield made
    made.end()


@pytest.fixture(scope="module")
def ran(begun: Begun) -> Demonstration:
    """One run of the example, before it is judged."""
    return begun.run()


@pytest.fixture(scope="module")
def referee(begun: Begun, ran: Demonstration) -> dict[str, Any]:
    """What the referee of the emulated robot says of that run."""
    return begun.judge(ran)


@pytest.fixture
def shown(ran: Demonstration, referee: dict[str, Any]) -> Demonstration:
    """That run, and where the robot stood in it."""
    assert referee
    return ran


def apart_of_wall(pose: Pose) -> float:
    """Return how far the workpiece's surface is from the wall [m], at points 5 mm apart."""
    assert isinstance(WORKPIECE.shape, Box)
    assert isinstance(WALL.shape, Box)
    edges = [
        np.linspace(-size / 2, size / 2, round(size / 0.005) + 1) for size in WORKPIECE.shape.size
    ]
    grid = np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1).reshape(-1, 3)
    half = np.array(WORKPIECE.shape.size) / 2
    surface = grid[(np.abs(np.abs(grid) - half) < 1e-9).any(axis=1)]
    points = pose.position + surface @ pose.rotation.T - np.array(WALL.position)
    beyond = np.maximum(np.abs(points) - np.array(WALL.shape.size) / 2, 0.0)
    return float(np.linalg.norm(beyond, axis=1).min())


def nearest_on_the_way(run: Demonstration) -> float:
    carried = np.vstack([run.sent[motion] for motion in (UP, ROUND, PUT)])
    return min(apart_of_wall(run.workpiece_at(joints)) for joints in carried)


def least_clearance(run: Demonstration) -> float:
    """Return how near any two bodies come while the robot carries the workpiece [m]."""
    tcp = Pose.from_values((0.0, 0.0, 0.12), (0.0, 0.0, 0.0, 1.0))
    tools = FrameTree().add_tool("gripper", tcp, Grasp()).select_tool("gripper")
    scene = Scene((WALL, WORKPIECE))
    grip = gripped(ARM, tools, scene, "workpiece", run.rests[DOWN + 1].tolist())
    model = CollisionModel(ARM, grip.scene)
    carried = np.vstack([run.sent[motion] for motion in (UP, ROUND, PUT)])
    return min(float(model.clearances(joints).min()) for joints in carried)


def test_nothing_stands_there_before_it_begins(begun: Begun) -> None:
    with SyncPendantClient.connect("127.0.0.1", begun.rig.pendant_port) as pendant:
        assert pendant.scene.show()["content"]["objects"] == []
        # Nor is anything in the way of a plan.
        above: PlacedPose = {"position": (0.2, 0.75, 0.35), "orientation": (1.0, 0.0, 0.0, 0.0)}
        assert pendant.kinematics.ik(above)["solutions"]
        plan = pendant.plans.make({"kind": "position", "name": "home"})
        assert "wall" not in str(plan["clearance"])


def test_the_example_has_the_bodies_and_places_that_are_looked_at_here(
    ran: Demonstration,
) -> None:
    for body, name in ((WALL, "WALL"), (WORKPIECE, "WORKPIECE")):
        assert isinstance(body.shape, Box)
        told = ran.facts[name]
        assert told["shape"]["size"] == list(body.shape.size)
        assert tuple(told["position"]) == body.position
    assert ran.facts["THERE"] == PLACE
    assert ran.facts["ASIDE"] == 0.06


def test_the_workpiece_stands_within_1_mm_of_its_place(shown: Demonstration) -> None:
    assert np.linalg.norm(shown.placed.position - PLACE) <= NEAR_ENOUGH
    corner = np.array([0.03, 0.03, 0.15])
    turned = shown.placed.rotation @ corner - corner
    assert np.linalg.norm(turned) <= NEAR_ENOUGH


def test_the_wall_is_in_the_way(shown: Demonstration) -> None:
    begin, end = shown.sent[ROUND][0], shown.sent[ROUND][-1]
    straight = [begin + share * (end - begin) for share in np.linspace(0.0, 1.0, 200)]
    assert min(apart_of_wall(shown.workpiece_at(joints)) for joints in straight) == 0.0
    assert shown.said[0].startswith("straight on: PATH_IN_COLLISION: wall and workpiece touch")


def test_what_is_carried_passes_the_wall_without_touching_it(shown: Demonstration) -> None:
    assert nearest_on_the_way(shown) > 0.0


def test_nothing_touches_on_the_way(shown: Demonstration) -> None:
    assert least_clearance(shown) > 0.0


def test_the_referee_is_silent(shown: Demonstration, referee: dict[str, Any]) -> None:
    assert len(shown.sent) == TO_NOTHING + 1
    assert referee["violations"] == 0, referee["first"]


def test_the_moved_workpiece_is_missed_at_its_line_by_its_distance(shown: Demonstration) -> None:
    line = shown.program.index("attach workpiece") + 1
    # Moved by 60 mm, it begins 30 mm beside the grasp point.
    missed = "NOTHING_GRIPPED: gripper is 30.0 mm from workpiece; reach 10 mm"
    assert shown.said[-1] == f"run, line {line}: {missed}"
    assert np.allclose(shown.rests[-1], shown.rests[PUT + 1], atol=1e-5)


def test_so_it_is_in_the_dry_run(shown: Demonstration) -> None:
    line = shown.program.index("attach workpiece") + 1
    missed = "NOTHING_GRIPPED: gripper is 30.0 mm from workpiece; reach 10 mm"
    assert shown.said[-2] == f"dry run, line {line}: {missed}"


@pytest.mark.soak
@pytest.mark.timeout(3_600)
def test_so_it_is_on_forty_ways_past_the_wall(tmp_path: Path) -> None:
    begun = Begun(tmp_path)
    try:
        runs = [begun.run(str(seed)) for seed in range(40)]
        referee = begun.judge(*runs)
    finally:
        begun.end()
    assert referee["violations"] == 0, referee["first"]
    for run in runs:
        assert np.linalg.norm(run.placed.position - PLACE) <= NEAR_ENOUGH
        assert nearest_on_the_way(run) > 0.0
        assert least_clearance(run) > 0.0
    ways = {run.sent[ROUND].tobytes() for run in runs}
    nearest = 1e3 * min(map(nearest_on_the_way, runs))
    tell(f"carried past the wall on {len(ways)} ways, nearest {nearest:.1f} mm")
    assert len(ways) > 1
