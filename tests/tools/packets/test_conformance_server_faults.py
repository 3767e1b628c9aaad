"""Planted faults of servers and their pendant port: each is found by the checks made for it."""

import asyncio
import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest
from rigs.faults.faulty_pendant_servers import PENDANT_FAULTS, PendantFault
from rigs.faults.faulty_servers import Fault, checks_named, judged, words_of
from rigs.faults.server_faults import SERVER_FAULTS, UNFOUND
from rigs.peers.scripted_motoman import MOTOMAN_FAULTS, judged_motoman
from rigs.processes.judged_server import HALF_RATE, HOST, running_server

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import AuthorityBeat, State
from openpendant.tools.packets.conformance.check import (
    CheckVerdict,
    Judgement,
    Profile,
    RuleBroken,
    Section,
)
from openpendant.tools.packets.conformance.server.checks import server_checks
from openpendant.tools.packets.conformance.server.pendant import (
    PendantConversation,
    stranger,
    welcomed,
)
from openpendant.tools.packets.conformance.server.runner import judge
from openpendant.tools.packets.conformance.server.target import Options, Target

pytestmark = pytest.mark.virtual_clock


def each_fault() -> Iterator[Any]:
    """The faults; those that only checks find which another fault tries already wait for CI."""
    tried: set[str] = set()
    for fault in SERVER_FAULTS:
        marks = [pytest.mark.conformance] if tried.issuperset(fault.found_by) else []
        tried.update(fault.found_by)
        yield pytest.param(fault, marks=marks, id=fault.name.replace(" ", "-"))


@pytest.mark.parametrize("fault", list(each_fault()))
async def test_a_planted_fault_is_found(fault: Fault) -> None:
    judgement = await judged(fault, checks_named(fault.found_by))
    assert [result.finding.verdict for result in judgement.results] == [
        fault.verdict for _ in fault.found_by
    ], words_of(judgement, *CheckVerdict)


@pytest.mark.conformance
@pytest.mark.parametrize(("fault", "reason"), UNFOUND, ids=lambda value: getattr(value, "name", ""))
async def test_a_fault_that_is_listed_as_not_found_is_not(fault: Fault, reason: str) -> None:
    judgement = await judged(fault)
    assert reason
    assert words_of(judgement, CheckVerdict.FAILED, CheckVerdict.DEVIATES) == []


async def test_at_least_ninety_five_of_a_hundred_faults_are_found() -> None:
    assert len(SERVER_FAULTS) + len(MOTOMAN_FAULTS) >= 45
    assert len(UNFOUND) <= 0.05 * len(SERVER_FAULTS)


async def test_a_sound_motoman_controller_passes() -> None:
    judgement = await judged_motoman()
    assert words_of(judgement, CheckVerdict.FAILED, CheckVerdict.DEVIATES) == []
    assert judgement.count(CheckVerdict.PASSED) > 30


@pytest.mark.parametrize("fault", MOTOMAN_FAULTS)
async def test_a_fault_of_a_motoman_controller_is_found(fault: str) -> None:
    number, verdict = MOTOMAN_FAULTS[fault]
    judgement = await judged_motoman(fault, number)
    assert [result.finding.verdict for result in judgement.results] == [verdict]


STATE = State.PLACE.msg_type


async def judged_port(*numbers: str) -> Judgement:
    async with running_server(HALF_RATE) as options:
        alone = replace(options, profile=Profile.PENDANT)
        return await judge(alone, checks=checks_named(list(numbers)))


@pytest.mark.parametrize("fault", PENDANT_FAULTS, ids=lambda fault: fault.name)
async def test_a_planted_fault_of_the_pendant_port_is_found(
    fault: PendantFault, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault.plant(monkeypatch)
    judgement = await judged_port(fault.check)
    assert [result.finding.verdict for result in judgement.results] == [CheckVerdict.FAILED]
    assert "the tester itself failed" not in judgement.results[0].finding.detail


async def test_a_sound_server_passes_all_of_them(sound_pendant_port: Judgement) -> None:
    verdicts = {r.check.number: r.finding.verdict for r in sound_pendant_port.results}
    assert {verdicts[fault.check] for fault in PENDANT_FAULTS} == {CheckVerdict.PASSED}


async def test_there_are_faults_of_the_pendant_port_enough() -> None:
    assert len(PENDANT_FAULTS) >= 25
    assert len({fault.name for fault in PENDANT_FAULTS}) == len(PENDANT_FAULTS)
    moving = [e for e in server_checks() if e.section is Section.PENDANT and e.moves]
    assert len(moving) >= 8


async def test_a_check_that_moves_says_that_the_robot_may_have_moved() -> None:
    async with running_server() as options:
        target = Target(options)
        (resting, moving) = checks_named(["PS35", "PS36"])
        said = []
        for entry in (resting, moving):
            await entry.judge(target)
            said.append(target.may_have_moved)
            await target.close()
    assert said == [False, True]


async def test_beats_come_every_half_second_and_end_with_their_context() -> None:
    async with running_server() as options:
        target = Target(options)
        pendant = await welcomed(target)
        beats: list[bytes] = []
        send = pendant.wire.send

        def noted(*parts: Message | bytes) -> None:
            beats.extend(pendant.wire.encode(part) for part in parts)
            send(*parts)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pendant.wire, "send", noted)
            async with pendant.beating():
                await asyncio.sleep(1.75)
            assert beats == [pendant.wire.encode(AuthorityBeat())] * 4
            await asyncio.sleep(1.0)
        assert len(beats) == 4
        await target.close()


async def test_a_robot_shown_elsewhere_by_the_other_port_is_not_moved() -> None:
    with pytest.MonkeyPatch.context() as patch:
        swaps = next(fault for fault in PENDANT_FAULTS if fault.check == "PS22")
        swaps.plant(patch)
        async with running_server() as options:
            judgement = await judge(options, checks=checks_named(["PS36"]))
    (finding,) = [result.finding for result in judgement.results]
    assert finding.verdict is CheckVerdict.NOT_APPLICABLE
    assert "elsewhere" in finding.detail


Serve = Callable[[asyncio.StreamWriter], None]


def _answers_without_end(writer: asyncio.StreamWriter) -> None:
    writer.write(struct.pack("<4i", 65_532, STATE, 3, 1) + bytes(65_520))


def _news_without_end(writer: asyncio.StreamWriter) -> None:
    writer.write(struct.pack("<4i", 65_532, 65_200, 1, 0) + bytes(65_520))


def _short_news(writer: asyncio.StreamWriter) -> None:
    writer.write(struct.pack("<4i", 16, STATE, 1, 0) + b"abcd")


async def talked_to(say: Serve, times: int) -> PendantConversation:
    """Connect a tester to a server that says one thing so often; return it after that."""

    async def serve(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(ConnectionError):
            for _count in range(times):
                say(writer)
                await writer.drain()
        with suppress(ConnectionError):
            writer.close()
            await writer.wait_closed()

    server = await asyncio.start_server(serve, HOST, 0)
    port = server.sockets[0].getsockname()[1]
    pendant = await stranger(Target(Options(HOST, port, pendant_port=port)))
    await pendant.wire.is_closed_within(10.0)
    server.close()
    return pendant


async def test_news_that_cannot_be_read_are_the_servers_fault() -> None:
    pendant = await talked_to(_short_news, 1)
    with pytest.raises(RuleBroken, match="20 bytes"):
        await pendant.until(lambda: False, 1.0)
    assert pendant.fault


async def test_answers_without_end_are_cut_off() -> None:
    assert "bytes of answers to nothing" in (await talked_to(_answers_without_end, 200)).fault


async def test_news_without_end_do_not_fill_the_memory() -> None:
    pendant = await talked_to(_news_without_end, 200)
    assert not pendant.fault
    assert 0 < len(pendant.topics) <= 4 * 1024 * 1024 / 65_536
