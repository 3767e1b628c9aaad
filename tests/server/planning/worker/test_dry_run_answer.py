from __future__ import annotations

import json
from collections.abc import Mapping

from openpendant.server.events.management_requests import MOST_ANSWER
from openpendant.server.planning.jobs import DryRunFound
from openpendant.server.planning.worker.dry_run_planning import (
    MOST_SAMPLES,
    MOST_VERDICTS,
    shortened,
)
from openpendant.server.programs.execution.dry_run_service import dry_run_reply
from openpendant.server.programs.interpreter.dry_run_results import (
    DryRunResult,
    HandOver,
    MoveFinding,
    PointFinding,
    StatementFinding,
)
from openpendant.server.programs.language.linking import Linked
from openpendant.server.programs.language.parser import parse
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.statements import Attach, SetOutput
from openpendant.simplemsg.verdicts import VerdictCode as V

FAR = Refusal(V.UNREACHABLE)


def found(moves: int, refused_from: int) -> DryRunFound:
    verdicts = tuple(
        MoveFinding("main", number, "p", FAR if number >= refused_from else None, False)
        for number in range(moves)
    )
    path = tuple((float(number), 0.0, 0.0, 0.0) for number in range(10 * moves + 7))
    unreached = tuple(("main", number) for number in range(moves))
    run = DryRunResult(1.0, False, True, path, verdicts, unreached)
    return DryRunFound(run, (PointFinding("a", None), PointFinding("b", FAR)))


def test_a_short_one_comes_whole() -> None:
    whole = found(5, 5)
    told = shortened(whole)
    assert (told.run.moves, told.run.not_walked) == (whole.run.moves, whole.run.not_walked)
    assert told.run.path == whole.run.path
    assert [each.point for each in told.points] == ["b", "a"]


def test_of_a_long_one_what_is_refused_comes_first_and_all_of_it_is_counted() -> None:
    told = shortened(found(4_000, 3_800))
    assert told.refused == 201
    assert [each.index for each in told.run.moves] == list(range(3_800, 3_800 + MOST_VERDICTS))
    assert len(told.run.not_walked) == MOST_VERDICTS
    assert len(told.run.path) <= MOST_SAMPLES + 1
    assert told.run.path[-1][0] == 40_006.0


def test_an_answer_of_long_texts_fits_a_frame_and_cuts_none_of_them() -> None:
    name, count = "ü" * 32, 500
    text = f"something at fault that takes many words to say {'and more ' * 30}than 3.14 rad"
    far = Refusal(V.UNREACHABLE, text)
    head = f'openpendant-program/1\nprogram "{name}" robot ur5\n'
    program = parse(head + "wait 1 s\n" * count)
    linked = Linked(name, {name: program}, revisions={name: 1})
    keys = [(name, number) for number in range(count)]
    run = DryRunResult(
        duration=1.0,
        endless=False,
        complete=False,
        path=tuple((86_400.123456 + n, -1.123456, -1.123456, -1.123456) for n in range(5_000)),
        moves=tuple(MoveFinding(*key, name, far, False) for key in keys),
        not_walked=tuple(keys),
        hand_overs=tuple(HandOver(*key, Attach(name), far) for key in keys),
        statements=tuple(StatementFinding(*key, SetOutput(99, True), FAR) for key in keys),
        unchecked=tuple(keys),
    )
    points = tuple(PointFinding(name, far) for _ in keys)
    answer = dry_run_reply(linked, shortened(DryRunFound(run, points)))
    body = json.dumps(answer, ensure_ascii=False, separators=(",", ":")).encode()
    assert 40_000 < len(body) <= MOST_ANSWER
    assert answer["refused"] == 4 * count
    texts = {str(each["text"]) for kind in ("moves", "scene") for each in rows(answer, kind)}
    assert texts == {text}
    assert len(rows(answer, "statements")) == MOST_VERDICTS


def rows(answer: Mapping[str, object], kind: str) -> list[dict[str, object]]:
    found = answer[kind]
    assert isinstance(found, list)
    return found


def test_statements_that_cannot_be_run_come_before_those_that_can() -> None:
    verdicts = tuple(
        StatementFinding("main", number, SetOutput(1, True), FAR if number > 90 else None)
        for number in range(200)
    )
    run = DryRunResult(1.0, False, True, (), (), (), statements=verdicts)
    found = shortened(DryRunFound(run, ()))
    assert found.refused == 109
    assert [each.index for each in found.run.statements] == list(range(91, 191))
