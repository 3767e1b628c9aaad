"""Our pendant server, judged as a client of a controller, on the virtual clock."""

import tomllib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from rigs.processes.bare_app import bare_app
from rigs.processes.judged_server import HALF_RATE, LoopPlanner

from openpendant.motion.description.robot import serial_robot
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.cell_shell import CellParts
from openpendant.tools.packets.conformance.check import CheckFinding, CheckVerdict
from openpendant.tools.packets.conformance.client.controller import ScriptedController
from openpendant.tools.packets.conformance.client.judge import results_of
from openpendant.tools.packets.conformance.client.live import LiveController
from openpendant.tools.packets.conformance.client.role import judge_live
from openpendant.tools.packets.conformance.client.setup import (
    SCENARIOS,
    Mutation,
    Purpose,
    Scenario,
    Setup,
)
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused

ROBOT = serial_robot("ur5")
SETUP = Setup(dof=6, limits=ROBOT.limits)
STANDARD = [scenario for scenario in SCENARIOS if not scenario.is_motoman]


@asynccontextmanager
async def our_server(live: LiveController, **controller: object) -> AsyncIterator[PendantClient]:
    settings = make_settings(
        {
            "tick_rate": HALF_RATE,
            "listen": {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0},
            "controller": {
                "motion_port": live.ports[Purpose.MOTION],
                "state_port": live.ports[Purpose.STATE],
                "state_period": 0.025,
                **controller,
            },
        },
        "test",
    )
    async with bare_app([CellParts(settings, ROBOT, LoopPlanner())]).running() as ports:
        pendant = await PendantClient.connect("127.0.0.1", ports.pendant, state_rate=50)
        async with pendant:
            yield pendant


class Mover:
    """Has the robot moved to and fro, whatever became of it last time."""

    def __init__(self, pendant: PendantClient) -> None:
        self.pendant = pendant
        self.fates: list[str] = []

    async def __call__(self, scenario: Scenario) -> None:
        state = self.pendant.state
        here = state.positions[0] if state is not None else ROBOT.home_position[0]
        # Whichever end is farther off: a motion must be long enough to have something happen to it.
        offset = max(0.1, 0.5, key=lambda value: abs(ROBOT.home_position[0] + value - here))
        goal = [value + offset for value in ROBOT.home_position]
        try:
            await self.pendant.take_control()
            handle = await self.pendant.move_joints(goal, speed=0.5)
            await handle.done()
        except (Refused, Aborted) as error:
            self.fates.append(type(error).__name__)
        else:
            self.fates.append("done")


async def judged(
    scenarios: list[Scenario], **controller: object
) -> dict[str, dict[str, CheckFinding]]:
    core = ScriptedController(SETUP, ROBOT.home_position, at_point=10, now=LiveController.now())
    live = LiveController(core, "127.0.0.1", {Purpose.MOTION: 0, Purpose.STATE: 0})
    async with live.listening(), our_server(live, **controller) as pendant:
        found = await judge_live(live, SETUP, scenarios, Mover(pendant), wait=10)
    return {name: dict(findings) for name, findings in found.items()}


def complaints(found: dict[str, dict[str, CheckFinding]]) -> list[str]:
    return [
        f"{name} {number} {finding.verdict.value}: {finding.habit} {finding.detail}"
        for name, findings in found.items()
        for number, finding in findings.items()
        if finding.verdict in (CheckVerdict.FAILED, CheckVerdict.DEVIATES)
    ]


FINDINGS = tomllib.loads((Path(__file__).parent / "client_findings.toml").read_text("utf-8"))
LOOKED_AT = {Mutation[name]: set(numbers) for name, numbers in FINDINGS["own_server"].items()}
"""What each scenario must give the judge to look at."""


def test_every_scenario_says_what_it_is_for() -> None:
    assert set(LOOKED_AT) == {scenario.mutation for scenario in STANDARD}


@pytest.mark.virtual_clock
@pytest.mark.parametrize("points", ["full", "simple"])
@pytest.mark.parametrize("scenario", STANDARD, ids=lambda scenario: scenario.name)
async def test_our_server_is_a_good_client_whatever_the_controller_does(
    scenario: Scenario, points: str
) -> None:
    found = await judged([scenario], points=points)
    assert complaints(found) == []
    passed = {n for n, item in found[scenario.name].items() if item.verdict is CheckVerdict.PASSED}
    of_form = {"LC03", "LC04"} if points == "simple" else set()
    assert LOOKED_AT[scenario.mutation] - of_form <= passed


@pytest.mark.conformance
@pytest.mark.virtual_clock
async def test_one_session_of_all_scenarios_ends_with_a_robot_that_still_moves() -> None:
    found = await judged(STANDARD)
    assert complaints(found) == []
    results = results_of(found)
    verdicts = [result.finding.verdict for result in results]
    assert verdicts.count(CheckVerdict.PASSED) >= 40
    # Whatever happened before, the server was ready for the next trajectory.
    for name, findings in found.items():
        moved = name == Scenario(Mutation.NOT_POSSIBLE).name
        assert findings["MC04"].verdict is (
            CheckVerdict.NOT_APPLICABLE if moved else CheckVerdict.PASSED
        )
