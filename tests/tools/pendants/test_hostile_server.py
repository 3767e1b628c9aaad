"""A server that puts escape sequences, markup and turned writing into everything that it says.

No terminal may act on any of it: neither on the output of a command, nor on the full screen.
"""

import asyncio
import io
import json
import unicodedata
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console
from rigs.cells.panel_rig import HELLO, PanelRig, snapshot
from rigs.peers.scripted_pendant_server import DOF, ScriptedPendantServer, scripted_server, state
from textual.widgets import Static

from openpendant import simplemsg as wire
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools import why
from openpendant.tools.pendants.client import NotUnderstood, PendantClient, Refused
from openpendant.tools.pendants.commands import home, reset, run, stop
from openpendant.tools.pendants.demo_pendant import live_table
from openpendant.tools.pendants.panel import lcd
from openpendant.tools.pendants.terminal import cli as pendant
from openpendant.tools.pendants.terminal import screen_text
from openpendant.tools.pendants.terminal.app import PendantApp

pytestmark = pytest.mark.realtime

TITLE = "\x1b]0;x\x07"
SHORT = "\x1b[2J\u202e[b]\x9b"
"""Fits into the shortest field of the wire."""

MARKUP = "[bold red]red[/] [link=http://x]y[/link]"
EVIL = f"{SHORT}{TITLE}{MARKUP}\r\nSTOPPED: all is well\x7f\u2028\u3164"
STACK = "o" + 300 * "\u0336"
"""A letter whose marks paint over the rows around it."""

LONG = 30_000 * "x"


def assert_harmless(text: str, *, longest: int = 4_100) -> None:
    """Assert that a terminal only shows a text, row by row."""
    for row in text.split("\n"):
        assert row.isprintable(), ascii(row)
        assert "\u3164" not in row
        assert len(row) <= longest
        assert not row.lstrip(" >").startswith("STOPPED: all")
        marks = "".join("m" if unicodedata.category(each) == "Mn" else " " for each in row)
        assert "m" * 5 not in marks


def evil_joints() -> list[dict[str, Any]]:
    names = [EVIL, STACK, LONG, "[red]", SHORT, "\x1b[31m"]
    limits = {"unit": "rad", "lower": -2.0, "upper": 2.0, "velocity": 1.0, "acceleration": 1.0}
    return [{"name": name, **limits} for name in names]


def evil_condition(name: str, *, holds: bool) -> dict[str, Any]:
    said = {key: f"{EVIL}{STACK}" for key in ("meaning", "name", "text", "cause", "remedy")}
    return {"condition": name, "holds": holds, "code": 20, **said}


def evil_why(*, ready: bool) -> dict[str, Any]:
    return {
        "cell": EVIL,
        "kind": EVIL,
        "ready": ready,
        "broken": "" if ready else EVIL,
        "conditions": [evil_condition(EVIL, holds=ready), evil_condition("x", holds=True)],
        "ended": {key: EVIL for key in ("text", "cause", "name", "remedy")} | {"code": 149},
        "remarks": [EVIL, LONG],
    }


PROGRAM = {
    "name": EVIL,
    "points": [{"name": EVIL}],
    "statements": [{"statement": "move", "point": EVIL}, {"statement": "wait", "point": LONG}],
}
PROGRAM_TEXT = f"program {SHORT}\nmove {SHORT}[b]\u3164{STACK}\nwait {LONG}"


def make_evil(server: ScriptedPendantServer) -> None:
    server.called = (SHORT, SHORT)
    server.answers |= {
        "why": evil_why(ready=False),
        "snapshot": {
            "robot": EVIL,
            "joints": evil_joints(),
            "frames": ["base", EVIL],
            "program": {"name": EVIL, "state": EVIL, "line": 3, "revision": 2},
            "owner": {"client": EVIL, "session": 9},
            "stop": {"client": EVIL, "reason": EVIL},
        },
        "programs.list": {"programs": [{"name": EVIL}, {"name": SHORT}], "next": None},
        "retreat": {"holds": [{"text": EVIL, "ways": []}]},
    }


def refuse(server: ScriptedPendantServer, *kinds: type[Any]) -> None:
    for kind in kinds:
        server.refusals[kind] = (VerdictCode.STOP_LATCHED, EVIL)


Command = Callable[[list[str]], int]
Said = Callable[..., Awaitable[str]]

COMMANDS: dict[str, tuple[Command, list[str]]] = {
    "home": (home.main, ["--server"]),
    "run": (run.main, ["cutting", "--server"]),
    "reset": (reset.main, ["--yes", "--server"]),
    "stop": (stop.main, ["--server"]),
    "why": (why.main, []),
    "pendant": (pendant.main, ["--plain"]),
}
REFUSABLE = (
    messages.Authority,
    messages.Home,
    messages.ProgramRun,
    messages.ResetStop,
    messages.SoftwareStop,
    messages.Login,
)


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Said:
    """Run a command against a hostile server; all that it wrote."""
    monkeypatch.setenv("OPENPENDANT_PASSWORD", "canary-of-nobody")

    async def begin(name: str, change: Callable[[ScriptedPendantServer], None], *more: str) -> str:
        main, before = COMMANDS[name]
        async with scripted_server() as server:
            make_evil(server)
            change(server)
            where = f"127.0.0.1:{server.port}"
            await asyncio.to_thread(main, [*before, where, *more])
        written = capsys.readouterr()
        return written.out + written.err

    return begin


def obey(server: ScriptedPendantServer) -> None:
    """Leave a server as it is: it does what it is asked."""


def refuse_all(server: ScriptedPendantServer) -> None:
    refuse(server, *REFUSABLE)


def refuse_login(server: ScriptedPendantServer) -> None:
    refuse(server, messages.Login)


def refuse_motion(server: ScriptedPendantServer) -> None:
    refuse(server, messages.Home, messages.ProgramRun, messages.ResetStop, messages.SoftwareStop)


def refuse_hello(server: ScriptedPendantServer) -> None:
    server.cells = (EVIL, SHORT)


def answer_nonsense(server: ScriptedPendantServer) -> None:
    server.answers |= {"why": {"ready": 5, "conditions": EVIL}, "snapshot": {"joints": EVIL}}


ATTACKS = (obey, refuse_all, refuse_login, refuse_motion, refuse_hello, answer_nonsense)


@pytest.mark.parametrize("form", ["for people", "--json"])
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
@pytest.mark.parametrize("name", COMMANDS)
async def test_what_a_server_says_commands_no_terminal(
    name: str, attack: Callable[[ScriptedPendantServer], None], form: str, said: Said
) -> None:
    if name == "pendant" and form == "--json":
        pytest.skip("it has no JSON")
    more = ["--json"] if form == "--json" else []
    if attack is refuse_login:
        if name == "stop":
            pytest.skip("a stop has no login")
        more += ["--user", "ada"]
    text = await said(name, attack, *more)
    assert text.strip()
    assert "Traceback" not in text
    assert "internal error" not in text
    # JSON is for programs, which want all of it.
    assert_harmless(text, longest=4_100 if form == "for people" else 10**6)


async def test_json_says_the_same_as_the_server_all_the_same(
    capsys: pytest.CaptureFixture[str],
) -> None:
    async with scripted_server() as server:
        make_evil(server)
        await asyncio.to_thread(why.main, [f"127.0.0.1:{server.port}", "--json"])
    assert json.loads(capsys.readouterr().out) == evil_why(ready=False)


async def test_a_question_at_the_terminal_is_harmless_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr("sys.stdin", Terminal("n\n"))
    async with scripted_server() as server:
        make_evil(server)
        assert await asyncio.to_thread(reset.main, ["--server", f"127.0.0.1:{server.port}"]) == 1
    asked = capsys.readouterr().err
    assert "Reset the stop by" in asked
    assert_harmless(asked)


# The library: what an app prints of an error.


def test_a_refusal_says_one_harmless_line_and_keeps_what_was_sent() -> None:
    refused = Refused(VerdictCode.STOP_LATCHED, EVIL + LONG, -1, 0.0, 0.0)
    assert refused.text == EVIL + LONG
    for text in (str(refused), refused.explained):
        assert "\n" not in text
        assert_harmless(text, longest=4_500)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\xff",
        b"[]",
        b"5",
        b'{"code": [], "text": "x"}',
        b'{"code": 20, "text": 5}',
        b'{"code": 20, "text": "x", "joint": "y"}',
        b'{"code": 20, "text": "x", "value": {}}',
        b"[" * 20_000,
    ],
)
@pytest.mark.parametrize("code", [wire.ReplyCode.SUCCESS, wire.ReplyCode.FAILURE])
async def test_an_answer_that_is_none_is_an_error_of_the_library(
    body: bytes, code: wire.ReplyCode
) -> None:
    class Nonsense(ScriptedPendantServer):
        def _manage(self, message: messages.Management) -> None:
            reply = wire.CommType.REPLY
            self.send(replace(message, body=body, comm_type=reply, reply_code=code))

    async with scripted_server(make=Nonsense) as server:
        async with await PendantClient.connect(port=server.port) as client:
            if body.startswith(b"{") and code == wire.ReplyCode.SUCCESS:
                assert await client.why() == json.loads(body)
                return
            with pytest.raises(NotUnderstood):
                await client.why()


# The full screen.


def test_no_text_of_the_screen_commands_the_terminal(rig: PanelRig) -> None:
    panel = rig.panel
    owner = {"client": EVIL, "session": 9}
    panel.cell.connected(HELLO, snapshot(joints=evil_joints(), frames=["base", EVIL], owner=owner))
    panel.cell.robot, panel.cell.cell = EVIL, LONG
    changes: list[Callable[[], object]] = [
        lambda: panel.cell.take_state(state(1), rig.now),
        lambda: panel.messages.add(EVIL + LONG),
        lambda: panel.messages.add(EVIL),
        lambda: panel.explained((EVIL, LONG, *(1_000 * [STACK]))),
        lambda: panel.jog.turn_frame(2),
        lambda: panel.cell.stop_changed(
            messages.StopChanged(stop=1, session=9, client=SHORT, reason=EVIL[:60])
        ),
        lambda: panel.cell.take_state(replace(state(2), stop=1), rig.now),
        lambda: panel.turned_away(EVIL + LONG),
        lambda: panel.lost(EVIL + LONG),
    ]
    for change in changes:
        change()
        shown = [
            screen_text.lamp_line(panel, rig.now),
            screen_text.banner(panel, rig.now),
            screen_text.status_line(panel, rig.now),
            screen_text.jog_line(panel, rig.now),
            screen_text.joint_table(panel),
            screen_text.program_list(panel),
            screen_text.message_list(panel, 6, 80),
            "\n".join(lcd.page(panel, rig.now)),
        ]
        for text in shown:
            assert_harmless(text, longest=440)
        assert len(screen_text.joint_table(panel).split("\n")) == DOF
        assert len(screen_text.status_line(panel, rig.now).split("\n")) == 1
        assert len(screen_text.banner(panel, rig.now).split("\n")) == 1


async def test_the_running_screen_shows_markup_as_it_is_and_acts_on_nothing() -> None:
    async with scripted_server() as server:
        make_evil(server)
        body = {"revision": 2, "next": None}

        class Forms(dict[str, dict[str, Any]]):
            def get(self, key: str, default: Any = None) -> Any:
                if key != "programs.load":
                    return super().get(key, default)
                asked = json.loads(server.all(messages.Management)[-1].body)
                is_text = asked["format"] == "text"
                return {**body, "body": PROGRAM_TEXT if is_text else json.dumps(PROGRAM)}

        server.answers = Forms(server.answers)
        app = PendantApp(lambda: PendantClient.connect(port=server.port, state_rate=25))
        async with app.run_test(size=(100, 40)) as pilot:

            def text(name: str) -> str:
                return str(app.screen.query_one(f"#{name}", Static).content)

            async def until(holds: Callable[[], object]) -> None:
                async with asyncio.timeout(20):
                    while not holds():
                        await pilot.pause(0.02)

            await until(lambda: "[red]" in text("joints"))
            server.send(messages.AuthorityWanted(session=9, client=SHORT))
            server.send(messages.AuthorityChanged(holder=9, reason=1, client=SHORT))
            server.send(messages.StopChanged(stop=1, session=9, client=SHORT, reason=SHORT))
            server.send(
                messages.ProgramReport(
                    state=1, line=2, loop=1, revision=2, program=EVIL[:20], text=EVIL[:60]
                )
            )
            refuse(server, messages.JogStep, messages.SetMode)
            await pilot.press("question_mark")
            await until(lambda: any("move" in line or "jog" in line for line in panel_why(app)))
            await pilot.press("n")
            await until(lambda: "type a part" in text("program"))
            await pilot.press("enter")
            await until(lambda: "revision 2" in text("program"))
            await pilot.press("space")
            await until(lambda: server.all(messages.SoftwareStop))
            await pilot.press("m", "1")
            await until(lambda: "STOP_LATCHED" in text("messages"))
            names = ("lamps", "status", "banner", "lcd", "jog", "joints", "program", "messages")
            for name in names:
                assert_harmless(text(name), longest=1_100)
            # What the widgets really draw, style by style: nothing is a link or bold by a server.
            for name in ("joints", "program", "messages"):
                for strip in range(app.screen.query_one(f"#{name}", Static).region.height):
                    line = app.screen.query_one(f"#{name}", Static).render_line(strip)
                    assert all(not (part.style and part.style.link) for part in line)
                    assert_harmless(line.text)


def panel_why(app: PendantApp) -> tuple[str, ...]:
    return app.panel.why


@pytest.mark.parametrize(
    "told",
    [
        {},
        {"joints": 5},
        {"joints": [{"name": "a"}]},
        {"joints": [{"name": "a", "unit": "rad", "lower": "x", "upper": 1.0}]},
        {"joints": [{"name": "a", "unit": "inch", "lower": 0.0, "upper": 1.0}]},
        {"joints": 11 * [{"name": "a", "unit": "rad", "lower": 0.0, "upper": 1.0}]},
        {"joints": [], "frames": [], "program": 5, "owner": None, "stop": None},
        {"joints": [], "frames": [], "program": None, "owner": 5, "stop": None},
    ],
)
def test_a_snapshot_that_cannot_be_read_is_told_and_ends_no_pendant(
    told: Any, rig: PanelRig
) -> None:
    before = (rig.panel.cell.joints, rig.panel.cell.owner)
    with pytest.raises(NotUnderstood, match="the server's snapshot cannot be read"):
        rig.panel.cell.connected(HELLO, told)
    assert (rig.panel.cell.joints, rig.panel.cell.owner) == before


def test_a_joint_whose_limits_are_the_same_is_drawn(rig: PanelRig) -> None:
    stuck = {"name": "a", "unit": "rad", "lower": 1.0, "upper": 1.0}
    rig.panel.cell.connected(HELLO, snapshot(joints=6 * [stuck]))
    rig.panel.cell.take_state(state(1), rig.now)
    assert "1 a" in screen_text.joint_table(rig.panel)


def test_the_demo_s_table_takes_a_joint_s_name_for_no_markup() -> None:
    joints = evil_joints()
    console = Console(file=io.StringIO(), width=200, force_terminal=True, no_color=True)
    console.print(live_table(state(1), joints, "[bold]doing"))  # type: ignore[arg-type]  # a server's
    assert isinstance(console.file, io.StringIO)
    shown = console.file.getvalue()
    assert "[red]" in shown
    assert "[bold]doing" in shown
    assert "\x1b]0;" not in shown
    assert "\x1b[2J" not in shown
    assert "\u202e" not in shown
