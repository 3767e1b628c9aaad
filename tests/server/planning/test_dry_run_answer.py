"""What of a long dry run comes back from the planning process."""

from __future__ import annotations

from openpendant.server.planning.dry_run_answer import MOST_SAMPLES, MOST_VERDICTS, shortened
from openpendant.server.planning.jobs import DryRunFound
from openpendant.server.programs.dry_run_results import DryRun, MoveVerdict, PointVerdict
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode

FAR = Refusal(VerdictCode.UNREACHABLE)


def found(moves: int, refused_from: int) -> DryRunFound:
    verdicts = tuple(
        MoveVerdict("main", number, "p", FAR if number >= refused_from else None, False)
        for number in range(moves)
    )
    path = tuple((float(number), 0.0, 0.0, 0.0) for number in range(10 * moves + 7))
    unreached = tuple(("main", number) for number in range(moves))
    run = DryRun(1.0, False, True, path, verdicts, unreached)
    return DryRunFound(run, (PointVerdict("a", None), PointVerdict("b", FAR)))


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
