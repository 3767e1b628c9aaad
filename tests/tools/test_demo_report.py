import csv
from pathlib import Path

import numpy as np
import pytest

from openpendant.tools.demo_report import (
    DemoResult,
    Samples,
    TourMotion,
    tracking,
    write_csv,
    write_plot,
)

PERIOD = 0.01
DURATION = 2.0


def swing(times: np.ndarray, begin: float) -> Samples:
    """One joint that goes from 0 to 1 and comes to rest, from `begin` on."""
    u = np.clip((times - begin) / DURATION, 0.0, 1.0)[:, np.newaxis]
    inside = (u > 0) & (u < 1)
    return Samples(
        times,
        u**2 * (3 - 2 * u),
        np.where(inside, 6 * u * (1 - u) / DURATION, 0.0),
        np.where(inside, (6 - 12 * u) / DURATION**2, 0.0),
    )


PLANNED = swing(np.arange(0.0, DURATION + PERIOD / 2, PERIOD), 0.0)
LOG = np.arange(-0.5, 3.0, PERIOD) + 0.0037


@pytest.mark.parametrize("delay", [0.0, 0.0021, 0.0173, 0.05])
def test_the_start_delay_is_found_and_does_not_count_as_an_error(delay: float) -> None:
    found, error = tracking(PLANNED, swing(LOG, delay), until=float("inf"))
    assert found == pytest.approx(delay, abs=1e-5)
    assert error < 1e-6


def test_a_robot_that_leaves_its_path_is_seen() -> None:
    executed = swing(LOG, 0.0)
    executed.position[120] += 0.02
    _, error = tracking(PLANNED, executed, until=float("inf"))
    assert error == pytest.approx(0.02, rel=0.5)


def test_what_belongs_to_the_next_motion_is_not_compared() -> None:
    executed = swing(LOG, 0.0)
    executed.position[LOG > DURATION + 0.02] += 0.5
    _, error = tracking(PLANNED, executed, until=DURATION + 0.02)
    assert error < 1e-6


@pytest.fixture
def result() -> DemoResult:
    motion = TourMotion("swing", PLANNED, 0.004, 0.93, 0.002, 1e-6)
    return DemoResult("robot", ("joint",), (motion,), swing(LOG, 0.002), 0, 8)


def test_the_table_holds_plan_and_execution(result: DemoResult, tmp_path: Path) -> None:
    with write_csv(result, tmp_path / "demo.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    kinds = [row["kind"] for row in rows]
    assert kinds.count("planned") == len(PLANNED.times)
    assert kinds.count("executed") == len(LOG)
    last = [row for row in rows if row["kind"] == "planned"][-1]
    assert float(last["joint.position"]) == 1.0
    assert float(last["time"]) == pytest.approx(DURATION + 0.002)


def test_the_plot_is_a_picture(result: DemoResult, tmp_path: Path) -> None:
    plot = write_plot(result, tmp_path / "demo.png")
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert plot.stat().st_size > 10_000


def test_the_summary_names_every_figure(result: DemoResult) -> None:
    text = result.text()
    for part in ("plan time", "motion time", "tracking error", "limit ratio", "0 violations"):
        assert part in text
