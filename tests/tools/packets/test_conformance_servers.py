"""Our own servers are judged in full; the tester's own manners, and what it does to a robot.

Without permission it moves nothing, and with it never much.
"""

import asyncio
import itertools
import struct
import tracemalloc
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import pytest
from rigs.cells.controller_rig import LIMITS
from rigs.faults.faulty_servers import (
    SOUND,
    START,
    checks_named,
    judged,
    serve,
    sound_server,
    words_of,
)
from rigs.peers.fixed_layout_controllers import Receiver, clipping, fanuc, running, staubli
from rigs.processes.judged_server import (
    HALF_RATE,
    HOST,
    PARTS,
    USUAL_RATE,
    running_emulator,
    running_server,
)

from openpendant.simplemsg import STANDARD as STANDARD_MESSAGES
from openpendant.simplemsg import ByteOrder, codec_for
from openpendant.tools.packets.conformance.check import (
    PASSED,
    Check,
    CheckFinding,
    CheckVerdict,
    Judgement,
    Profile,
    Section,
)
from openpendant.tools.packets.conformance.clauses import CLAUSES
from openpendant.tools.packets.conformance.client.judge import CHECKS
from openpendant.tools.packets.conformance.server.checks import (
    STANDARD,
    ServerCheck,
    check,
    server_checks,
)
from openpendant.tools.packets.conformance.server.monitor import INTERRUPTED, Watch
from openpendant.tools.packets.conformance.server.moving import ready
from openpendant.tools.packets.conformance.server.runner import applicable, judge
from openpendant.tools.packets.conformance.server.target import Options, Target
from openpendant.tools.packets.conformance.server.wire import Wire

pytestmark = pytest.mark.virtual_clock

PASSES = CheckVerdict.PASSED

UNJUDGED = {"TS12", "TS19", "QS14", "QS15"}
"""Of our server, which reports no type 15, and has no operator to press an emergency stop."""

each_rate = pytest.mark.parametrize(
    "rate", [HALF_RATE, pytest.param(USUAL_RATE, marks=pytest.mark.conformance)]
)


def not_passed(judgement: Judgement) -> list[str]:
    return words_of(judgement, CheckVerdict.FAILED, CheckVerdict.DEVIATES)


def unjudged(judgement: Judgement) -> set[str]:
    return {
        result.check.number
        for result in judgement.results
        if result.finding.verdict is CheckVerdict.NOT_APPLICABLE
    }


@each_rate
async def test_the_emulator_passes_every_check(rate: int) -> None:
    async with running_emulator(rate=rate) as options:
        judgement = await judge(options)
    assert not_passed(judgement) == []
    assert unjudged(judgement) == set()
    assert judgement.count(PASSES) >= 75


async def test_the_server_passes_every_check_on_all_its_ports(
    sound_part: tuple[tuple[Section, ...], Judgement],
) -> None:
    sections, judgement = sound_part
    expected = {entry.number for entry in server_checks() if entry.section in sections}
    assert {result.check.number for result in judgement.results} == expected != set()
    assert not_passed(judgement) == []
    assert unjudged(judgement) == UNJUDGED & expected


async def test_every_section_of_the_standard_dialect_is_in_one_part() -> None:
    sections = [section for part in PARTS for section in part]
    assert Counter(sections) == Counter(set(Section) - {Section.MOTOMAN})


@pytest.mark.conformance
async def test_the_server_passes_every_check_at_its_usual_rate() -> None:
    async with running_server(USUAL_RATE) as options:
        judgement = await judge(options)
    assert not_passed(judgement) == []
    assert unjudged(judgement) == UNJUDGED
    assert sum(result.check.section is Section.PENDANT for result in judgement.results) > 25


@pytest.mark.conformance
async def test_the_pendant_port_passes_every_check_alone() -> None:
    async with running_server() as options:
        judgement = await judge(replace(options, profile=Profile.PENDANT))
    assert not_passed(judgement) == []
    assert {result.check.section for result in judgement.results} == {Section.PENDANT}
    assert len(judgement.results) > 25


async def test_the_pendant_port_can_be_judged_alone() -> None:
    async with running_server() as options:
        alone = replace(options, profile=Profile.PENDANT)
        assert {entry.section for entry in applicable(alone)} == {Section.PENDANT}
        judgement = await judge(alone, only=["PS01", "PS16", "PS36"])
    assert [result.finding.verdict for result in judgement.results] == [CheckVerdict.PASSED] * 3


@each_rate
async def test_the_emulator_passes_the_minimum_without_its_limits_known(rate: int) -> None:
    async with running_emulator(rate=rate) as options:
        judgement = await judge(replace(options, profile=Profile.MINIMUM, limits=None))
    assert not_passed(judgement) == []
    assert unjudged(judgement) == {"TS06", "TS11", "LS07", "LS08", "LS17"}


@pytest.mark.parametrize("order", list(ByteOrder))
async def test_the_byte_order_of_the_target_is_found(order: ByteOrder) -> None:
    async with running_emulator(byte_order=order.name.lower()) as options:
        target = Target(options)
        await target.survey()
    assert target.order is order


@pytest.mark.parametrize("settings", [{"byte_order": "big"}, {"real_size": 8}])
async def test_other_wire_forms_are_judged_alike(settings: dict[str, object]) -> None:
    async with running_emulator(**settings) as options:
        only = ("header", "replies", "BS03", "TS02", "TS08", "MS02", "SS02")
        judgement = await judge(options, only=only)
    assert not_passed(judgement) == []


async def test_nothing_moves_without_permission() -> None:
    async with sound_server() as (service, options):
        judgement = await judge(options)
        moves = {entry.number for entry in applicable(options) if entry.moves}
        assert unjudged(judgement) == moves
        assert service.controller.motion(service.now)[0] == START
        assert "points-accepted" not in service.controller.referee.events


async def test_the_robot_is_back_where_it_was_after_every_run() -> None:
    async with sound_server(may_move=True) as (service, options):
        await judge(options, only=["stop", "KS10"])
        assert service.controller.motion(service.now)[0] == pytest.approx(START, abs=1e-3)


async def test_without_a_state_port_nothing_passes_that_needs_one() -> None:
    service, ports = await serve(SOUND)
    judgement = await judge(Options(HOST, ports.motion, may_move=True))
    blind = {
        result.check.number
        for result in judgement.results
        if result.check.section in (Section.TOPICS, Section.STATUS) or result.check.moves
    }
    assert blind <= unjudged(judgement)
    assert not_passed(judgement) == []
    await service.close()


def made_of(body: object, **how: float) -> ServerCheck:
    deadline = how.get("deadline", 5.0)
    return Check("FS90", "made up", "", body, profiles=STANDARD, deadline=deadline)  # type: ignore[arg-type]  # any awaitable will do


async def test_a_check_that_crashes_has_failed() -> None:
    async def crash(target: Target) -> CheckFinding:
        raise KeyError("oops")

    judgement = await judged(SOUND, [made_of(crash)])
    assert not_passed(judgement) == ["FS90 failed: the tester itself failed: KeyError: 'oops'"]


async def test_a_check_that_never_ends_has_failed() -> None:
    async def wait(target: Target) -> CheckFinding:
        await asyncio.sleep(1e6)
        return PASSED

    judgement = await judged(SOUND, [made_of(wait, deadline=2.0)])
    assert not_passed(judgement) == ["FS90 failed: the check was not done after 2 s"]


async def test_a_target_that_dies_fails_the_check_and_leaves_the_rest_unjudged() -> None:
    service, ports = await serve(SOUND)

    async def kill(target: Target) -> CheckFinding:
        await service.close()
        return PASSED

    options = Options(HOST, ports.motion, ports.state)
    judgement = await judge(options, checks=[made_of(kill), *checks_named(["FS01", "RS01"])])
    first, *rest = judgement.results
    assert first.finding.verdict is CheckVerdict.FAILED
    assert {result.finding.detail for result in rest} == {"target unreachable"}


async def test_a_failure_shows_what_travelled_last() -> None:
    async def ask(target: Target) -> CheckFinding:
        wire = await target.motion()
        await wire.ask(b"\x0c\0\0\0\x0f'\0\0\x01\0\0\0\0\0\0\0", "a topic")
        return PASSED

    (words,) = not_passed(await judged(SOUND, [made_of(ask)]))
    assert "0c000000 0f270000 01000000 00000000" in words


async def test_numbers_are_unique_and_belong_to_their_sections() -> None:
    numbers = [entry.number for entry in server_checks()]
    assert [number for number, count in Counter(numbers).items() if count > 1] == []
    with pytest.raises(ValueError, match="FS01 is taken"):
        check("FS01")
    with pytest.raises(ValueError, match="RS99"):
        check("RS99")
    with pytest.raises(ValueError, match="FC01 is taken, or no number of a check on servers"):
        check("FC01")


async def test_each_row_of_the_tables_of_clauses_is_one_check_of_its_section() -> None:
    rows = [number for number, _ in CLAUSES]
    sections = [letter for letter, _ in itertools.groupby(number[0] for number in rows)]
    assert sections == [section.value for section in Section]
    numbers = [entry.number for entry in server_checks()] + [entry.number for entry in CHECKS]
    assert sorted(rows) == sorted(numbers)


async def test_every_check_says_what_must_hold_and_why() -> None:
    for entry in server_checks():
        assert entry.title
        assert len(entry.clause) > 8


CONTROLLERS = pytest.mark.parametrize("receive", [fanuc, staubli, clipping])


def detail_of(judgement: Judgement, number: str) -> str:
    return next(r.finding.detail for r in judgement.results if r.check.number == number)


@CONTROLLERS
@pytest.mark.parametrize("profile", [Profile.GENERIC, Profile.MINIMUM])
async def test_without_permission_no_controller_is_moved(
    receive: Receiver, profile: Profile
) -> None:
    async with running(receive) as (robot, options):
        await judge(replace(options, profile=profile, limits=LIMITS))
    assert robot.farthest == 0.0
    assert robot.points == 0


@CONTROLLERS
@pytest.mark.parametrize("among", ["moving", pytest.param("all", marks=pytest.mark.conformance)])
async def test_with_permission_no_controller_is_moved_far(receive: Receiver, among: str) -> None:
    # What does not move sends no point with permission either: it is tried in `make conformance`.
    async with running(receive) as (robot, options):
        permitted = replace(options, may_move=True)
        checks = [e for e in applicable(permitted) if e.moves or among == "all"]
        await judge(permitted, checks=checks)
    assert robot.points > 0
    assert robot.farthest < options.amplitude + 0.03


async def test_what_a_controller_of_fixed_layout_would_take_for_a_point_is_not_sent() -> None:
    async with running(fanuc) as (_, options):
        judgement = await judge(options)
    assert "a lone PING is not answered" in detail_of(judgement, "FS18")
    (ping,) = [r for r in judgement.results if r.check.number == "RS01"]
    assert ping.finding.habit == "ABB, Fanuc, Stäubli: PING is not known"
    assert words_of(judgement, CheckVerdict.FAILED) == []


def moving_check(body: Callable[[Target], object]) -> ServerCheck:
    return Check("MS90", "made up", "", body, moves=True, profiles=STANDARD)  # type: ignore[arg-type]  # any coroutine will do


async def _run_away(target: Target) -> CheckFinding:
    mover = await ready(target)
    far = tuple(value + 1.0 for value in mover.start)
    await mover.accepted(0, far, 5.0)
    await asyncio.sleep(20.0)
    return PASSED


async def test_a_robot_that_goes_too_far_is_stopped_and_the_check_fails() -> None:
    async with sound_server(may_move=True) as (service, options):
        judgement = await judge(options, checks=[moving_check(_run_away), *checks_named(["MS02"])])
        first, second = judgement.results
        assert first.finding.verdict is CheckVerdict.FAILED
        assert "it was sent STOP" in first.finding.detail
        assert second.finding.verdict is CheckVerdict.PASSED
        assert service.controller.motion(service.now)[0] == pytest.approx(START, abs=1e-3)


async def test_a_robot_that_goes_too_far_again_and_again_is_not_moved_any_more() -> None:
    async with sound_server(may_move=True) as (_, options):
        checks = [moving_check(_run_away)] * 3
        judgement = await judge(options, checks=[*checks, *checks_named(["MS01"])])
        assert "it went too far 3 times" in detail_of(judgement, "MS01")


async def test_the_way_back_is_slow() -> None:
    async with sound_server(may_move=True, amplitude=0.2) as (service, options):
        fastest = 0.0

        async def look() -> None:
            nonlocal fastest
            while True:
                await asyncio.sleep(0.01)
                fastest = max(fastest, *map(abs, service.controller.motion(service.now)[1]))

        looking = asyncio.create_task(look())
        await judge(options, checks=checks_named(["MS09", "MS10", "MS12", "SS02"]))
        looking.cancel()
        assert fastest < 0.2


@pytest.mark.parametrize("after", [0.5, 4.0, 9.0, 14.0])
async def test_an_interrupted_run_leaves_a_robot_that_stands(after: float) -> None:
    async with sound_server(may_move=True) as (service, options):

        def plan(interrupt: Callable[[], None]) -> None:
            asyncio.get_running_loop().call_later(after, interrupt)

        checks = [entry for entry in applicable(options) if entry.moves]
        judgement = await judge(options, checks=checks, on_start=plan)
        assert service.controller.status(service.now).in_motion == 0
        assert judgement.results[-1].finding.detail == INTERRUPTED
        assert words_of(judgement, CheckVerdict.FAILED) == []
        assert len(judgement.results) == len(checks)


async def test_an_interrupted_motion_is_sent_stop_on_two_links() -> None:
    async with sound_server(may_move=True) as (service, options):
        interrupts: list[Callable[[], None]] = []

        async def interrupt_in_motion(target: Target) -> CheckFinding:
            await (await ready(target)).set_off(5.0)
            before = service.controller.referee.events["stops"]
            asyncio.get_running_loop().call_soon(interrupts[0])
            try:
                await asyncio.sleep(5.0)
            finally:
                stops.append(before)
            return PASSED

        stops: list[int] = []
        await judge(options, checks=[moving_check(interrupt_in_motion)], on_start=interrupts.append)
        assert service.controller.referee.events["stops"] == stops[0] + 2
        assert service.controller.status(service.now).in_motion == 0


async def test_large_frames_do_not_fill_the_memory() -> None:
    wire = Wire("state", codec_for(STANDARD_MESSAGES, ByteOrder.LITTLE, 4))
    watch = Watch(wire)
    large = struct.pack("<4i", 65_535, 9999, 1, 0) + bytes(65_523)
    tracemalloc.start()
    for _ in range(600):
        wire.data_received(large)
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(watch.frames) == 600
    assert size < 2_000_000
