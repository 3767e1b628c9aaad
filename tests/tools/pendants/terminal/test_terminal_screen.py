"""The textual screen with a real client, in front of a server that agrees to everything."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest
from scripted_pendant_server import ScriptedPendantServer, scripted_server
from textual import events
from textual.pilot import Pilot
from textual.widgets import Static

from openpendant.simplemsg.pendant import (
    Authority,
    Enabling,
    EnablingPosition,
    Home,
    JogBeat,
    JogStart,
    JogStep,
    Management,
    ProgramRun,
    SetMode,
    SoftwareStop,
    StopChanged,
    StopKind,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.terminal.app import PendantApp

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio]

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
    "owner": None,
    "stop": None,
}


class Screen:
    """The screen as somebody sees it, who strikes keys."""

    def __init__(self, pilot: Pilot[None], server: ScriptedPendantServer) -> None:
        self.pilot = pilot
        self.server = server

    async def keys(self, *keys: str) -> None:
        await self.pilot.press(*keys)

    def text(self, name: str) -> str:
        return str(self.pilot.app.screen.query_one(f"#{name}", Static).content)

    async def until(self, holds: Callable[[], object]) -> None:
        async with asyncio.timeout(10 * SCALE):
            while not holds():
                await self.pilot.pause(0.02)


@asynccontextmanager
async def screen() -> AsyncIterator[Screen]:
    async with scripted_server() as server:
        server.answers["snapshot"] = SNAPSHOT
        app = PendantApp(lambda: PendantClient.connect("127.0.0.1", server.port, state_rate=25))
        async with app.run_test(size=(120, 40)) as pilot:
            shown = Screen(pilot, server)
            await shown.until(lambda: "1 joint 1" in shown.text("joints"))
            yield shown


async def test_the_screen_shows_display_lamps_and_joints() -> None:
    async with screen() as shown:
        await shown.until(lambda: "pendant–server: up" in shown.text("lamps"))
        rows = shown.text("lcd").split("\n")
        assert [len(row) for row in rows] == [20] * 4
        assert "7.16" in rows[1]
        assert "Observing" in shown.text("banner")


async def test_a_jog_key_becomes_a_step() -> None:
    async with screen() as shown:
        await shown.keys("w")
        await shown.until(lambda: shown.server.all(JogStep))
        assert shown.server.one(JogStep).values[1] == pytest.approx(0.0087266, abs=1e-6)


async def test_a_held_key_becomes_presses_without_a_single_beat() -> None:
    async with screen() as shown:
        await shown.keys("slash", *"qqqqq")
        await shown.until(lambda: shown.server.all(JogStart))
        await asyncio.sleep(0.3)
        presses = shown.server.all(JogStart)
        assert presses[0].values[0] == 1.0
        assert all(0.05 <= press.deadline <= 0.2500001 for press in presses)
        assert shown.server.all(JogBeat) == []


async def test_a_stroke_is_dropped_while_a_press_waits_for_its_verdict() -> None:
    async with screen() as shown:
        shown.server.mutes = True
        await shown.keys("slash", *"qqqq")
        await asyncio.sleep(0.1)
        assert len(shown.server.all(JogStart)) == 1
        await shown.keys("space")
        await shown.until(lambda: shown.server.all(SoftwareStop))


@pytest.mark.parametrize("before", [(), ("n", "a"), ("m",), ("tab",)])
async def test_the_space_bar_stops_from_everywhere(before: tuple[str, ...]) -> None:
    async with screen() as shown:
        await shown.keys(*before, "space")
        await shown.until(lambda: shown.server.all(SoftwareStop))
        assert shown.server.one(SoftwareStop).reason == "space bar"


async def test_enabling_is_repeated_and_let_go() -> None:
    async with screen() as shown:
        await shown.keys("v")
        await shown.until(lambda: len(shown.server.all(Enabling)) > 5)
        assert "HELD" in shown.text("jog")
        await shown.keys("escape")
        await shown.until(
            lambda: shown.server.all(Enabling)[-1].position == EnablingPosition.RELEASED
        )


async def test_a_refusal_is_shown_with_its_remedy_and_lets_enabling_go() -> None:
    async with screen() as shown:
        await shown.keys("v")
        shown.server.refusals[JogStep] = (VerdictCode.NOT_ENABLED, "it is released")
        await shown.keys("q")
        await shown.until(lambda: "NOT_ENABLED: it is released -> " in shown.text("messages"))
        await shown.until(lambda: "let go" in shown.text("jog"))


async def test_mode_control_and_home_are_asked_for() -> None:
    async with screen() as shown:
        await shown.keys("c", "m", "2", "0", "1")
        await shown.until(lambda: shown.server.all(Home))
        assert shown.server.one(Authority).action == 1
        assert shown.server.one(SetMode).mode == 2
        assert shown.server.one(Home).target == "home"
        await shown.until(lambda: "way to home ended" in shown.text("messages"))


async def test_a_program_is_opened_recorded_and_run() -> None:
    async with screen() as shown:
        body = {"revision": 1, "next": None}
        shown.server.answers["programs.record"] = {"revision": 2}
        shown.server.answers["programs.load"] = {**body, "body": json.dumps(PROGRAM)}
        await shown.keys("n", *"pick", "enter")
        await shown.until(lambda: "pick, revision 1" in shown.text("program"))
        await shown.keys("1", "5", "1")
        await shown.until(lambda: shown.server.all(ProgramRun))
        assert shown.server.one(ProgramRun).program == "pick"
        asked = [json.loads(each.body) for each in shown.server.all(Management)]
        (record,) = [each for each in asked if each["op"] == "programs.record"]
        assert (record["point"], record["expected_revision"]) == ("P2", 1)


async def test_the_reason_why_it_does_not_move_gets_a_page() -> None:
    async with screen() as shown:
        condition = {"meaning": "m", "holds": False, "text": "a", "cause": "b", "remedy": "c"}
        shown.server.answers["why"] = {"kind": "jog", "conditions": [condition]}
        await shown.keys("question_mark")
        await shown.until(lambda: "No jog:" in shown.text("lcd"))


async def test_the_way_out_of_a_limit_is_on_that_page() -> None:
    """Feature J23."""
    async with screen() as shown:
        way = {"press": "joint 3 towards -", "space": 1, "frame": "", "values": [0, 0, -1]}
        hold = {"reason": "joint-limit", "text": "joint 3 stands", "ways": [way]}
        shown.server.answers["why"] = {"kind": "jog", "conditions": []}
        shown.server.answers["jog.retreat"] = {"holds": [hold]}
        await shown.keys("question_mark")
        await shown.until(lambda: "-> joint 3 towards -" in shown.text("lcd"))


async def test_a_stop_of_another_is_told_with_its_reason() -> None:
    async with screen() as shown:
        stop = StopChanged(stop=StopKind.SOFTWARE, session=3, client="bench-2", reason="smoke")
        shown.server.send(stop)
        await shown.until(lambda: "stop by bench-2: smoke" in shown.text("messages"))


async def test_pasted_text_moves_nothing() -> None:
    async with screen() as shown:
        shown.pilot.app.post_message(events.Paste("qqqwww"))
        await shown.keys("f1")
        await asyncio.sleep(0.2)
        assert shown.server.all(JogStep) == []


async def test_a_lost_link_is_shown_and_comes_back_as_an_onlooker(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("openpendant.tools.pendants.terminal.connection.RETRY", 0.1)
    async with screen() as shown:
        await shown.keys("v")
        shown.server.hang_up()
        await shown.until(lambda: "no link" in shown.text("messages"))
        await shown.until(lambda: shown.text("messages").count("connected to") == 2)
        await shown.until(lambda: "Observing" in shown.text("banner"))
        assert "let go" in shown.text("jog")


@pytest.mark.parametrize("key", ["ctrl+q", "ctrl+c"])
async def test_the_pendant_is_left_by_its_keys(key: str) -> None:
    async with screen() as shown:
        await shown.keys(key)
        await shown.until(lambda: not shown.pilot.app.is_running)
