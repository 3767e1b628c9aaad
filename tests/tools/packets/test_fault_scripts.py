"""Fault scripts: what they may say, and all of examples/faults with a robot that moves behind."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from rigs.processes.judged_server import served_cell

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.service import Service, loop_time
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.simplemsg.pendant import LinkState, State
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.packets.faults import FaultProxy, main
from openpendant.tools.packets.faulty.fault_catalogue import CORRECT_PEER, explain, list_faults
from openpendant.tools.packets.faulty.fault_script import (
    RULE_CLASSES,
    FaultScriptError,
    load_script,
)
from openpendant.tools.packets.live.endpoints import Endpoint
from openpendant.tools.packets.live.proxy import Pair
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused

pytestmark = pytest.mark.virtual_clock

EXAMPLES = sorted((Path(__file__).parents[3] / "examples" / "faults").glob("*.toml"))
DELAY = '[[rule]]\nfault = "delay"\n'

WRONG: dict[str, tuple[str | bytes, str]] = {
    "no TOML": ("[[rule]", "is no TOML: "),
    "no UTF-8": (b"\xff", "is no TOML: "),
    "no rules": ("", "rule: is missing"),
    "a rule that is none": ("rule = 3", "rule: Input should be a valid tuple"),
    "an unknown fault": ('[[rule]]\nfault = "explode"', "rule 1: fault: expected one of delay, "),
    "no fault": ("[[rule]]\nms = 3", "rule 1: fault: expected one of delay, "),
    "a missing key": (DELAY, "rule 1: ms: is missing"),
    "a key too many": (DELAY + "ms = 1\nfoo = 2", "rule 1: foo: unknown key; known here: match, "),
    "a wrong value": (DELAY + "ms = -1", "rule 1: ms: Input should be greater than or equal to 0"),
    "a wrong kind": (DELAY + 'ms = "soon"', "rule 1: ms: Input should be a valid number"),
    "a wrong match": (DELAY + "ms = 1\nmatch = {foo = 1}", "rule 1: match.foo: unknown key; known"),
    "a wrong direction": (
        DELAY + 'ms = 1\nmatch = {direction = "up"}',
        "rule 1: match.direction: Input should be 'to_server' or 'to_client'; got 'up'",
    ),
    "an unknown type": (
        DELAY + 'ms = 1\nmatch = {type = "jump"}',
        "rule 1: match.type: 'jump' is no message of the standard dialect",
    ),
    "the second rule": (DELAY + "ms = 1\n" + DELAY, "rule 2: ms: is missing"),
    "no way to cut": ('[[rule]]\nfault = "split"', "rule 1: give either at or size"),
    "an unknown key on top": ("sed = 3\nrule = []", "sed: unknown key; known here: about, "),
    "nesting without end": ("a = " + "[" * 20_000, "is no TOML: "),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_script_is_one_line_with_file_rule_and_key(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, reason = WRONG[case]
    file = tmp_path / "script.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert main(["--explain", str(file)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{file}: {reason}")
    assert len(line) < 500


def test_a_script_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(FaultScriptError, match="cannot be read: No such file"):
        load_script(tmp_path / "nowhere.toml")


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda path: path.name)
def test_the_examples_are_scripts_and_can_be_explained(file: Path) -> None:
    script = load_script(file)
    lines = explain(script).splitlines()
    assert lines[0] == script.about
    assert [line for line in lines if line.startswith("rule ")] != []


def test_a_script_is_explained_in_words(tmp_path: Path) -> None:
    file = tmp_path / "script.toml"
    file.write_text(DELAY + 'ms = 20\nmatch = {direction = "to_server", type = 11, nth = 2}')
    assert explain(load_script(file)).splitlines() == [
        "messages: standard, seed: 0",
        "rule 1: every frame from client to server of type 11 but only no. 2: delay, which holds a"
        " frame back; what follows it waits too, as on a slow line (ms 20, jitter_ms 0)",
        "every other frame passes as it is",
    ]


def test_every_fault_is_listed_with_what_a_correct_peer_does(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert set(CORRECT_PEER) == set(RULE_CLASSES)
    assert main(["--list"]) == 0
    printed = capsys.readouterr().out
    assert printed.rstrip("\n") == list_faults()
    for name in RULE_CLASSES:
        assert f"\n{name}: " in f"\n{printed}"


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "a script is needed"),
        ([str(EXAMPLES[0])], "--listen and --to are needed"),
        ([str(EXAMPLES[0]), "--listen", "0"], "1 --listen need as many --to, not 0"),
    ],
)
def test_what_is_missing_is_said(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert reason in capsys.readouterr().err


HOST = "127.0.0.1"


@dataclass
class FaultedCell:
    """A cell whose controller is behind a line that does what a script says.

    Attributes:
        proxy: counts the faults that were done.
    """

    service: Service
    proxy: FaultProxy
    pendant_port: int

    def violations(self) -> dict[str, int]:
        counts = self.service.controller.referee.counts
        return {kind.value: count for kind, count in counts.items()}

    async def pendant(self) -> PendantClient:
        pendant = await PendantClient.connect(HOST, self.pendant_port, state_rate=50)
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=20.0)
        return pendant


@asynccontextmanager
async def cell_behind_faults(script: Path, **link: object) -> AsyncIterator[FaultedCell]:
    loop = asyncio.get_running_loop()
    emulator = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0})
    service = Service(build_controller(emulator, loop_time(loop)), emulator)
    ports = await service.start()
    pairs = [Pair(Endpoint(HOST, 0), Endpoint(HOST, port)) for port in ports]
    proxy = FaultProxy(pairs, load_script(script))
    try:
        motion, state = await proxy.start()
        controller = {"host": HOST, "motion_port": motion, "state_port": state, **link}
        app, _ = served_cell(controller=controller)
        async with app.running() as listening:
            yield FaultedCell(service, proxy, listening.pendant)
    finally:
        await proxy.close()
        await service.close()
        await asyncio.sleep(0.01)


FOLDER = Path(__file__).parents[3] / "examples" / "faults"
SPEED = 0.3
SILENT_LINE = (VerdictCode.CONTROLLER_STOPPED, "error 109 (emulated controller: a buffer under-run")
"""No point comes in time, so the robot under-runs, slows down and says so."""

ENDS: dict[str, tuple[VerdictCode, str] | None] = {
    "cable_pulled": SILENT_LINE,
    "lost_reply": SILENT_LINE,
    "motoman_busy": (VerdictCode.CONTROLLER_MISMATCH, "type 2002"),
    "reset_in_motion": (VerdictCode.CONTROLLER_LOST, "motion link was lost"),
    "slow_line": (VerdictCode.CONTROLLER_REFUSED, "under-run"),
    "split_and_merge": None,
}
"""How the first motion ends behind each script: code and words, None where it arrives."""

PASSING = ("cable_pulled", "lost_reply", "reset_in_motion")
"""Scripts that do something once; the next motion arrives."""


def _script(name: str) -> Path:
    return FOLDER / f"{name}.toml"


def _aside(pendant: PendantClient, by: float = 0.5) -> list[float]:
    first, *others = pendant.joints()
    return [first + by, *others]


def _is_ready(state: State) -> bool:
    return state.link == LinkState.UP and state.motion_possible == 1


async def _comes_to_rest(pendant: PendantClient) -> None:
    await pendant.wait_until(lambda state: not state.activity)
    await asyncio.sleep(1.0)
    before = pendant.joints()
    await asyncio.sleep(1.0)
    assert pendant.joints() == before


async def test_every_example_is_tried() -> None:
    assert {path.stem for path in FOLDER.glob("*.toml")} == {*ENDS, "noisy"}


@pytest.mark.parametrize("name", [name for name, end in ENDS.items() if end is None])
@pytest.mark.parametrize("points", ["full", "simple"])
async def test_what_is_harmless_lets_the_motion_arrive(name: str, points: str) -> None:
    async with cell_behind_faults(_script(name), points=points) as cell:
        pendant = await cell.pendant()
        async with pendant, pendant.control():
            goal = _aside(pendant)
            await (await pendant.move_joints(goal, speed=SPEED)).done()
            assert pendant.joints() == pytest.approx(goal, abs=1e-3)
        assert cell.violations() == {}
        assert len(cell.proxy.done) > 1


@pytest.mark.parametrize(
    ("name", "points"),
    [
        (name, points)
        for name, end in ENDS.items()
        for points in ("full", "simple")
        if end is not None and (name, points) != ("motoman_busy", "simple")  # busy to full points
    ],
)
async def test_what_harms_stops_the_robot_and_the_server_says_why(name: str, points: str) -> None:
    expected = ENDS[name]
    assert expected is not None
    async with cell_behind_faults(_script(name), points=points) as cell:
        pendant = await cell.pendant()
        async with pendant, pendant.control():
            motion = await pendant.move_joints(_aside(pendant), speed=SPEED)
            with pytest.raises(Aborted) as abort:
                await motion.done()
            code, words = expected
            assert abort.value.code is code
            assert words in str(abort.value)
            await _comes_to_rest(pendant)
            if name in PASSING:
                await pendant.wait_until(_is_ready)
                goal = _aside(pendant)
                await (await pendant.move_joints(goal, speed=SPEED)).done()
                assert pendant.joints() == pytest.approx(goal, abs=1e-3)
        assert cell.violations() == {}


async def test_noise_ends_a_motion_at_its_goal_or_with_a_reason() -> None:
    # A flipped bit of a point may be a violation that is not the server's, so none are counted.
    ends: list[str] = []
    async with cell_behind_faults(_script("noisy")) as cell:
        pendant = await cell.pendant()
        async with pendant, pendant.control():
            for turn in range(8):
                await pendant.wait_until(_is_ready)
                goal = _aside(pendant, -0.5 if turn % 2 else 0.5)
                try:
                    await (await pendant.move_joints(goal, speed=SPEED)).done()
                    ends.append("")
                except Refused as failure:
                    ends.append(str(failure))
                    await _comes_to_rest(pendant)
        assert cell.proxy.done.total() > 10
    assert "" in ends
    assert all(not end or end.startswith("CONTROLLER_") for end in ends)
