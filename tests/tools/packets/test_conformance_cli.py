"""The conformance tester around its checks: command line, reports, verdicts, what is an answer."""

import asyncio
import json
import math
import re
import signal
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from openpendant.simplemsg import MOTOMAN, HeaderOnly, Message, MsgType, ReplyCode, codec_for
from openpendant.simplemsg.declaration import joint_array
from openpendant.simplemsg.motoman import MotomanMotionReply
from openpendant.tools.console import ExitCode
from openpendant.tools.packets.conformance import cli
from openpendant.tools.packets.conformance.catalogue import page_with_checks
from openpendant.tools.packets.conformance.check import (
    PASSED,
    Check,
    CheckFinding,
    CheckVerdict,
    Judgement,
    Result,
    RuleBroken,
    deviates,
    failed,
    not_applicable,
)
from openpendant.tools.packets.conformance.cli import main
from openpendant.tools.packets.conformance.client.check import Habit, Moment, Problem, finding_of
from openpendant.tools.packets.conformance.client.judge import CHECKS, results_of
from openpendant.tools.packets.conformance.report import as_json, as_junit, as_text
from openpendant.tools.packets.conformance.server.answers import is_taken, must_be_ping
from openpendant.tools.packets.conformance.server.checks import server_checks
from openpendant.tools.packets.conformance.server.monitor import distance
from openpendant.tools.packets.conformance.server.wire import ReceivedFrame

PAGE = Path(__file__).parents[3] / "docs" / "conformance.md"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "needs HOST:MOTION"),
        (["robot"], "not HOST:MOTION"),
        (["robot:port"], "no TCP port"),
        (["robot:0"], "no TCP port"),
        (["robot:1:2:3"], "not HOST:MOTION"),
        (["robot:1", "--only", "ZZ99"], "no check on servers"),
        (["robot:1", "--only", "pendant"], "no check of this profile"),
        (["robot:1", "--robot", "no-such-robot"], "no-such-robot"),
        (["robot:1", "--amplitude", "5"], "accepted are"),
        (["robot:1", "--amplitude", "nan"], "accepted are"),
        (["robot:1", "--joint", "0"], "accepted are 1 to 10"),
        (["robot:1", "--robot", "ur5", "--joint", "7"], "accepted are 1 to 6"),
        (["robot:1", "--role", "both"], "invalid choice"),
        (["robot:1", "--pendant-port", "x"], "no TCP port"),
        (["robot:1", "--dialect", "pendant"], "no controller speaks it"),
        (["robot:1", "--junit", "/no/such/folder/report.xml"], "--junit /no/such/folder"),
        (["robot:1", "--junit", "/"], "--junit /"),
    ],
)
def test_wrong_usage_is_a_sentence_and_exit_code_2(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == ExitCode.USAGE
    assert complaint in capsys.readouterr().err


def test_a_target_that_is_not_there_is_exit_code_3(
    capsys: pytest.CaptureFixture[str], unused_tcp_port: int
) -> None:
    assert main([f"127.0.0.1:{unused_tcp_port}"]) == ExitCode.REFUSED
    assert f"127.0.0.1:{unused_tcp_port} cannot be reached" in capsys.readouterr().err


def test_the_list_names_every_check_of_both_roles(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == ExitCode.OK
    listed = capsys.readouterr().out
    for entry in server_checks():
        assert f"{entry.number}  {entry.title}" in listed
    assert "FC01" in listed


@pytest.mark.parametrize(
    ("finding", "code"),
    [
        (PASSED, ExitCode.OK),
        (failed("broken"), ExitCode.FAILED),
        (deviates("somebody: so", "seen"), ExitCode.OK),
        (not_applicable("no eyes"), ExitCode.OK),
    ],
    ids=lambda value: getattr(value, "verdict", value).name,
)
def test_only_a_failed_check_is_exit_code_1(
    finding: CheckFinding,
    code: ExitCode,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    async def judge(*_: object, **__: object) -> Judgement:
        return Judgement("server x", "server", (Result(server_checks()[0], finding),))

    monkeypatch.setattr(cli, "judge", judge)
    report = tmp_path / "report.xml"
    assert main(["robot:1", "--json", "--junit", str(report)]) == code
    (result,) = json.loads(capsys.readouterr().out)["results"]
    assert result["verdict"] == finding.verdict.value
    assert "FS01" in report.read_text(encoding="utf-8")


def test_an_interrupted_run_prints_what_it_has_and_is_exit_code_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def judge(*_: object, on_start: Callable[..., None], **__: object) -> Judgement:
        interrupted = asyncio.Event()
        on_start(interrupted.set)
        signal.raise_signal(signal.SIGTERM)
        await asyncio.wait_for(interrupted.wait(), 5)
        finding = not_applicable("interrupted")
        return Judgement("server x", "server", (Result(server_checks()[0], finding),))

    monkeypatch.setattr(cli, "judge", judge)
    assert main(["robot:1", "--yes-it-may-move", "--json"]) == ExitCode.INTERRUPTED
    captured = capsys.readouterr()
    assert json.loads(captured.out)["counts"]["not applicable"] == 1
    assert "STOP is sent" in captured.err


def test_a_hang_up_that_is_ignored_as_under_nohup_stays_ignored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def judge(*_: object, on_start: Callable[..., None], **__: object) -> Judgement:
        on_start(lambda: None)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        return Judgement("server x", "server", ())

    monkeypatch.setattr(cli, "judge", judge)
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        main(["robot:1", "--yes-it-may-move", "--json"])
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_help_tells_the_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == ExitCode.OK
    told = capsys.readouterr().out
    assert "3 target not reachable" in told
    assert "130 interrupted" in told


def test_the_page_lists_the_checks_that_there_are() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page_with_checks(page) == page, (
        "run python -m openpendant.tools.packets.conformance.catalogue docs/conformance.md"
    )


def test_a_page_without_the_marks_is_left_alone() -> None:
    with pytest.raises(ValueError, match="missing"):
        page_with_checks("# Nothing\n")


def check(number: str) -> Check[None]:
    return Check(number, f"title of {number}", "REP-I0006 & <more>", None)


JUDGEMENT = Judgement(
    "server 127.0.0.1:12000",
    "server",
    (
        Result(check("FS01"), PASSED, 0.25),
        Result(check("FS02"), failed("length 5 < 12 & more"), 0.5),
        Result(check("MS01"), deviates("early reply", "after 3 ms")),
        Result(check("MS02"), not_applicable("it may not move")),
        Result(check("KS01"), not_applicable("no time")),
    ),
)
HOSTILE = Judgement(
    "server \x1b[2J\x00",
    "server",
    (Result(check("FS01"), failed("\ud800 line\nfeed \x07 ]]> <x>")),),
)


def test_the_text_names_every_check_its_verdict_and_the_counts() -> None:
    text = as_text(JUDGEMENT, color=False)
    for line in (
        "passed         FS01 title of FS01",
        "FAILED         FS02 title of FS02",
        "deviates       MS01 title of MS01",
        "not applicable MS02 title of MS02",
        "habit: early reply",
        "length 5 < 12 & more",
        "it may not move",
    ):
        assert line in text
    assert text.endswith("5 checks: 1 passed, 1 failed, 1 deviates, 2 not applicable")


def test_the_clause_is_told_where_a_check_did_not_pass() -> None:
    assert as_text(JUDGEMENT, color=False).count("clause: REP-I0006") == 2


def test_colour_changes_nothing_but_colour() -> None:
    colored = as_text(JUDGEMENT, color=True)
    assert "\x1b[" in colored
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == as_text(JUDGEMENT, color=False)


def test_json_has_every_result_and_the_counts() -> None:
    report = json.loads(as_json(JUDGEMENT))
    assert report["counts"] == {"passed": 1, "failed": 1, "deviates": 1, "not applicable": 2}
    assert [result["number"] for result in report["results"]] == [
        *("FS01", "FS02", "MS01", "MS02", "KS01")
    ]
    assert report["results"][2] == {
        "number": "MS01",
        "title": "title of MS01",
        "clause": "REP-I0006 & <more>",
        "section": "motion",
        "moves": False,
        "verdict": "deviates",
        "detail": "after 3 ms",
        "habit": "early reply",
        "seconds": 0.0,
    }


def test_junit_counts_equal_its_cases_and_the_judgement() -> None:
    root = ElementTree.fromstring(as_junit(JUDGEMENT))
    cases = root.findall("testsuite/testcase")
    for element in (root, root[0]):
        assert int(element.attrib["tests"]) == len(cases) == len(JUDGEMENT.results)
        failures = len(root.findall(".//failure"))
        assert int(element.attrib["failures"]) == failures == JUDGEMENT.count(CheckVerdict.FAILED)
        assert (
            int(element.attrib["skipped"])
            == len(root.findall(".//skipped"))
            == JUDGEMENT.count(CheckVerdict.NOT_APPLICABLE)
        )
        assert element.attrib["time"] == "0.750"


def test_junit_passes_a_deviation_and_names_its_habit() -> None:
    root = ElementTree.fromstring(as_junit(JUDGEMENT))
    case = root.find("testsuite/testcase[3]")
    assert case is not None
    assert [child.tag for child in case] == ["properties"]
    properties = {item.attrib["name"]: item.attrib["value"] for item in case.iter("property")}
    assert properties["habit"] == "early reply"
    assert properties["verdict"] == "deviates"


@pytest.mark.parametrize("judgement", [HOSTILE, Judgement("nobody", "client", ())])
def test_no_text_of_a_peer_breaks_a_report(judgement: Judgement) -> None:
    for text in (as_text(judgement, color=False), as_junit(judgement), as_json(judgement)):
        assert "\x1b" not in text
        assert "\x00" not in text
        text.encode()
    ElementTree.fromstring(as_junit(judgement))
    json.loads(as_json(judgement))


HABIT = Habit("a program: what it does", "seen")


@pytest.mark.parametrize(
    ("seen", "verdict"),
    [
        ([], CheckVerdict.NOT_APPLICABLE),
        ([None], CheckVerdict.PASSED),
        ([None, HABIT], CheckVerdict.DEVIATES),
        ([HABIT, "broken"], CheckVerdict.FAILED),
        (["broken", None], CheckVerdict.FAILED),
    ],
)
def test_the_worst_of_what_was_looked_at_is_found(
    seen: list[Problem | None], verdict: CheckVerdict
) -> None:
    observations = ((Moment(number), problem) for number, problem in enumerate(seen))
    assert finding_of(observations, "nothing to look at").verdict is verdict


@pytest.mark.parametrize(
    ("findings", "verdict"),
    [
        ([PASSED, failed("there")], CheckVerdict.FAILED),
        ([deviates("a habit", "seen"), failed("there")], CheckVerdict.FAILED),
        ([PASSED, deviates("a habit", "seen")], CheckVerdict.DEVIATES),
        ([not_applicable("no"), PASSED], CheckVerdict.PASSED),
        ([not_applicable("no"), not_applicable("no")], CheckVerdict.NOT_APPLICABLE),
    ],
)
def test_the_worst_of_several_scenarios_is_the_result(
    findings: list[CheckFinding], verdict: CheckVerdict
) -> None:
    of_all = {
        f"scenario {number}": {check.number: finding for check in CHECKS}
        for number, finding in enumerate(findings)
    }
    assert {result.finding.verdict for result in results_of(of_all)} == {verdict}


POINT = MsgType.JOINT_TRAJ_PT
SUCCESS, FAILURE = ReplyCode.SUCCESS, ReplyCode.FAILURE


def frame(message: Message) -> ReceivedFrame:
    codec = codec_for(MOTOMAN)
    return ReceivedFrame(0.0, codec.encode(message), codec)


def motoman(result: int) -> MotomanMotionReply:
    """Return what a Motoman controller answers a point; its header always says success."""
    return MotomanMotionReply(0, 1, POINT, result, 0, joint_array(()))


@pytest.mark.parametrize(
    ("answer", "taken"),
    [
        (HeaderOnly(POINT, reply_code=SUCCESS), True),
        (HeaderOnly(POINT, reply_code=FAILURE), False),
        (motoman(0), True),
        (motoman(1), False),
        (motoman(5), False),
    ],
)
def test_a_point_counts_as_taken_where_its_answer_says_so(answer: Message, taken: bool) -> None:
    assert is_taken(frame(answer)) is taken


@pytest.mark.parametrize(
    "answer", [HeaderOnly(MsgType.PING, reply_code=FAILURE), HeaderOnly(POINT, reply_code=SUCCESS)]
)
def test_a_failure_and_another_type_answer_no_ping(answer: Message) -> None:
    must_be_ping(frame(HeaderOnly(MsgType.PING, reply_code=SUCCESS)), "a PING")
    with pytest.raises(RuleBroken):
        must_be_ping(frame(answer), "a PING")


def test_a_position_that_is_no_number_is_far_from_everywhere() -> None:
    assert distance((0.0, math.nan), (0.0, 0.0)) == math.inf
    assert distance((0.0, 0.1), (0.0, -0.1)) == pytest.approx(0.2)
