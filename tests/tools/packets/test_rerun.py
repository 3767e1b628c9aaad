"""Journals that are run again: all of it, a part, what is no journal; and what is compared."""

import asyncio
import io
import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.journalled_cell import PINGS, deaf_peers, journalled_cell
from rigs.clock.virtual_clock import VirtualLoop

from openpendant.simplemsg.pendant import OperatorAction
from openpendant.tools.packets.journals.journal_file import (
    BytesOut,
    Effect,
    GrantedQuestion,
    Header,
    JournalError,
    JournalEvent,
    JournalFile,
)
from openpendant.tools.packets.journals.reenactment import Difference, ReplayedJournal
from openpendant.tools.packets.rerun import main
from openpendant.tools.pendants.client import Aborted, Refused


@pytest.fixture(scope="module", params=[20.0, pytest.param(60.0, marks=pytest.mark.soak)])
def seconds(request: pytest.FixtureRequest) -> float:
    """How long the journals are."""
    asked: float = request.param
    return asked


@pytest.fixture(scope="module")
def journals(seconds: float, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """All there is: moves, a planned path, a refusal, stops, bursts, peers gone deaf."""
    folder = tmp_path_factory.mktemp("journals")
    files = {kind: folder / f"{kind}.journal" for kind in ("emulator", "server")}

    async def live() -> None:
        async with journalled_cell(files["emulator"], files["server"]) as cell:
            pendant = await cell.pendant()
            async with deaf_peers(cell), pendant, pendant.control():
                home = pendant.joints()
                aside = [home[0] + 0.5, *home[1:]]
                path = [aside, [aside[0], home[1] + 0.3, *home[2:]], list(home)]
                for _ in range(5):
                    await (await pendant.move_joints(aside, speed=0.2)).done()
                    await (await pendant.follow_joints(path, speed=0.2)).done()
                with pytest.raises(Refused):
                    await pendant.move_joints([9.0, *home[1:]])
                asked = [pendant.kinematics.fk() for _ in range(6)]
                *answered, refused = await asyncio.gather(*asked, return_exceptions=True)
                assert isinstance(refused, Refused)
                assert not any(isinstance(each, Exception) for each in answered)
                motion = await pendant.move_joints(aside, speed=0.05)
                await asyncio.sleep(1.0)
                await pendant.stop("enough")
                with pytest.raises(Aborted):
                    await motion.done()
                await pendant.wait_until(lambda state: not state.activity)
                await pendant.reset_stop()
                motion = await pendant.move_joints(home, speed=0.05)
                await asyncio.sleep(0.5)
                cell.service.operate(OperatorAction.EMERGENCY_STOP)
                with pytest.raises(Aborted):
                    await motion.done()
                await asyncio.sleep(began + seconds - loop.time())

    loop = VirtualLoop()
    began = loop.time()
    with pytest.MonkeyPatch.context() as patch:
        # The kernel's clock is not virtual: on a slow machine it would cut the deaf peers off.
        patch.delattr(socket, "TCP_USER_TIMEOUT", raising=False)
        loop.run_until_complete(live())
    loop.close()
    return files


def _state(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> dict[str, Any]:
    assert main([*arguments, "--json"]) == 0
    report: dict[str, Any] = json.loads(capsys.readouterr().out)
    state: dict[str, Any] = report["state"]
    return state


@pytest.mark.parametrize("kind", ["emulator", "server"])
def test_all_of_it_runs_again_with_identical_bytes(
    journals: dict[str, Path], seconds: float, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(journals[kind]), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["identical"]
    assert report["of"] == kind
    assert report["duration"] > seconds - 1.0
    lines = [json.loads(line) for line in journals[kind].read_text().splitlines()]
    assert report["events"] == sum("on" in line for line in lines)
    assert report["bytes_out"] == sum(len(line["hex"]) // 2 for line in lines if "out" in line)


@pytest.mark.parametrize("kind", ["emulator", "server"])
@pytest.mark.parametrize("answer", ["clogged", "flooded"])
def test_the_journals_hold_what_the_system_answered(
    journals: dict[str, Path], kind: str, answer: str
) -> None:
    assert f'"ask": "{answer}"' in journals[kind].read_text()


def test_the_journals_hold_plans_motions_and_both_stops(journals: dict[str, Path]) -> None:
    server = journals["server"].read_text()
    assert server.count('"on": "planned"') >= 5
    assert '"on": "operate"' in journals["emulator"].read_text()


def test_the_state_in_motion_is_between_those_at_rest(
    journals: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(journals["emulator"])
    first = _state(capsys, [file, "--until", "0"])
    moving = _state(capsys, [file, "--until", "0.7"])
    assert first["joint_velocity"] == [0.0] * 6
    assert 0 < moving["joint_position"][0] - first["joint_position"][0] < 0.5
    assert moving["joint_velocity"][0] > 0
    assert moving["status"]["in_motion"] == 1


def test_the_server_knows_the_emergency_stop_at_the_end(
    journals: dict[str, Path], seconds: float, capsys: pytest.CaptureFixture[str]
) -> None:
    state = _state(capsys, [str(journals["server"]), "--until", str(seconds - 5.0)])
    assert state["controller_status"]["e_stopped"] == 1
    assert state["owner"] is not None
    assert state["clients"]


def test_an_event_can_be_named_by_its_number(
    journals: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(journals["server"]), "--until", "#100", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["events"] == 100


def _tampered(source: Path, target: Path, change: Callable[[list[str]], None]) -> Path:
    lines = source.read_text().splitlines(keepends=True)
    change(lines)
    target.write_text("".join(lines))
    return target


def _nth(lines: list[str], words: str, number: int) -> int:
    return [at for at, line in enumerate(lines) if words in line][number]


def _flip_last_byte(line: str) -> str:
    packet = json.loads(line)
    data = bytearray.fromhex(packet["hex"])
    data[-1] ^= 1
    return json.dumps(packet | {"hex": data.hex()}) + "\n"


def test_one_changed_bit_of_a_write_is_found_where_it_is(
    journals: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(lines: list[str]) -> None:
        at = _nth(lines, '"out": "motion"', 200)
        lines[at] = _flip_last_byte(lines[at])

    assert main([str(_tampered(journals["server"], tmp_path / "changed", change))]) == 1
    told = capsys.readouterr().out
    assert "DIFFERENCE" in told
    assert "first different byte: 151" in told
    assert "joint_traj_pt_full" in told


@pytest.mark.parametrize("kind", ["emulator", "server"])
def test_a_changed_bit_of_what_came_in_shows_in_what_leaves(
    journals: dict[str, Path], kind: str, tmp_path: Path
) -> None:
    source = '"link": "state"' if kind == "server" else '"link": "1", "hex": "94'

    def change(lines: list[str]) -> None:
        # The highest byte of the first joint of a feedback message, or of a point.
        at = _nth(lines, source, 150 if kind == "server" else 60)
        packet = json.loads(lines[at])
        data = bytearray.fromhex(packet["hex"])
        data[91 if kind == "server" else 35] ^= 0x40
        lines[at] = json.dumps(packet | {"hex": data.hex()}) + "\n"

    assert main([str(_tampered(journals[kind], tmp_path / "changed", change))]) == 1


def test_a_write_that_is_missing_now_is_a_difference(
    journals: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(lines: list[str]) -> None:
        at = _nth(lines, '"out": "1"', 50)
        lines.insert(at, lines[at])

    assert main([str(_tampered(journals["server"], tmp_path / "more", change))]) == 1
    assert "now:  " in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["emulator", "server"])
@pytest.mark.parametrize("cut", range(297, 310))
def test_a_journal_without_its_end_runs_up_to_its_last_whole_event(
    journals: dict[str, Path],
    kind: str,
    cut: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    lines = journals[kind].read_bytes().splitlines(keepends=True)
    file = tmp_path / "cut"
    file.write_bytes(b"".join(lines[:cut]) + lines[cut][:20])
    assert main([str(file)]) == 0
    assert "has no end" in capsys.readouterr().err


def test_what_a_process_put_off_does_not_happen_by_itself(
    journals: dict[str, Path], caplog: pytest.LogCaptureFixture
) -> None:
    """A client that sent more than 64 frames at once leaves a callback behind in every process."""
    for file in journals.values():
        lines = file.read_text().splitlines()
        burst = _nth(lines, PINGS[: 16 * 65].hex(), 0)
        events = [line for line in lines[: burst + 1] if '"on"' in line]
        assert main([str(file), "--until", f"#{len(events)}"]) == 0
    assert caplog.records == []


HEADER = {
    "format": "openpendant-journal/1",
    "of": "emulator",
    "version": "0",
    "started": "",
    "now": 1,
    "settings": {"robot": "ur5"},
}
END = {"end": True}


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "no journal"),
        (["not JSON"], "line 1: no JSON"),
        (["[]"], "no JSON object"),
        ([{"format": "other"}], "no journal"),
        ([HEADER | {"of": "toaster"}], "toaster"),
        ([HEADER | {"now": "1"}], "now is missing or of the wrong kind"),
        ([HEADER | {"settings": {"robot": "nobody"}}], "nobody"),
        ([HEADER | {"settings": {"rate": -1}}], "rate"),
        ([HEADER | {"of": "server", "settings": {"tick_rate": "x"}}], "tick_rate"),
        ([HEADER, {"t": 1, "on": "tick", "link": "1"}, END], "hex is missing"),
        ([HEADER, {"t": 1, "on": "tick", "link": "1", "hex": "zz"}, END], "no hexadecimal digits"),
        ([HEADER, {"t": 1, "on": "dance", "link": "1", "hex": ""}, END], "dance"),
        ([HEADER, {"t": 1, "on": "in", "link": "7", "hex": ""}, END], "link 7 was never opened"),
        ([HEADER, {"t": 1, "on": "tick", "link": "x", "hex": ""}, END], "not known"),
    ],
)
def test_what_is_no_journal_is_refused_in_one_line(
    lines: list[Any], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    texts = [line if isinstance(line, str) else json.dumps(line) for line in lines]
    file.write_text("".join(text + "\n" for text in texts))
    assert main([str(file)]) == 2
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1


def test_a_missing_file_is_a_usage_error(tmp_path: Path) -> None:
    assert main([str(tmp_path / "none")]) == 2


@pytest.mark.parametrize("until", ["soon", "-1", "nan", "#x", "#0", "#-3"])
def test_a_wrong_end_is_a_usage_error(until: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["file", "--until", until]) == 2
    assert "expected seconds" in capsys.readouterr().err


# Which events of a journal are run again, and what a difference does to the end.


WRITE = {"out": "1", "hex": "00ff"}
QUESTION = {"ask": "clogged", "link": "1"}


def tick(time: int) -> dict[str, Any]:
    return {"t": time, "on": "tick", "link": "1", "hex": ""}


def journal(*lines: dict[str, Any] | str) -> bytes:
    texts = [line if isinstance(line, str) else json.dumps(line) for line in (HEADER, *lines)]
    return "".join(f"{text}\n" for text in texts).encode()


def read(content: bytes) -> tuple[list[tuple[int, tuple[BytesOut | GrantedQuestion, ...]]], bool]:
    """Return the times of the events with what followed from each, and whether the end is cut."""
    file = JournalFile(Path("journal"), io.BytesIO(content))
    happened = [(each.time, each.effects) for each in file.happenings()]
    return happened, file.is_cut


def test_every_event_of_a_whole_journal_happens_with_all_that_followed() -> None:
    happened, is_cut = read(journal(tick(1), WRITE, QUESTION, tick(2), WRITE, END))
    write = BytesOut("1", b"\x00\xff")
    assert happened == [(1, (write, GrantedQuestion("clogged", "1"))), (2, (write,))]
    assert not is_cut


def test_the_last_event_of_a_journal_without_its_end_is_left_out_and_that_is_told() -> None:
    assert read(journal(tick(1), WRITE, tick(2))) == ([(1, (BytesOut("1", b"\x00\xff"),))], True)


def test_a_damaged_line_is_told_and_not_passed_over() -> None:
    with pytest.raises(JournalError, match="line 3: no JSON"):
        read(journal(tick(1), '{"out": "1", "he', tick(2), END))


@pytest.mark.parametrize(("effects", "code"), [([], 0), ([WRITE], 1)])
def test_a_run_in_which_a_write_is_missing_ends_as_one_with_findings(
    effects: list[dict[str, Any]], code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    opened = {"t": 1, "on": "opened", "link": "1", "hex": "", "port": "motion"}
    file = tmp_path / "journal"
    file.write_bytes(journal(opened, *effects, END))
    assert main([str(file)]) == code
    assert ("DIFFERENCE" in capsys.readouterr().out) == bool(code)


REPLAYED = Header("server", "0", "", 1_000, {})
HELLO, POINT = b"hello", b"point"


def played(
    effects: tuple[Effect, ...], play: Callable[[ReplayedJournal], object]
) -> ReplayedJournal:
    """Play a begin_tick on link 1, 7 ns after the start, from which some effects followed then."""
    replayed = ReplayedJournal(REPLAYED)
    with replayed.expecting(JournalEvent(1, 7, "tick", "1", b"", {}, effects)):
        play(replayed)
    return replayed


def begin_tick(replayed: ReplayedJournal) -> None:
    replayed.begin(replayed.now, "tick", 1)


def write(replayed: ReplayedJournal, link: str = "motion", data: bytes = POINT) -> None:
    begin_tick(replayed)
    replayed.out(link, data)


def test_what_left_then_and_leaves_now_is_counted() -> None:
    replayed = played((BytesOut("motion", POINT),), write)
    assert (replayed.frames, replayed.bytes_out) == (1, len(POINT))


def test_the_time_of_an_event_is_that_of_the_journal() -> None:
    assert played((), begin_tick).now == 1_007


def write_other_bytes(replayed: ReplayedJournal) -> None:
    write(replayed, data=HELLO)


def write_to_another_link(replayed: ReplayedJournal) -> None:
    write(replayed, link="state")


def write_twice(replayed: ReplayedJournal) -> None:
    write(replayed)
    replayed.out("motion", POINT)


def another_event(replayed: ReplayedJournal) -> None:
    replayed.begin(replayed.now, "in", 1)
    replayed.out("motion", POINT)


def the_event_of_another_link(replayed: ReplayedJournal) -> None:
    replayed.begin(replayed.now, "tick", 2)
    replayed.out("motion", POINT)


def the_event_twice(replayed: ReplayedJournal) -> None:
    write(replayed)
    replayed.begin(replayed.now, "tick", 1)


@pytest.mark.parametrize(
    "play",
    [
        begin_tick,
        write_other_bytes,
        write_to_another_link,
        write_twice,
        another_event,
        the_event_of_another_link,
        the_event_twice,
    ],
    ids=lambda play: play.__name__,
)
def test_whatever_is_missing_more_or_other_is_a_difference(
    play: Callable[[ReplayedJournal], object],
) -> None:
    with pytest.raises(Difference):
        played((BytesOut("motion", POINT),), play)


def test_an_event_that_does_not_happen_is_a_difference_even_if_nothing_followed() -> None:
    with pytest.raises(Difference):
        played((), lambda replayed: None)


@pytest.mark.parametrize("wrong", ["motion", "state"])
def test_two_writes_must_leave_in_their_order(wrong: str) -> None:
    effects = (BytesOut("motion", POINT), BytesOut("state", POINT))

    def swapped(replayed: ReplayedJournal) -> None:
        write(replayed, link="state")
        replayed.out(wrong, POINT)

    with pytest.raises(Difference):
        played(effects, swapped)


def test_the_world_answers_as_it_did_then_and_each_question_once() -> None:
    answers: list[bool] = []

    def ask(replayed: ReplayedJournal) -> None:
        begin_tick(replayed)
        for question, link in (("flooded", 1), ("clogged", 2), ("clogged", 1), ("clogged", 1)):
            answers.append(replayed.answer(question, link, False))

    played((GrantedQuestion("clogged", "1"),), ask)
    assert answers == [False, False, True, False]
