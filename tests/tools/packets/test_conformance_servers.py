"""Our own servers are judged in full, and the tester's own manners."""

import asyncio
import itertools
from collections import Counter
from dataclasses import replace

import pytest
from rigs.faults.faulty_servers import (
    SOUND,
    START,
    checks_named,
    judged,
    serve,
    sound_server,
    words_of,
)
from rigs.processes.judged_server import (
    HALF_RATE,
    HOST,
    PARTS,
    USUAL_RATE,
    running_emulator,
    running_server,
)

from openpendant.simplemsg import ByteOrder
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
from openpendant.tools.packets.conformance.server.runner import applicable, judge
from openpendant.tools.packets.conformance.server.target import Options, Target
from openpendant.tools.packets.conformance.server.wire import TargetUnreachable

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


async def test_a_target_that_is_not_there_is_no_judgement() -> None:
    with pytest.raises(TargetUnreachable, match="cannot be reached"):
        await judge(Options(HOST, 1))


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
