import pytest
from promises.promise_figures import FEW, LATE, REPEATS, SLACK, VOID_SHARE, Figures, trials_of
from promises.promise_table import COMMON, Figure, figure
from rigs.clock.busy_machine import SCALE
from rigs.clock.stall_watch import StallWatch

MS = 1_000_000


class Idle(StallWatch):
    def __init__(self) -> None:
        self.time = 100.0
        self.told: list[tuple[float, float]] = []

    def now(self) -> float:
        return self.time

    def stalls(self, more_than: float) -> list[tuple[float, float]]:
        return [(due, woke) for due, woke in self.told if woke - due > more_than]


@pytest.fixture
def idle() -> Idle:
    return Idle()


def measure(
    figures: Figures, idle: Idle, count: int, delay: float = 5.0, late: float = 0.0
) -> None:
    for _ in range(count):
        began = idle.time
        if late:
            idle.told.append((began + 0.5, began + 0.5 + late))
        idle.time += 1.0
        figures.take(round(began * 1e9), delay)
        figures.idle.append(1.0)
        idle.time += 0.1


def test_a_sample_of_a_quiet_machine_counts(idle: Idle) -> None:
    figures = Figures("x", idle)
    measure(figures, idle, 20, late=LATE)
    assert not figures.need_more(20, 10.0)
    assert (len(figures.delays), figures.void) == (20, 0)


def test_a_void_sample_is_left_out_told_and_measured_again(
    idle: Idle, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = Figures("x", idle)
    measure(figures, idle, 19)
    measure(figures, idle, 1, delay=500.0, late=2 * LATE)
    assert figures.need_more(20, 10.0)
    assert "1 of 20 void" in capsys.readouterr().out
    measure(figures, idle, 1)
    assert not figures.need_more(20, 10.0)
    figures.judge(10.0)
    assert "1 void" in capsys.readouterr().out


def test_a_slow_sample_that_is_not_void_counts(idle: Idle) -> None:
    figures = Figures("x", idle)
    measure(figures, idle, 19)
    measure(figures, idle, 1, delay=500.0)
    with pytest.raises(AssertionError, match=f"allowed: p99 {10 * SCALE:g} ms"):
        figures.judge(10.0)


def test_a_run_with_more_than_a_tenth_void_is_repeated_and_fails_in_the_end(idle: Idle) -> None:
    figures = Figures("x", idle)
    for _ in range(REPEATS):
        measure(figures, idle, 17)
        measure(figures, idle, 3, late=2 * LATE)
        assert figures.need_more(20, 10.0)
        assert figures.delays == []
    measure(figures, idle, 17)
    measure(figures, idle, 3, late=2 * LATE)
    with pytest.raises(AssertionError, match="void"):
        figures.need_more(20, 10.0)


def test_a_run_with_no_more_than_a_tenth_void_goes_on(idle: Idle) -> None:
    figures = Figures("x", idle)
    measure(figures, idle, 18)
    measure(figures, idle, 2, late=2 * LATE)
    assert figures.need_more(20, 10.0)
    assert len(figures.delays) == 18
    assert pytest.approx(0.1) == VOID_SHARE


def test_a_few_trials_are_given_slack_and_all_of_the_soak_none() -> None:
    few, many = trials_of(Figure(20, "ms", 1_000))
    assert getattr(few, "values", None) == (FEW, SLACK)
    assert getattr(many, "values", None) == (1_000, 1.0)
    assert figure(COMMON, "few").count == FEW
