"""The textual screen with a real client, in front of a server that agrees to everything."""

import asyncio
import json
import os
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from rigs.cells.panel_rig import DRY_RUN
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server
from textual import events
from textual._xterm_parser import XTermParser
from textual.geometry import Region
from textual.pilot import Pilot
from textual.widgets import Static

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient, PendantError, Refused, WrongArgument
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.terminal.app import PendantApp

pytestmark = pytest.mark.realtime

SCALE = float(os.environ.get("OPENPENDANT_TIME_SCALE", "1"))

PROGRAM = {
    "name": "pick",
    "points": [{"name": "P1"}],
    "statements": [{"statement": "move", "point": "P1"}],
}

SNAPSHOT = {
    "robot": "ur5",
    "joints": [
        {"name": f"joint {n}", "unit": "rad", "lower": -2.0, "upper": 2.0} for n in range(1, 7)
    ],
    "frames": ["base"],
    "program": None,
    "owner": None,
    "stop": None,
}


class Screen:
    """The screen as somebody sees it, who strikes keys."""

    def __init__(self, pilot: Pilot[PendantError | None], server: ScriptedPendantServer) -> None:
        self.pilot = pilot
        self.server = server

    async def keys(self, *keys: str) -> None:
        await self.pilot.press(*keys)

    async def jog_keys(self, *keys: str) -> None:
        """Strike keys that move the robot, which they do not while the display is stale."""
        await self.until(lambda: not self.panel.cell.is_stale(time.monotonic_ns()))
        await self.keys(*keys)

    @property
    def panel(self) -> Panel:
        assert isinstance(self.pilot.app, PendantApp)
        return self.pilot.app.panel

    def text(self, name: str) -> str:
        return str(self.pilot.app.screen.query_one(f"#{name}", Static).content)

    def regions(self) -> dict[str, Region]:
        """Where each text lies as it was laid out last, which may be before its newest words."""
        widgets = self.pilot.app.screen.query(Static)
        return {each.id: each.region for each in widgets if each.id is not None}

    async def until(self, holds: Callable[[], object]) -> None:
        """Wait until something holds; else fail with all that is shown, and where."""
        try:
            async with asyncio.timeout(10 * SCALE):
                while not holds():
                    await self.pilot.pause(0.02)
        except TimeoutError:
            shown = [
                f"{name}, {region}:\n{self.text(name)}" for name, region in self.regions().items()
            ]
            got = [type(message).__name__ for _, message in self.server.got]
            raise AssertionError(
                "\n".join(["not shown in time", *shown, f"sent: {got[-20:]}"])
            ) from None


@asynccontextmanager
async def screen(size: tuple[int, int] = (120, 40)) -> AsyncIterator[Screen]:
    async with scripted_server() as server:
        server.answers["snapshot"] = SNAPSHOT
        app = PendantApp(lambda: PendantClient.connect("127.0.0.1", server.port, state_rate=25))
        async with app.run_test(size=size) as pilot:
            shown = Screen(pilot, server)
            await shown.until(lambda: "1 joint 1" in shown.text("joints"))
            yield shown


@pytest.fixture(autouse=True)
def keys_follow_each_other_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nobody wait between keys until the screen has nothing to do: a terminal does not, either,
    and what a key shall do is waited for."""

    async def at_once(_least: float = 0.0) -> None:
        await asyncio.sleep(0)

    monkeypatch.setattr("textual.app.wait_for_idle", at_once)


@pytest.fixture
async def shown() -> AsyncIterator[Screen]:
    async with screen() as shown:
        yield shown


async def test_the_screen_shows_display_lamps_and_joints(shown: Screen) -> None:
    await shown.until(lambda: "pendant–server: up" in shown.text("lamps"))
    rows = shown.text("lcd").split("\n")
    assert [len(row) for row in rows] == [20] * 4
    assert "7.16" in rows[1]
    assert "Observing" in shown.text("banner")


async def test_a_terminal_of_24_rows_shows_refusals_joints_and_the_keys_that_matter() -> None:
    async with screen((80, 24)) as shown:

        def joints_fit() -> bool:
            rows = shown.text("joints").split("\n")
            region = shown.regions()["joints"]
            return region.height == len(rows) and region.width >= max(map(len, rows))

        def seen() -> set[str]:
            regions = shown.regions().items()
            return {name for name, each in regions if each.height and each.bottom <= 24}

        wanted = {"lamps", "status", "steps", "lcd", "jog", "joints", "pose", "messages", "keys"}
        await shown.until(lambda: joints_fit() and seen() >= wanted)
        assert shown.text("keys").startswith("SPACE, F8 software stop")


async def test_a_jog_key_becomes_a_step(shown: Screen) -> None:
    await shown.jog_keys("w")
    await shown.until(lambda: shown.server.all(messages.JogStep))
    assert shown.server.one(messages.JogStep).values[1] == pytest.approx(0.0087266, abs=1e-6)


async def test_a_held_key_becomes_presses_without_a_single_beat(shown: Screen) -> None:
    await shown.keys("slash")
    await shown.jog_keys(*"qqqqq")
    await shown.until(lambda: shown.server.all(messages.JogStart))
    await asyncio.sleep(0.3)
    presses = shown.server.all(messages.JogStart)
    assert presses[0].values[0] == 1.0
    assert all(0.05 <= press.deadline <= 0.2500001 for press in presses)
    assert shown.server.all(messages.JogBeat) == []


async def test_a_stroke_is_dropped_while_a_press_waits_for_its_verdict(shown: Screen) -> None:
    await shown.keys("slash")
    shown.server.mutes = True
    shown.server.tell_state()  # or what is shown is stale where the machine stalls
    await shown.jog_keys(*"qqqq")
    await shown.until(lambda: shown.server.all(messages.JogStart))
    await asyncio.sleep(0.1)
    assert len(shown.server.all(messages.JogStart)) == 1
    await shown.keys("space")
    await shown.until(lambda: shown.server.all(messages.SoftwareStop))


@pytest.mark.parametrize("before", [(), ("n", "a"), ("m",), ("tab",)])
async def test_the_space_bar_stops_from_everywhere(before: tuple[str, ...], shown: Screen) -> None:
    await shown.keys(*before, "space")
    await shown.until(lambda: shown.server.all(messages.SoftwareStop))
    assert shown.server.one(messages.SoftwareStop).reason == "space bar"


@pytest.mark.parametrize("before", [(), ("n", "a"), ("m",)])
async def test_f8_stops_from_everywhere_as_the_terminal_sends_it(
    before: tuple[str, ...], shown: Screen
) -> None:
    await shown.keys(*before)
    (key,) = (event for event in XTermParser().feed("\x1b[19~") if isinstance(event, events.Key))
    await shown.keys(key.key)
    await shown.until(lambda: shown.server.all(messages.SoftwareStop))
    assert shown.server.one(messages.SoftwareStop).reason == "F8"


async def test_enabling_is_repeated_and_let_go(shown: Screen) -> None:
    await shown.keys("v")
    await shown.until(lambda: len(shown.server.all(messages.Enabling)) > 5)
    await shown.until(lambda: "HELD" in shown.text("jog"))
    await shown.keys("escape")
    await shown.until(
        lambda: (
            shown.server.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED
        )
    )


async def test_a_refusal_is_shown_with_its_remedy_and_lets_enabling_go(shown: Screen) -> None:
    await shown.keys("v")
    shown.server.refusals[messages.JogStep] = (VerdictCode.NOT_ENABLED, "it is released")
    await shown.jog_keys("q")
    await shown.until(lambda: "NOT_ENABLED: it is released -> " in shown.text("messages"))
    await shown.until(lambda: "let go" in shown.text("jog"))


async def test_an_abort_says_why_enabling_was_let_go(shown: Screen) -> None:
    shown.server.completes = False
    await shown.keys("v", "0", "1")
    await shown.until(lambda: shown.server.all(messages.Home))
    await shown.keys("escape")
    shown.server.end_motion(shown.server.one(messages.Home).request_id, VerdictCode.ENABLING_LOST)
    await shown.until(lambda: "enabling let go (Esc): ENABLING_LOST: " in shown.text("messages"))


async def test_mode_control_and_home_are_asked_for(shown: Screen) -> None:
    await shown.keys("c", "m", "2", "0", "1")
    await shown.until(lambda: shown.server.all(messages.Home))
    assert shown.server.one(messages.Authority).action == 1
    assert shown.server.one(messages.SetMode).mode == 2
    assert shown.server.one(messages.Home).target == "home"
    await shown.until(lambda: "way to home ended" in shown.text("messages"))


async def test_a_program_is_opened_recorded_and_run(shown: Screen) -> None:
    body = {"revision": 1, "next": None}
    shown.server.answers["programs.record"] = {"revision": 2}
    shown.server.answers["programs.load"] = {**body, "body": json.dumps(PROGRAM)}
    # The list is refused here: a whole name opens its program all the same.
    await shown.keys("n", *"pick", "enter")
    await shown.until(lambda: "pick, revision 1" in shown.text("program"))
    await shown.keys("1", "5", "1", "5")
    await shown.until(lambda: shown.server.all(messages.ProgramRun))
    run = shown.server.one(messages.ProgramRun)
    assert (run.program, run.revision) == ("pick", 1)
    asked = [json.loads(each.body) for each in shown.server.all(messages.Management)]
    (record,) = [each for each in asked if each["op"] == "programs.record"]
    assert (record["point"], record["expected_revision"]) == ("P2", 1)


async def open_pick(shown: Screen) -> None:
    body = {"revision": 1, "next": None, "body": json.dumps(PROGRAM)}
    shown.server.answers["programs.load"] = body
    shown.server.answers["programs.list"] = {"programs": [{"name": "pick"}], "next": None}
    await shown.keys("n", *"pick", "enter")
    await shown.until(lambda: "pick, revision 1" in shown.text("program"))


async def test_a_dry_run_is_asked_for_and_shown_beside_the_points(shown: Screen) -> None:
    await open_pick(shown)
    shown.server.answers["programs.dry_run"] = {**DRY_RUN, "revision": 1}
    await shown.keys("full_stop")
    await shown.until(lambda: "all reachable, 4.2 s" in shown.text("program"))
    await shown.keys("5", "1")
    await shown.until(lambda: shown.server.all(messages.ProgramRun))


class EditedMeanwhile(dict[str, dict[str, Any]]):
    """Answers of a server where somebody saves the program while its dry run is under way."""

    def get(self, op: str, default: Any = None) -> Any:
        if op == "programs.dry_run":
            self["programs.load"]["revision"] += 1
        return super().get(op, default)


async def test_a_dry_run_of_a_program_that_was_edited_meanwhile_says_nothing_of_it() -> None:
    async with screen() as shown:
        await open_pick(shown)
        shown.server.answers["programs.dry_run"] = {**DRY_RUN, "revision": 1}
        shown.server.answers = EditedMeanwhile(shown.server.answers)
        await shown.keys("full_stop")
        await shown.until(lambda: "pick was changed meanwhile" in shown.text("messages"))
        await shown.until(lambda: "pick, revision 2" in shown.text("program"))
        assert "no dry run of this revision" in shown.text("program")


@pytest.mark.parametrize("keys", [("6",), ("7",), ("5", "1", "5"), ("5", "2", "5")])
async def test_what_was_changed_meanwhile_is_shown_and_not_run(keys: tuple[str, ...]) -> None:
    async with screen() as shown:
        await open_pick(shown)
        shown.server.answers["programs.load"]["revision"] = 2
        shown.server.refusals[messages.ProgramRun] = (
            VerdictCode.REVISION_CONFLICT,
            "revision 2 is kept",
        )
        await shown.keys(*keys)
        await shown.until(lambda: "pick, revision 2" in shown.text("program"))
        assert "pick was changed: revision 2 is shown now" in shown.text("messages")
        assert "no dry run of this revision" in shown.text("program")
        # The one that was asked for by keys, and none by itself.
        assert shown.server.one(messages.ProgramRun).revision == 1
        await shown.keys("6")
        await shown.until(lambda: len(shown.server.all(messages.ProgramRun)) > 1)
        assert shown.server.all(messages.ProgramRun)[1].revision == 2


async def test_a_program_with_a_space_in_its_name_is_chosen_and_a_new_one_asked_about() -> None:
    async with screen() as shown:
        programs = [{"name": "five points"}, {"name": "pick"}]
        shown.server.answers["programs.list"] = {"programs": programs, "next": None}
        body = {"revision": 1, "next": None, "body": json.dumps(PROGRAM | {"name": "five points"})}
        shown.server.answers["programs.load"] = body
        await shown.keys("n")
        await shown.until(lambda: "> five points" in shown.text("program"))
        await shown.keys("enter")
        await shown.until(lambda: "five points, revision 1" in shown.text("program"))
        await shown.keys("n", *"pcik")
        await shown.until(lambda: "> pcik  new" in shown.text("program"))
        await shown.keys("enter")
        await shown.until(lambda: "Create pcik?" in shown.text("lcd"))
        await shown.keys("escape")
        ops = [json.loads(each.body)["op"] for each in shown.server.all(messages.Management)]
        assert "programs.create" not in ops


async def test_a_dry_run_that_is_refused_is_told_and_may_be_asked_for_again(shown: Screen) -> None:
    await open_pick(shown)
    await shown.keys("full_stop")
    await shown.until(lambda: "BAD_ARGUMENT: no such op" in shown.text("messages"))
    assert "no dry run of this revision" in shown.text("program")


async def test_the_end_of_a_step_is_not_told_as_that_of_its_program(shown: Screen) -> None:
    await open_pick(shown)
    await shown.keys("6")
    await shown.until(lambda: "one step of pick ended" in shown.text("messages"))
    assert "program pick" not in shown.text("messages")


async def test_the_newest_message_is_seen_however_long_those_before_it_are(shown: Screen) -> None:
    for number in range(6):
        shown.panel.messages.add(f"{number} {'many words ' * 20}")
    shown.panel.messages.add("the end")
    await shown.until(lambda: shown.text("messages").endswith("the end"))
    assert shown.text("messages").count("\n") < 6


async def test_the_lists_of_the_cell_are_asked_for_and_used(shown: Screen) -> None:
    tools = {"tools": [{"name": "gripper"}], "selected_tool": None}
    shown.server.answers["frames.show"] = {"names": ["base"], "tools_revision": 3, "content": tools}
    shown.server.answers["tools.select"] = {"revision": 4}
    await shown.keys("M", "3")
    await shown.until(lambda: "gripper" in shown.text("program"))
    await shown.keys("down", "enter")
    await shown.until(lambda: "tool gripper is selected" in shown.text("messages"))
    asked = json.loads(shown.server.all(messages.Management)[-1].body)
    assert (asked["op"], asked["name"], asked["expected_revision"]) == (
        "tools.select",
        "gripper",
        3,
    )


@pytest.mark.parametrize(
    ("key", "op", "answer", "says"),
    [
        ("5", "signals.read", {"offered": True, "inputs": [], "outputs": [False]}, "output 0 off"),
        ("4", "scene.show", {"content": {"objects": []}, "revision": 1}, "scene: none"),
        ("1", "recordings.list", {"recordings": [], "recording": None}, "new: type its name"),
    ],
)
async def test_each_list_is_shown_as_the_server_tells_it(
    key: str, op: str, answer: dict[str, Any], says: str, shown: Screen
) -> None:
    shown.server.answers[op] = answer
    await shown.keys("M", key)
    await shown.until(lambda: says in shown.text("program"))


POSE = {"position": [0.4, 0, 0.2], "orientation": [0, 0, 0, 1]}
PARK = {"name": "park", "kind": "user", "pose": POSE, "legal": True, "why": ""}


async def test_a_position_is_taught_from_the_revision_that_was_listed(shown: Screen) -> None:
    shown.server.answers["positions.list"] = {"positions": [], "revision": 5, "problem": ""}
    shown.server.answers["positions.save"] = {"revision": 6, "warning": "elbow is near its limit"}
    await shown.keys("M", "8")
    await shown.until(lambda: "new: type its name" in shown.text("program"))
    await shown.keys("enter", *"up", "enter")
    says = "position up is where the robot stands: elbow is near its limit"
    await shown.until(lambda: says in shown.text("messages"))
    asked = json.loads(shown.server.all(messages.Management)[-1].body)
    assert (asked["op"], asked["name"], asked["expected_revision"]) == ("positions.save", "up", 5)
    assert asked.get("joints") is None


async def test_a_position_is_deleted_after_a_question(shown: Screen) -> None:
    shown.server.answers["positions.list"] = {"positions": [PARK], "revision": 5, "problem": ""}
    shown.server.answers["positions.delete"] = {"revision": 6}
    await shown.keys("M", "8")
    await shown.until(lambda: "park" in shown.text("program"))
    await shown.keys("down", "enter", "4", "1")
    await shown.until(lambda: "position park is deleted" in shown.text("messages"))


async def test_a_plan_is_dropped_by_its_number(shown: Screen) -> None:
    head = {"plan": 7, "state": "ready", "kind": "ptp", "label": "", "maker": "bench", "text": ""}
    numbers = {"duration": 1.0, "samples": 101, "expires_in": 60.0, "code": 0}
    shown.server.answers["plans.show"] = {"plans": [head | numbers]}
    shown.server.answers["plans.drop"] = {}
    await shown.keys("M", "7")
    await shown.until(lambda: "7 ready" in shown.text("program"))
    await shown.keys("enter", "down", "enter")
    await shown.until(lambda: "plan 7 is dropped" in shown.text("messages"))
    assert json.loads(shown.server.all(messages.Management)[-1].body)["plan"] == 7


async def test_a_pairing_code_is_asked_for_here(shown: Screen) -> None:
    shown.server.refusals[messages.Pairing] = (VerdictCode.ROLE_TOO_LOW, "an admin may")
    await shown.keys("M", "6", "1")
    await shown.until(lambda: "ROLE_TOO_LOW: an admin may" in shown.text("messages"))
    assert shown.server.one(messages.Pairing).action == messages.PairingAction.ISSUE


async def test_a_key_shows_all_keys_on_eighty_columns_and_24_rows() -> None:
    async with screen((80, 24)) as shown:
        await shown.keys("K")
        await shown.until(lambda: "step back" in shown.text("keys"))
        await shown.until(lambda: shown.regions()["keys"].bottom <= 24)
        await shown.keys("K")
        await shown.until(lambda: "step back" not in shown.text("keys"))


@pytest.mark.parametrize(
    "failure",
    [
        Refused(VerdictCode.UNKNOWN_CELL, "name a cell; here: left, right", -1, 0.0, 0.0),
        WrongArgument("the name is too long"),
    ],
)
async def test_a_refusal_that_no_attempt_can_heal_ends_the_pendant(failure: PendantError) -> None:
    attempts = 0

    async def connect() -> PendantClient:
        nonlocal attempts
        attempts += 1
        raise failure

    app = PendantApp(connect)
    async with app.run_test() as pilot, asyncio.timeout(10 * SCALE):
        while app.is_running:
            await pilot.pause(0.02)
    assert (app.return_value, attempts) == (failure, 1)


async def test_the_reason_why_it_does_not_move_gets_a_page(shown: Screen) -> None:
    condition = {"meaning": "m", "holds": False, "text": "a", "cause": "b", "remedy": "c"}
    shown.server.answers["why"] = {"kind": "jog", "conditions": [condition]}
    await shown.keys("question_mark")
    await shown.until(lambda: "No jog:" in shown.text("lcd"))


async def test_the_way_out_of_a_limit_is_on_that_page(shown: Screen) -> None:
    """Feature J23."""
    way = {"press": "joint 3 towards -", "space": 1, "frame": "", "values": [0, 0, -1]}
    hold = {"reason": "joint-limit", "text": "joint 3 stands", "ways": [way]}
    shown.server.answers["why"] = {"kind": "jog", "conditions": []}
    shown.server.answers["jog.retreat"] = {"holds": [hold]}
    await shown.keys("question_mark")
    await shown.until(lambda: "-> joint 3 towards" in shown.text("lcd"))


async def test_a_stop_of_another_is_told_with_its_reason(shown: Screen) -> None:
    stop = messages.StopChanged(
        stop=messages.StopKind.SOFTWARE, session=3, client="bench-2", reason="smoke"
    )
    shown.server.send(stop)
    await shown.until(lambda: "stop by bench-2: smoke" in shown.text("messages"))


async def test_pasted_text_moves_nothing(shown: Screen) -> None:
    shown.pilot.app.post_message(events.Paste("qqqwww"))
    await shown.keys("f1")
    await asyncio.sleep(0.2)
    assert shown.server.all(messages.JogStep) == []


async def test_a_lost_link_is_shown_and_comes_back_as_an_onlooker(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("openpendant.tools.pendants.panel.connection.RETRY", 0.1)
    async with screen() as shown:
        await shown.keys("v")
        shown.server.hang_up()
        await shown.until(lambda: "no link" in shown.text("messages"))
        await shown.until(lambda: shown.text("messages").count("connected to") == 2)
        await shown.until(lambda: "Observing" in shown.text("banner"))
        assert "let go" in shown.text("jog")


@pytest.mark.parametrize("key", ["ctrl+q", "ctrl+c"])
async def test_the_pendant_is_left_by_its_keys(key: str, shown: Screen) -> None:
    await shown.keys(key)
    await shown.until(lambda: not shown.pilot.app.is_running)
