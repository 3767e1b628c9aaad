import json
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import pytest

from openpendant.tools.bench import __main__ as program
from openpendant.tools.bench import codec
from openpendant.tools.bench.table import Benchmark, Bound, Judged, Sides, measure, render


def _constant(value: float) -> Callable[[], float]:
    return lambda: value


def _sides(subject: float, baseline: float | None) -> Callable[[], AbstractContextManager[Sides]]:
    base = None if baseline is None else _constant(baseline)
    return lambda: nullcontext(Sides(_constant(subject), base))


def test_a_ratio_within_its_bound_is_ok() -> None:
    row = measure(Benchmark("a", "ns", _sides(24.0, 10.0), Bound(2.5, aim=1.8)))
    assert (row.median, row.baseline, row.ratio, row.verdict) == (24.0, 10.0, 2.4, "ok")


def test_a_ratio_beyond_its_bound_is_over() -> None:
    assert measure(Benchmark("a", "ns", _sides(26.0, 10.0), Bound(2.5, aim=1.8))).verdict == "over"


def test_a_bound_may_judge_the_median_itself() -> None:
    bound = Bound(50.0, aim=15.0, judged=Judged.VALUE)
    assert measure(Benchmark("a", "ms", _sides(51.0, None), bound)).verdict == "over"
    assert measure(Benchmark("a", "ms", _sides(50.0, 1.0), bound)).verdict == "ok"


def test_a_bound_on_a_ratio_needs_a_baseline() -> None:
    with pytest.raises(ValueError, match="needs a baseline"):
        measure(Benchmark("a", "ms", _sides(1.0, None), Bound(1.0, aim=1.0)))


def test_both_sides_are_sampled_in_turn() -> None:
    order: list[str] = []

    def sample(side: str) -> float:
        order.append(side)
        return 1.0

    sides = Sides(lambda: sample("s"), lambda: sample("b"))
    measure(Benchmark("a", "ns", lambda: nullcontext(sides), repetitions=4))
    assert "".join(order) == "sb" + "sb" + "bs" + "sb" + "bs"


@pytest.mark.parametrize(("repetitions", "quick"), [(15, 5), (9, 3), (5, 3), (1, 1)])
def test_a_quick_run_takes_a_third_of_the_samples_and_never_more_than_all(
    repetitions: int, quick: int
) -> None:
    samples: list[float] = []

    def sample() -> float:
        samples.append(1.0)
        return 1.0

    sides = Sides(sample)
    measure(Benchmark("a", "ns", lambda: nullcontext(sides), repetitions=repetitions), quick=True)
    assert len(samples) == 1 + quick  # the first one warms up


def test_the_ratio_is_the_median_of_the_ratios_and_not_of_the_medians() -> None:
    subject, baseline = iter([0.0, 1.0, 20.0, 30.0]), iter([0.0, 1.0, 10.0, 40.0])
    sides = Sides(lambda: next(subject), lambda: next(baseline))
    row = measure(Benchmark("a", "ns", lambda: nullcontext(sides), repetitions=3))
    assert (row.median, row.baseline, row.ratio) == (20.0, 10.0, 1.0)


def test_the_table_has_one_line_for_each_row() -> None:
    row = measure(Benchmark("codec x", "ns", _sides(260.0, 100.0), Bound(2.5, aim=1.8)))
    free = measure(Benchmark("start", "ms", _sides(1.5, None)))
    assert render([row, free]).splitlines() == [
        "name     median  unit  baseline  ratio  bound  aim",
        "codec x     260  ns         100   2.60    2.5  1.8  over",
        "start       1.5  ms",
    ]


def test_the_codec_benchmarks_cover_four_messages_both_ways() -> None:
    names = [each.name for each in codec.benchmarks() if each.name.startswith("codec ")]
    sizes = [f"({size} bytes)" for size in (60, 60, 68, 68, 148, 148, 152, 152)]
    assert [name.split(" ", 3)[-1] for name in names] == sizes


def test_the_program_prints_the_chosen_rows_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--json", "--quick", "--only", "codec decode joint_position"]
    assert program.main(arguments) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["unit"] == "ns"
    assert row["bound"] == 2.5
    assert row["ratio"] > 1.0


def test_a_benchmark_that_crashes_is_reported_and_the_others_still_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def crash() -> AbstractContextManager[Sides]:
        raise OSError("no port is free")

    rows = [Benchmark("a", "ns", crash), Benchmark("b", "ns", _sides(1.0, None))]
    monkeypatch.setattr(codec, "benchmarks", lambda: rows)
    monkeypatch.setattr(program, "MODULES", ("codec",))
    assert program.main([]) == 1
    captured = capsys.readouterr()
    assert "a crashed:" in captured.err
    assert "no port is free" in captured.err
    assert captured.out.splitlines()[1].startswith("b")
