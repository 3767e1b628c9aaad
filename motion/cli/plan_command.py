"""The command `openpendant plan`: a motion around obstacles, planned offline.

Owns arguments, the progress bar and files, nothing else. The table goes to standard
output, or one JSON line with `--json -`; progress and errors go to standard error, an error being
one line.

Exit codes: 0 done, 2 a bad argument, name or file, 3 refused: no such motion exists, or none was
found in time, 74 a file cannot be written, 130 interrupted.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.tools.console import command, run

from ..bounded_file import read_text
from ..description.robot import SerialRobot, serial_robot
from ..errors import BadArgument, MeshFileError
from .arguments import (
    FAULTS,
    Angles,
    InDegrees,
    NamedAs,
    Names,
    in_radians,
    names_of,
    parse_joints,
    parse_pose,
    tell,
    to_controller,
)

if TYPE_CHECKING:
    from ..kinematics.serial import Kinematics
    from ..planning.planner import PlanningProgress
    from ..pose import Array
    from ..scene.collision import CollisionModel
    from .plan_output import PlannedMotion

BAR_AFTER = 1.0
"""Duration of a plan after which a progress bar is shown [s]."""

MAX_GOALS = 1000
_LARGEST_PROGRAM = 1 << 20  # bytes

app = command()


def main(argv: Sequence[str]) -> int:
    """Run `openpendant plan` and return its exit code."""
    return run(app, "plan", argv, FAULTS, tell)


@app.command()
def plan(
    robot: Annotated[str, typer.Option(metavar="NAME|FILE", help="A robot's name or file.")],
    start: Annotated[
        str | None, typer.Option(help="JSON list of joint values; home if not given.")
    ] = None,
    goal: Annotated[str | None, typer.Option(help="JSON list of joint values.")] = None,
    pose: Annotated[
        str | None,
        typer.Option(help='JSON {"xyz": [m], "quat": [x, y, z, w]}, or "rpy": [r, p, y].'),
    ] = None,
    program: Annotated[
        Path | None, typer.Option(help="JSON file: a list of goals, joint lists or poses.")
    ] = None,
    scene: Annotated[Path | None, typer.Option(help="Scene file of what stands around.")] = None,
    planner: Annotated[str, typer.Option(help="Planner's name.")] = "RRTConnect",
    seed: Annotated[int, typer.Option(help="Same number, same plan.")] = 0,
    time_limit: Annotated[float, typer.Option(help="Seconds for each goal.")] = 5.0,
    speed: Annotated[float, typer.Option(help="Fraction of the velocity limits.")] = 1.0,
    angles: Annotated[
        Angles, typer.Option(help="Joint values given are as in the robot file, or controller's.")
    ] = Angles.FILE,
    degrees: InDegrees = False,
    names: NamedAs = Names.DISPLAY,
    rows: Annotated[int, typer.Option(min=2, max=100_000, help="Rows of the table.")] = 16,
    csv: Annotated[Path | None, typer.Option(help="Write every sample as CSV.")] = None,
    as_json: Annotated[
        str | None, typer.Option("--json", metavar="FILE|-", help="Write JSON; - prints it.")
    ] = None,
    ros: Annotated[Path | None, typer.Option(help="Write a ROS JointTrajectory, YAML.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write a PNG plot.")] = None,
) -> None:
    """Plan a motion that touches nothing, time it under the limits and check it."""
    from ..trajectory.trajectory_files import to_csv, to_ros_yaml
    from .plan_output import json_text, print_plan

    facts = serial_robot(robot)
    goals = _goals(goal, pose, program)
    at = facts.home_position
    if start is not None:
        given = in_radians(facts.limits, parse_joints(start, "--start"), degrees)
        at = to_controller(facts, given, angles)
    work = _Work(facts, scene, planner, seed, time_limit, speed, angles, degrees=degrees)
    with _Bar() as bar:
        planned = work.run(at, goals, bar.show)
    if as_json == "-":
        sys.stdout.write(json_text(planned))
    else:
        print_plan(planned, rows, names_of(facts, names))
        if as_json is not None:
            Path(as_json).write_text(json_text(planned), "utf-8")
    if csv is not None:
        csv.write_text(to_csv(planned.trajectory, planned.limits), "utf-8")
    if ros is not None:
        ros.write_text(to_ros_yaml(planned.trajectory, planned.limits), "utf-8")
    if plot is not None:
        from .plan_output import plot_trajectory

        title = f"{planned.robot}, {planned.planner}, {planned.trajectory.duration:.2f} s"
        plot_trajectory(planned.trajectory, planned.limits, title, plot)


def _collision(kinematics: Kinematics, scene: Path | None) -> CollisionModel:
    from ..scene.collision import CollisionModel
    from ..scene.scene_file import load_scene, unusable_mesh

    if scene is None:
        return CollisionModel(kinematics)
    around = load_scene(scene, kinematics.robot.links)
    try:
        return CollisionModel(kinematics, around)
    except MeshFileError as error:
        raise unusable_mesh(scene, around, error) from None


class _Work:
    """Run of the command: the meaning of the options, in order."""

    def __init__(
        self,
        facts: SerialRobot,
        scene: Path | None,
        planner: str,
        seed: int,
        time_limit: float,
        speed: float,
        angles: Angles,
        *,
        degrees: bool,
    ) -> None:
        from ..kinematics.serial import Kinematics

        self._facts = facts
        self._collision = _collision(Kinematics(facts), scene)
        self._planner, self._seed, self._time_limit = planner, seed, time_limit
        self._speed, self._angles, self._degrees = speed, angles, degrees

    def run(
        self,
        start: Sequence[float],
        goals: Sequence[str],
        show: Callable[[int, int, PlanningProgress], None],
    ) -> PlannedMotion:
        """Plan through all goals, with a stop at each."""
        from ..planning.planner import plan_free_path
        from ..timing.parameterization import time_legs
        from ..trajectory.certificate import certify
        from .plan_output import PlannedMotion

        began = time.perf_counter()
        kinematics = self._collision.kinematics
        legs, reached = [], []
        at: Sequence[float] | Array = start
        for number, text in enumerate(goals):
            goal = self._joint_position(text, at, self._collision)
            legs.append(
                plan_free_path(
                    kinematics,
                    self._collision,
                    at,
                    goal,
                    planner=self._planner,
                    seed=self._seed,
                    time_limit=self._time_limit,
                    on_progress=partial(show, number, len(goals)),
                    clock=time.perf_counter,
                )
            )
            reached.append(tuple(float(value) for value in goal))
            at = legs[-1].goal
        trajectory = time_legs(legs, kinematics.limits, speed=self._speed)
        return PlannedMotion(
            robot=self._facts.name,
            planner=self._planner,
            seed=self._seed,
            plan_seconds=time.perf_counter() - began,
            goals=tuple(reached),
            trajectory=trajectory,
            certificate=certify(trajectory, kinematics.limits, start=start),
            limits=kinematics.limits,
        )

    def _joint_position(
        self, text: str, near: Sequence[float] | Array, collision: CollisionModel
    ) -> Sequence[float] | Array:
        if text.lstrip().startswith("["):
            given = in_radians(self._facts.limits, parse_joints(text, "goal"), self._degrees)
            return to_controller(self._facts, given, self._angles)
        if not text.lstrip().startswith("{"):
            accepted = "a JSON list of joint values, or a pose as an object of xyz and quat or rpy"
            raise BadArgument("goal", text, accepted)
        from ..planning.planner import free_joint_position
        from ..pose import Pose

        xyz, quaternion, frame = parse_pose(text, "pose", degrees=self._degrees)
        return free_joint_position(
            collision,
            Pose.from_values(xyz, quaternion),
            near,
            frame=frame or "base",
            random_seed=self._seed,
        )


class _Bar:
    """Progress bar on standard error, shown after `BAR_AFTER`."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, goal: int, goals: int, progress: PlanningProgress) -> None:
        """Show the progress of the plan: the bar fills by goals, and within one by its time."""
        if self._bar is None:
            if time.perf_counter() - self._began < BAR_AFTER:
                return
            from rich.console import Console
            from rich.progress import Progress as RichProgress

            self._bar = RichProgress(console=Console(stderr=True), transient=True)
            self._task = self._bar.add_task("planning", total=float(goals))
            self._bar.start()
        share = min((progress.seconds or 0.0) / progress.time_limit, 1.0)
        text = f"goal {goal + 1} of {goals}: {progress.stage}, {progress.iterations} iterations"
        self._bar.update(self._task, completed=goal + share, description=text)


def _goals(goal: str | None, pose: str | None, program: Path | None) -> list[str]:
    """Return the goals as JSON texts."""
    given = [each for each in (goal, pose, program) if each is not None]
    if len(given) != 1:
        raise BadArgument("goals", len(given), "one of --goal, --pose and --program")
    if program is None:
        return [str(given[0])]
    accepted = f"a JSON file with a list of 1 to {MAX_GOALS} goals"

    def refusal(file: str, _field: str, problem: str) -> BadArgument:
        return BadArgument("--program", f"{file}: {problem}", accepted)

    text = read_text(program, _LARGEST_PROGRAM, refusal)
    try:
        content = json.loads(text, parse_int=float)
    except (ValueError, RecursionError) as error:
        raise BadArgument("--program", f"{program}: {error}", accepted) from None
    if not isinstance(content, list) or not 1 <= len(content) <= MAX_GOALS:
        raise BadArgument("--program", str(program), accepted)
    return [json.dumps(each) for each in content]
