"""The commands of an operator: arguments, exit codes, authority, and what an interrupt does.

The connection is a scripted one; `tests/system/test_operator_commands.py` has a running cell.
"""

from __future__ import annotations

import asyncio
import io
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants import client
from openpendant.tools.pendants.commands import home, reset, run, running, stop
from openpendant.tools.pendants.motions import MotionResult

LATCHED = {"client": "ann", "reason": "tea"}


def refused(code: V) -> client.Refused:
    return client.Refused(code, "so it is", -1, 0.0, 0.0)


@dataclass
class Scripted:
    """A connection that does what a test says, and keeps what was asked of it.

    Attributes:
        fails: what an operation raises, by its name.
        asked: the operations, in order.
        latched: the stop of each snapshot in turn; the last one stays.
        takes: how long the motion takes [s].
        targets: the named positions that were asked for, in order.
        motion_time: what the outcome says of it [s].
    """

    fails: dict[str, BaseException] = field(default_factory=dict)
    asked: list[str] = field(default_factory=list)
    latched: list[dict[str, str] | None] = field(default_factory=lambda: [LATCHED])
    takes: float = 0.0
    targets: list[str] = field(default_factory=list)
    motion_time: float = 1.0
    state: None = None

    async def __aenter__(self) -> Scripted:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.asked.append("leave")

    def __getattr__(self, operation: str) -> Callable[..., Awaitable[None]]:
        """Return any other operation: it is asked for, and answers nothing."""
        return lambda *_, **__: self.do(operation)

    async def do(self, what: str) -> None:
        self.asked.append(what)
        if what in self.fails:
            raise self.fails[what]

    @asynccontextmanager
    async def control(self) -> AsyncIterator[None]:
        await self.do("control")
        yield
        self.asked.append("release")

    async def snapshot(self) -> dict[str, Any]:
        await self.do("snapshot")
        return {"stop": self.latched.pop(0) if len(self.latched) > 1 else self.latched[0]}

    async def stop(self, reason: str) -> None:
        assert len(reason.encode()) <= 64
        assert reason.isprintable()
        await self.do("stop")

    async def home(self, target: str, speed: float) -> Scripted:
        await self.do("home")
        self.targets.append(target)
        return self

    async def over_within(self, seconds: float) -> bool:
        await asyncio.sleep(self.takes)
        return True

    async def done(self) -> MotionResult:
        await self.do("done")
        return MotionResult(0.1, self.motion_time)


@pytest.fixture
def pendant(monkeypatch: pytest.MonkeyPatch) -> Scripted:
    it = Scripted()

    async def connect(*_: object, **__: object) -> Scripted:
        await it.do("connect")
        return it

    monkeypatch.setattr(client.PendantClient, "connect", connect)
    return it


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    return lambda line: monkeypatch.setattr("sys.stdin", Terminal(line))


def test_a_server_that_says_nothing_ends_a_command_with_69(
    pendant: Scripted, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def silent(*_: object, **__: object) -> None:
        await asyncio.sleep(0.5)
        raise client.ConnectionLost("it ended")

    monkeypatch.setattr(client.PendantClient, "connect", silent)
    monkeypatch.setattr(running, "CONNECT_WITHIN", 0.01)
    assert home.main([]) == 69
    assert "no answer within 0.01 s" in capsys.readouterr().err


@pytest.mark.parametrize(("code", "ends"), [(V.UNKNOWN_CELL, 2), (V.LOGIN_NEEDED, 69)])
def test_what_a_server_refuses_at_the_door_has_its_exit_code(
    pendant: Scripted, code: V, ends: int
) -> None:
    pendant.fails["connect"] = refused(code)
    assert home.main([]) == ends


def test_who_interrupts_a_command_gets_130(pendant: Scripted) -> None:
    pendant.fails["connect"] = KeyboardInterrupt()
    assert reset.main(["--yes"]) == 130


def test_what_cannot_be_used_is_wrong_usage(pendant: Scripted) -> None:
    pendant.fails["connect"] = client.WrongArgument("too long")
    assert home.main([]) == 2


def test_text_of_others_does_not_command_the_terminal(
    pendant: Scripted, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant.latched = [{"client": "\x1b[2J", "reason": "\r\n"}]
    assert reset.main(["--yes"]) == 0
    assert "the stop by ?[2J (??) is reset" in capsys.readouterr().out


# Stop.


def test_a_stop_that_nobody_confirms_ends_with_69_and_names_the_emergency_stop(
    pendant: Scripted, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def unanswered(_: str) -> None:
        await asyncio.sleep(0.5)

    monkeypatch.setattr(pendant, "stop", unanswered)
    monkeypatch.setattr(stop, "_WITHIN", 0.01)
    assert stop.main([]) == 69
    told = capsys.readouterr().err
    assert "no answer within 0.01 s" in told
    assert "use the controller's own emergency stop" in told


@pytest.mark.parametrize("reason", ["x" * 65, "ü" * 40, "a\nb", "\udcff", ""])
def test_no_reason_keeps_a_stop_from_being_sent(pendant: Scripted, reason: str) -> None:
    assert stop.main(["--reason", reason]) == 0
    assert pendant.asked[:2] == ["connect", "stop"]


def test_a_stop_takes_no_authority(pendant: Scripted) -> None:
    stop.main([])
    assert pendant.asked == ["connect", "stop", "leave"]


# Reset.


@pytest.mark.parametrize(
    ("line", "ends", "resets"),
    [
        ("y\n", 0, 1),
        ("YES\n", 0, 1),
        ("n\n", 1, 0),
        ("\n", 1, 0),
        ("", 1, 0),
        ("yellow\n", 1, 0),
    ],
)
def test_a_reset_asks_and_resets_only_for_a_yes(
    pendant: Scripted, typed: Callable[[str], None], line: str, ends: int, resets: int
) -> None:
    typed(line)
    assert reset.main([]) == ends
    assert pendant.asked.count("reset_stop") == resets


def test_a_reset_that_can_ask_nobody_is_wrong_usage(
    pendant: Scripted, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    assert reset.main([]) == 2
    assert "reset_stop" not in pendant.asked


def test_a_stop_that_was_latched_while_a_person_thought_stays(
    pendant: Scripted, typed: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    typed("y\n")
    pendant.latched = [LATCHED, {"client": "bob", "reason": "a hand"}]
    assert reset.main([]) == 1
    assert "another stop was latched meanwhile, by bob (a hand)" in capsys.readouterr().err
    assert "reset_stop" not in pendant.asked


@pytest.mark.parametrize("operation", ["control", "reset_stop"])
def test_a_reset_that_is_refused_ends_with_1(pendant: Scripted, operation: str) -> None:
    pendant.fails[operation] = refused(V.HELD_BY_OTHER)
    assert reset.main(["--yes"]) == 1


# Motion.


def test_the_authority_is_held_around_what_needs_it(pendant: Scripted) -> None:
    reset.main(["--yes"])
    home.main([])
    asked = [what for what in pendant.asked if what not in ("connect", "snapshot", "leave")]
    assert asked == ["control", "reset_stop", "release", "control", "home", "done", "release"]


@pytest.mark.parametrize(
    ("operation", "failure", "ends"),
    [
        ("nothing", refused(V.MOVING), 0),
        ("control", refused(V.HELD_BY_OTHER), 1),
        ("home", refused(V.STOP_LATCHED), 1),
        ("home", refused(V.NO_MOTION), 0),
        ("done", client.Aborted(V.STOPPED, "", -1, 0.0, 0.0), 1),
        ("done", client.ConnectionLost("it is gone"), 69),
    ],
)
def test_a_motion_ends_with_the_code_of_its_outcome(
    pendant: Scripted, operation: str, failure: BaseException, ends: int
) -> None:
    pendant.fails[operation] = failure
    assert home.main([]) == ends


@pytest.fixture
def interrupted(pendant: Scripted, monkeypatch: pytest.MonkeyPatch) -> Scripted:
    """A motion amid which somebody presses Ctrl-C."""

    async def over_within(_: float) -> bool:
        task = asyncio.current_task()
        assert task is not None
        task.cancel()
        await asyncio.sleep(1.0)
        return True

    monkeypatch.setattr(pendant, "over_within", over_within)
    return pendant


def test_who_interrupts_a_motion_has_the_robot_stopped_and_gets_130(interrupted: Scripted) -> None:
    assert home.main([]) == 130
    since = interrupted.asked.index("home")
    assert interrupted.asked[since + 1 :] == ["program_stop", "wait_until", "release", "leave"]


@pytest.mark.parametrize(
    ("code", "asked"), [(V.NOTHING_TO_CONTROL, []), (V.HELD_BY_OTHER, ["stop"])]
)
def test_who_cannot_end_a_motion_stops_the_robot(
    interrupted: Scripted, code: V, asked: list[str]
) -> None:
    interrupted.fails["program_stop"] = refused(code)
    assert home.main([]) == 130
    assert [what for what in interrupted.asked if what == "stop"] == asked


def test_a_robot_that_is_not_seen_at_rest_is_stopped_again_and_told_of(
    interrupted: Scripted, capsys: pytest.CaptureFixture[str]
) -> None:
    interrupted.fails["wait_until"] = client.StateSilent("no states come")
    assert home.main([]) == 69
    assert "stop" in interrupted.asked
    assert "look at the robot" in capsys.readouterr().err


Main = Callable[[list[str]], int]

COMMANDS: dict[str, tuple[Main, list[str]]] = {
    "stop": (stop.main, []),
    "reset": (reset.main, ["--yes"]),
    "home": (home.main, []),
    "run": (run.main, ["cutting"]),
}


@pytest.fixture
def nobody(unused_tcp_port: int) -> list[str]:
    return ["--server", f"127.0.0.1:{unused_tcp_port}"]


@pytest.mark.parametrize("name", COMMANDS)
def test_nobody_there_is_a_sentence_and_exit_code_69(
    name: str, nobody: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main, more = COMMANDS[name]
    assert main([*more, *nobody]) == 69
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"openpendant {name}: nobody listens at 127.0.0.1:")


def test_a_stop_that_reached_nobody_names_the_emergency_stop(
    nobody: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    stop.main(nobody)
    assert "use the controller's own emergency stop" in capsys.readouterr().err


@pytest.mark.parametrize("name", COMMANDS)
def test_json_tells_a_failure_as_one_object(
    name: str, nobody: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main, more = COMMANDS[name]
    main([*more, *nobody, "--json"])
    assert json.loads(capsys.readouterr().out)["event"] == "unavailable"


NO_SERVERS = ("127.0.0.1:0", ":11010", "host:port", "host:65536")
NO_SPEEDS = ("0", "1.01", "-0.1", "nan", "fast")


@pytest.mark.parametrize(
    ("name", "option", "wrong"),
    [
        *((name, "--server", wrong) for name in COMMANDS for wrong in NO_SERVERS),
        *((name, "--speed", wrong) for name in ("home", "run") for wrong in NO_SPEEDS),
        ("stop", "--user", "otto"),
    ],
)
def test_what_is_no_server_no_speed_or_no_option_is_wrong_usage(
    name: str, option: str, wrong: str
) -> None:
    main, more = COMMANDS[name]
    with pytest.raises(SystemExit) as ended:
        main([*more, option, wrong])
    assert ended.value.code == 2


@pytest.mark.parametrize(
    ("arguments", "target"),
    [
        ([], "home"),
        (["park"], "park"),
        (["--to", "zero"], "zero"),
        (["over the bin"], "over the bin"),
    ],
)
def test_home_goes_to_the_position_that_is_named(
    pendant: Scripted, arguments: list[str], target: str
) -> None:
    assert home.main(arguments) == 0
    assert pendant.targets == [target]


def test_a_position_is_named_once(pendant: Scripted, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        home.main(["park", "--to", "zero"])
    assert ended.value.code == 2
    assert "one of them is enough" in capsys.readouterr().err


def test_a_robot_that_is_there_already_is_told_so(
    pendant: Scripted, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant.motion_time = 0.0
    assert home.main([]) == 0
    assert "the robot is there already" in capsys.readouterr().out
