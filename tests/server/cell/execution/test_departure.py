from __future__ import annotations

from random import Random

import pytest
from rigs.cells.server_rig import LIMITS

from openpendant.motion.trajectory.ptp import straight_move
from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.setpoint_guard import SetpointGuard
from openpendant.server.refusal import Refusal

GOAL = (1.0, -0.5)


def check_all(rows: list[Row]) -> int | None:
    check = SetpointGuard(LIMITS)
    for index, row in enumerate(rows):
        refusal = check.check(row)
        if refusal is not None:
            return index
    return None


@pytest.mark.parametrize("speed", [0.01, 0.5, 1.0])
@pytest.mark.parametrize("goal", [(1.0, -0.5), (2.0, 2.0), (1e-4, 0.0), (-2.0, 0.003)])
def test_what_was_certified_leaves(goal: tuple[float, float], speed: float) -> None:
    move = straight_move((0.0, 0.0), goal, LIMITS, speed=speed)
    assert check_all([move.row(index) for index in range(len(move))]) is None


def walk(chance: Random) -> list[Row]:
    step = chance.choice((0.004, 0.01, 0.02))
    push = [
        chance.choice((0.01, 0.1, 0.5, 0.999, 1.0015)) * chance.choice((-1, 0, 1)) for _ in "ab"
    ]
    gains = [share * most * step for share, most in zip(push, LIMITS.acceleration, strict=True)]
    row = Row(0.0, [chance.uniform(-1.9, 1.9) for _ in push], [0.0, 0.0], [])
    rows, jumps_at = [row], chance.randrange(200)
    for index in range(200):
        velocity = [speed + gain for speed, gain in zip(row.velocity, gains, strict=True)]
        shift = chance.choice((0.24, 0.26)) * LIMITS.acceleration[0] * step**2
        means = zip(row.position, row.velocity, velocity, strict=True)
        position = [at + 0.5 * (a + b) * step for at, a, b in means]
        if index == jumps_at:
            position[chance.randrange(2)] += shift
        row = Row(row.time + step, position, velocity, [])
        rows.append(row)
    return rows


@pytest.mark.parametrize("start", [None, (2.2, 0.0)])
@pytest.mark.parametrize("seed", range(60))
def test_a_glance_lets_nothing_leave_that_a_look_at_each_joint_would_hold(
    seed: int, start: tuple[float, float] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same verdict on each sample, word for word, up to the first that is held."""
    rows = walk(Random(seed))

    def told() -> list[Refusal | None]:
        check = SetpointGuard(LIMITS, start)
        verdicts = []
        for row in rows:
            verdicts.append(check.check(row))
            if verdicts[-1] is not None:
                break
        return verdicts

    at_a_glance = told()
    monkeypatch.setattr(SetpointGuard, "_is_surely_sound", lambda *_: False)
    assert at_a_glance == told()


def test_a_glance_is_enough_for_nearly_all_of_a_slow_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    move = straight_move((0.0, 0.0), GOAL, LIMITS, speed=0.3)
    look, looks = SetpointGuard._fault, 0

    def counted(check: SetpointGuard, row: Row, last: Row, step: float) -> Refusal | None:
        nonlocal looks
        looks += 1
        return look(check, row, last, step)

    monkeypatch.setattr(SetpointGuard, "_fault", counted)
    assert check_all([move.row(index) for index in range(len(move))]) is None
    assert looks < 0.3 * len(move)
