"""The client role as a command, on recordings and live; our own pendant server as its client."""

import argparse
import asyncio
import json
import re
import tomllib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rigs.processes.judged_server import HALF_RATE, served_cell

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg import DIALECTS, JointTrajPt, codec_for, joint_array
from openpendant.tools.console import ExitCode
from openpendant.tools.packets.conformance.check import (
    CheckFinding,
    CheckVerdict,
    Judgement,
    Result,
)
from openpendant.tools.packets.conformance.cli import main
from openpendant.tools.packets.conformance.client import controller as scripted
from openpendant.tools.packets.conformance.client import role as client_role
from openpendant.tools.packets.conformance.client.controller import (
    MAX_ENTRIES,
    Act,
    ClientLinkId,
    Do,
    ScriptedController,
)
from openpendant.tools.packets.conformance.client.judge import CHECKS, judge_scenario, results_of
from openpendant.tools.packets.conformance.client.live import LiveController
from openpendant.tools.packets.conformance.client.role import judge_live
from openpendant.tools.packets.conformance.client.setup import (
    SCENARIOS,
    Mutation,
    Purpose,
    Scenario,
    Setup,
)
from openpendant.tools.packets.console import PacketToolError, PeerError
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused

VECTORS = Path(__file__).parents[2] / "vectors"
GENERIC = str(VECTORS / "capture-industrial-robot-client.json")
DRIVER = str(VECTORS / "capture-motoman-driver.json")


def options(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    client_role.add_arguments(parser)
    return parser.parse_args(arguments)


async def judged(*arguments: str) -> Judgement:
    return await client_role.judge_client(options(*arguments))


def number_of(judgement: Judgement, number: str) -> Result:
    return next(result for result in judgement.results if result.check.number == number)


async def test_a_recording_gives_one_result_for_each_check() -> None:
    judgement = await judged("--capture", GENERIC, "--joints", "6")
    assert tuple(result.check for result in judgement.results) == CHECKS
    assert judgement.role == "client"
    assert judgement.count(CheckVerdict.FAILED) == 0
    assert judgement.count(CheckVerdict.DEVIATES) == 10
    detail = number_of(judgement, "MC17").finding.detail
    assert detail.startswith("[stream_failure_reply] at 1.024 s on port 11000, connection 1: ")


async def test_a_motoman_recording_needs_its_dialect() -> None:
    judgement = await judged("--capture", DRIVER, "--dialect", "motoman")
    assert judgement.count(CheckVerdict.FAILED) == 0
    assert number_of(judgement, "YC03").finding.verdict is CheckVerdict.PASSED
    other = await judged("--capture", DRIVER)
    assert number_of(other, "YC03").finding.verdict is CheckVerdict.NOT_APPLICABLE
    assert other.count(CheckVerdict.FAILED) > 0


async def test_limits_of_a_robot_are_looked_at() -> None:
    judgement = await judged("--capture", GENERIC, "--robot", "ur5")
    for number in ("LC02", "LC05", "MC07"):
        assert number_of(judgement, number).finding.verdict is CheckVerdict.PASSED


def test_the_command_prints_a_report_and_writes_junit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "report.xml"
    arguments = ["--role", "client", "--capture", GENERIC, "--json", "--junit", str(file)]
    assert main(arguments) == ExitCode.OK
    counts = json.loads(capsys.readouterr().out)["counts"]
    suite = ElementTree.parse(file).getroot()[0]
    assert int(suite.attrib["failures"]) == counts["failed"] == 0
    assert int(suite.attrib["skipped"]) == counts["not applicable"]
    assert int(suite.attrib["tests"]) == sum(counts.values()) == len(CHECKS)


def test_a_client_that_fails_makes_exit_code_1(tmp_path: Path) -> None:
    file = tmp_path / "bad.json"
    topic = "0c000000010000000100000000000000"
    entry = {"t": 0.0, "dir": "client->server", "port": 11000, "conn": 1, "hex": topic}
    file.write_text(json.dumps([entry]))
    assert main(["--role", "client", "--capture", str(file)]) == ExitCode.FAILED


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["--capture", GENERIC, "--listen", "0"],
        ["--capture", "no/such/file.json"],
        ["--capture", __file__],
        ["--capture", GENERIC, "--robot", "no_such_robot"],
        ["--listen", "127.0.0.1:0:0", "--trigger", "'", "--scenario", "none"],
        ["--listen", "127.0.0.1:0:0", "--trigger", "", "--scenario", "none"],
        ["--listen", "99999"],
        ["--listen", "here"],
        ["--listen", "0", "--wait", "nan"],
        ["--listen", "0", "--scenario", "no-such-scenario"],
        ["--capture", GENERIC, "--ports", "1:2:3:4"],
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--role", "client", *arguments]) == ExitCode.USAGE
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "Traceback" not in captured.err
    assert captured.err.strip()


@pytest.mark.virtual_clock
async def test_a_client_that_comes_and_goes_was_there() -> None:
    core = ScriptedController(Setup(), now=LiveController.now())
    live = LiveController(core, "127.0.0.1", {Purpose.MOTION: 0, Purpose.STATE: 0})

    async def come_and_go(scenario: Scenario) -> None:
        port = live.ports[Purpose.MOTION]
        _, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.close()
        await writer.wait_closed()

    async with live.listening():
        before = live.was_connected
        found = await client_role.judge_live(
            live, Setup(), [Scenario(Mutation.NONE)], come_and_go, wait=3.0
        )
        assert (before, live.was_connected) == (False, True)
    assert set(found) == {"none"}


@pytest.mark.virtual_clock
async def test_nobody_connecting_is_the_peers_fault() -> None:
    with pytest.raises(PeerError, match="no client connected; 3 s were waited"):
        await judged(
            *("--listen", "127.0.0.1:0:0", "--wait", "3"),
            *("--scenario", "none", "--scenario", "closed"),
        )


@pytest.mark.virtual_clock
async def test_a_port_that_is_taken_is_said_so() -> None:
    setup = Setup()
    first = LiveController(ScriptedController(setup), "127.0.0.1", {Purpose.MOTION: 0})
    async with first.listening() as ports:
        taken = ports[Purpose.MOTION]
        with pytest.raises(PacketToolError, match=f"port {taken}: .*in use"):
            await judged("--listen", f"127.0.0.1:{taken}:0", "--scenario", "none")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("11000", ("127.0.0.1", 11000, None)),
        ("11000:11002", ("127.0.0.1", 11000, 11002)),
        ("0.0.0.0:0", ("0.0.0.0", 0, None)),
        ("localhost:11000:11002", ("localhost", 11000, 11002)),
        ("[::1]:11000:11002", ("::1", 11000, 11002)),
    ],
)
def test_where_to_listen_is_read(text: str, expected: tuple[str, int, int | None]) -> None:
    assert options("--listen", text).listen == expected


def test_scenario_names_are_unique() -> None:
    assert len({scenario.name for scenario in SCENARIOS}) == len(SCENARIOS) == len(Mutation)


@pytest.mark.parametrize("most", [10_000, pytest.param(MAX_ENTRIES, marks=pytest.mark.soak)])
def test_a_flood_of_frames_ends_in_a_hang_up_and_bounded_memory(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scripted, "MAX_ENTRIES", most)
    controller = ScriptedController(Setup())
    controller.begin(Scenario(Mutation.NONE), 0)
    link = ClientLinkId(Purpose.MOTION, 11000, 1)
    controller.connected(link, 0)
    point = JointTrajPt(0, joint_array(()), 0.1, 1.0)
    burst = codec_for().encode(point) * 5_000
    for _ in range(100):
        actions = controller.received(link, burst, 0)
        if Do(Act.CLOSE, link) in actions:
            break
    else:
        raise AssertionError("the client may flood for ever")
    assert most < len(controller.trace) < most + 20_000


@pytest.mark.parametrize("data", [b"", b"\x00", b"\xff" * 40, bytes(40), b"\x0c\x00\x00\x00" * 9])
def test_garbage_is_judged_and_not_stumbled_over(data: bytes) -> None:
    setup = Setup()
    controller = ScriptedController(setup)
    controller.begin(Scenario(Mutation.NONE), 0)
    link = ClientLinkId(Purpose.MOTION, 11000, 1)
    controller.connected(link, 0)
    controller.received(link, data, 5)
    controller.disconnected(link, 9)
    findings = judge_scenario(controller.trace, setup)
    failed = [number for number, item in findings.items() if item.verdict is CheckVerdict.FAILED]
    assert bool(failed) is bool(data)


PAGE = (Path(__file__).parents[3] / "docs" / "conformance-clients.md").read_text("utf-8")


def test_the_page_lists_every_scenario_and_only_checks_that_exist() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| `")]
    named = {word for row in rows for word in re.findall(r"`([a-z-]+)`", row.split("|")[1])}
    assert {scenario.name for scenario in SCENARIOS} <= named
    numbers = {check.number for check in CHECKS}
    assert set(re.findall(r"\b[A-Z]C\d\d\b", PAGE)) <= numbers


def test_the_page_lists_every_option() -> None:
    parser = argparse.ArgumentParser()
    client_role.add_arguments(parser)
    options_of_role = re.findall(r"--[a-z-]+", parser.format_usage())
    assert [option for option in options_of_role if option not in PAGE] == []


def test_the_page_names_the_habits_that_recordings_show() -> None:
    shown = set()
    for file, dialect in ((GENERIC, "standard"), (DRIVER, "motoman")):
        setup = Setup(dialect=DIALECTS[dialect], dof=6)
        for result in client_role.judge_recording(Path(file), setup).results:
            shown |= {habit for habit in result.finding.habit.split("; ") if habit}
    assert [habit for habit in shown if habit not in PAGE] == []


ROBOT = serial_robot("ur5")
SETUP = Setup(dof=6, limits=ROBOT.limits)
STANDARD = [scenario for scenario in SCENARIOS if not scenario.is_motoman]


@asynccontextmanager
async def our_server(live: LiveController, **controller: object) -> AsyncIterator[PendantClient]:
    ports = {
        "motion_port": live.ports[Purpose.MOTION],
        "state_port": live.ports[Purpose.STATE],
        "state_period": 0.025,
    }
    app, _ = served_cell(tick_rate=HALF_RATE, controller={**ports, **controller})
    async with app.running() as listening:
        pendant = await PendantClient.connect("127.0.0.1", listening.pendant, state_rate=50)
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


async def judged_server(
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
    found = await judged_server([scenario], points=points)
    assert complaints(found) == []
    passed = {n for n, item in found[scenario.name].items() if item.verdict is CheckVerdict.PASSED}
    of_form = {"LC03", "LC04"} if points == "simple" else set()
    assert LOOKED_AT[scenario.mutation] - of_form <= passed


@pytest.mark.conformance
@pytest.mark.virtual_clock
async def test_one_session_of_all_scenarios_ends_with_a_robot_that_still_moves() -> None:
    found = await judged_server(STANDARD)
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
