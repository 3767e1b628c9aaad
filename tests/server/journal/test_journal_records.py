from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.cells.expectations import expect
from rigs.cells.server_rig import LIMITS
from rigs.data.example_counts import examples
from rigs.data.journal_records import read_back
from rigs.data.program_samples import programs

from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.journal import event_records
from openpendant.server.journal.event_records import plan_from_json, plan_to_json
from openpendant.server.planning.jobs import (
    DryRunFound,
    KinematicsFound,
    LeastClearance,
    PlanAnswer,
    PlanFacts,
    PoseGoal,
    SearchProgress,
    SearchStage,
    WorstRatio,
)
from openpendant.server.programs.editing.program_tasks import BodyPrinted, BodyUnpacked
from openpendant.server.programs.interpreter import dry_run_results
from openpendant.server.programs.language.program import Program
from openpendant.server.refusal import Refusal
from openpendant.server.store import store_errors
from openpendant.server.store.documents import Document, DocumentKind, Extent, Heading
from openpendant.server.store.requests import Answer, AppendChunk, Load, Request, Save
from openpendant.server.store.store_client import NoStore
from openpendant.server.store.store_errors import StoreError
from openpendant.simplemsg.journal import LongValue, json_parts
from openpendant.simplemsg.pendant.management.statements import Attach, Detach
from openpendant.simplemsg.verdicts import VerdictCode as V

START = (0.1, -0.2)
REFUSAL = Refusal(V.OUT_OF_RANGE, "too far", joint=1, value=2.5, limit=2.0)


@pytest.fixture
def planned() -> PlanAnswer:
    trajectory = plan_joint_move(START, (0.9, 0.3), LIMITS)
    return PlanAnswer(4, (trajectory, certify(trajectory, LIMITS, start=START)), 0.012345678901)


def _through_text(planned: PlanAnswer) -> dict[str, Any]:
    return read_back(plan_to_json(planned))


def test_a_trajectory_comes_back_with_every_bit(planned: PlanAnswer) -> None:
    again = plan_from_json(4, _through_text(planned), LIMITS, START)
    assert isinstance(planned.result, tuple)
    assert isinstance(again.result, tuple)
    for name in ("times", "position", "velocity", "acceleration", "waypoint_times"):
        then, now = getattr(planned.result[0], name), getattr(again.result[0], name)
        assert np.array_equal(then, now)
    assert again.plan_time == planned.plan_time
    assert again.result[1].as_dict() == planned.result[1].as_dict()


def test_what_is_told_of_a_plan_comes_back(planned: PlanAnswer) -> None:
    facts = PlanFacts(
        "RRTConnect",
        3,
        PoseGoal((0.1, 0.2, 0.3), (0.0, 0.0, 0.0, 1.0)),
        0.25,
        (WorstRatio("elbow", "velocity", 0.1 + 0.2, 0.07),),
        LeastClearance(0.123456789012345, "forearm", "pillar", 0.5),
    )
    again = plan_from_json(4, _through_text(replace(planned, facts=facts)), LIMITS, START)
    assert again.facts == facts


def test_a_word_on_a_search_comes_back() -> None:
    word = PlanAnswer(4, SearchProgress(SearchStage.SHORTENING, 0.1 + 0.2), 0.3)
    assert plan_from_json(4, _through_text(word), LIMITS, START) == word


def test_a_refusal_comes_back_with_its_numbers() -> None:
    again = plan_from_json(7, _through_text(PlanAnswer(7, REFUSAL, 0.5)), LIMITS, START)
    assert again == PlanAnswer(7, REFUSAL, 0.5)


@settings(max_examples=examples(15, in_soak=5_000))
@given(programs(), st.sampled_from([None, REFUSAL]))
def test_what_a_dry_run_found_comes_back_with_its_statements(
    program: Program, refusal: Refusal | None
) -> None:
    hands = [each for each in program.statements if isinstance(each, Attach | Detach)]
    run = dry_run_results.DryRunResult(
        duration=1.5,
        endless=False,
        complete=True,
        path=((0.0, 0.1, 0.2, 0.3),),
        moves=(dry_run_results.MoveFinding("main", 0, "a", refusal, False),),
        not_walked=(("main", 1),),
        hand_overs=tuple(dry_run_results.HandOver("main", 2, each, refusal) for each in hands),
        statements=tuple(
            dry_run_results.StatementFinding("main", index, each, refusal)
            for index, each in enumerate(program.statements)
        ),
        unchecked=(("main", 3),),
    )
    points = (dry_run_results.PointFinding("a", refusal),)
    found = PlanAnswer(9, DryRunFound(run, points, refused=1), 0.5)
    assert plan_from_json(9, _through_text(found), LIMITS, START) == found


def test_a_tampered_trajectory_is_certified_anew_and_refused(planned: PlanAnswer) -> None:
    record = _through_text(planned)
    record["samples"]["position"] = record["samples"]["velocity"]
    with pytest.raises(event_records.AnswerRecordError):
        plan_from_json(4, record, LIMITS, START)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"samples": None}, "neither"),
        ({"samples": {}}, "times"),
        ({"plan_time": "soon"}, "plan_time"),
        ({"joints": 0}, "reshape|one row"),
        ({"samples": {"times": "?"}}, "base64|Only|Non|padding"),
        ({"refused": {"code": 9999}}, "refused"),
    ],
)
def test_a_damaged_record_is_refused(
    planned: PlanAnswer, change: dict[str, Any], words: str
) -> None:
    with pytest.raises(event_records.AnswerRecordError, match=words):
        plan_from_json(4, _through_text(planned) | change, LIMITS, START)


def test_samples_and_programs_are_not_spelled_out_on_the_event_loop(planned: PlanAnswer) -> None:
    """What is left for the journal's writer is all but a few of the characters."""
    many = np.zeros((60_001, 2))
    still = Trajectory(np.arange(60_001) / 100.0, many, many, many, np.array([0.0, 600.0]))
    pieces = tuple("[1.5]" * 1_000 for _ in range(120))
    assert isinstance(planned.result, tuple)
    for result in (
        (still, planned.result[1]),
        BodyPrinted("move PTP p1\n" * 80_000),
        BodyUnpacked("{}", pieces, pieces, 6_000, ()),
    ):
        parts = list(json_parts(plan_to_json(PlanAnswer(1, result, 0.5))))
        at_once = sum(len(part) for part in parts if isinstance(part, str))
        later = sum(len(part) for part in parts if isinstance(part, LongValue))
        assert at_once < 4_000
        assert later > 900_000


HEADING = Heading(DocumentKind.PROGRAM, "größe", 3, 20, "teacher", "2026-01-01T00:00:00+00:00")


@pytest.mark.parametrize(
    "answer",
    [
        Document(HEADING, '{"a": "ö"}'),
        Document(HEADING, '{"a": "ö\\n"}' * 100_000),
        HEADING,
        Extent(3, 4_000),
        (HEADING, HEADING),
        (),
        (b"\0\xff", b"x"),
        (b"\0\xff" * 100_000, b"x"),
    ],
)
def test_an_answer_comes_back_as_it_was(answer: Answer) -> None:
    assert event_records.answer_from_json(read_back(event_records.answer_to_json(answer))) == answer


@pytest.mark.parametrize(
    "error",
    [
        store_errors.Conflict("program", "x", 1, 2, "me", "now"),
        store_errors.NotFound("program", "x"),
        store_errors.BadName("a/b", "has a slash"),
        store_errors.TooLarge("it", 5, 4, "cut it"),
        store_errors.OutOfSequence("r", 2, 1),
        store_errors.DiskFull("store.db: database or disk is full"),
        NoStore("this server was started without a store"),
    ],
)
def test_an_error_comes_back_with_its_kind_words_and_numbers(error: StoreError) -> None:
    record = read_back(event_records.answer_to_json(error))
    back = expect(StoreError, event_records.answer_from_json(record))
    assert type(back) is type(error)
    assert (str(back), vars(back), back.refusal()) == (str(error), vars(error), error.refusal())


@pytest.mark.parametrize(
    ("request_", "noted"),
    [
        (Load(DocumentKind.PROGRAM, "x"), "Load(kind="),
        (Save(DocumentKind.PROGRAM, "x", "ö\n", 1, "me"), "body='', expected_revision=1"),
        (AppendChunk("x", 2, b"\0\xff"), "AppendChunk(name='x', sequence=2, data=b'')"),
    ],
)
def test_a_request_is_noted_with_all_that_is_to_be_kept(request_: Request, noted: str) -> None:
    """What is long stands behind the words as it is: its spelling would hold up the event loop."""
    said = event_records.request_to_bytes(request_)
    assert noted.encode() in said
    kept = {Save: "ö\n".encode(), AppendChunk: b"\0\xff"}
    assert said.endswith(kept.get(type(request_), b")"))


@pytest.mark.parametrize("size", [10, 100_000])
def test_an_answer_on_kinematics_is_noted_whole(size: int) -> None:
    """What is long is left to the journal's writer, so that it holds up no turn of the loop."""
    told = PlanAnswer(4, KinematicsFound(f'{{"ö":{"1" * size}}}'), 0.25)
    record = plan_to_json(told)
    assert isinstance(record["found"]["body"], LongValue) == (size > 10)
    assert plan_from_json(4, read_back(record), LIMITS, START) == told


@pytest.mark.parametrize(
    "record",
    [
        {},
        {"what": "heading", "answer": {"name": "x"}},
        {"what": "chunks", "answer": ["?"]},
        {"what": "failed", "answer": {"kind": "OSError", "text": "", "fields": {}}},
    ],
)
def test_a_damaged_record_of_an_errand_is_refused(record: dict[str, object]) -> None:
    with pytest.raises(event_records.AnswerRecordError):
        event_records.answer_from_json(record)
