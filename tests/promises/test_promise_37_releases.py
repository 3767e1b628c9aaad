"""The ramp of a jog that is released takes no longer than the ramp time (promise 37).

Tool jogs at the greatest speeds that the settings know, from anywhere, over the whole catalogue: a
ramp leads along the path of the tool, so it takes longer than the joints would need by themselves.
"""

import math
import zlib

import numpy as np
import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.motion.jogged_robots import model, random_place, robot
from rigs.motion.loaded_robots import SERIAL

from openpendant.motion import jog
from openpendant.server.cell.hold_to_run import ramp_time
from openpendant.server.settings.cell_settings import JogSettings

TICK_RATE = 100


def _greatest(name: str) -> float:
    bounds = JogSettings.model_fields[name].metadata
    return next(float(bound.le) for bound in bounds if hasattr(bound, "le"))


FASTEST = jog.JogCaps(
    joint_fraction=1.0,
    tool_speed=_greatest("tool_speed"),
    rotation_speed=_greatest("rotation_speed"),
    reduced=False,
)


def _press(random: np.random.Generator) -> jog.ToolJog:
    """Return a press of one key, or of several, of the tool at full speed."""
    rates = random.choice((-1.0, 0.0, 1.0), 6, p=(0.15, 0.7, 0.15))
    rates[random.integers(6)] = random.choice((-1.0, 1.0))
    axes = None if random.random() < 0.3 else jog.BASE_AXES
    return jog.ToolJog(tuple(rates[:3]), tuple(rates[3:]), axes)


def ramps(name: str, releases: int, random: np.random.Generator) -> list[int]:
    """Return how many ticks the ramp took of each release of a robot that moved."""
    took: list[int] = []
    tries = 0
    while len(took) < releases:
        tries += 1
        assert tries < 20 * releases, f"{name} hardly ever moves"
        jogger = jog.Jogger(model(name), random_place(name, random), FASTEST)
        jogger.aim(_press(random))
        for _ in range(random.integers(5, 120)):
            step = jogger.step(1.0 / TICK_RATE)
        if step.at_rest:
            continue
        jogger.aim(None)
        ticks = 1
        while not jogger.step(1.0 / TICK_RATE).at_rest:
            ticks += 1
        took.append(ticks)
    return took


def judge(name: str, releases: int) -> float:
    """Release so often; return the longest ramp as a share of the ramp time."""
    random = np.random.default_rng(zlib.crc32(name.encode()))
    longest = ramp_time(robot(name).limits, TICK_RATE)
    # The first set-point of the ramp leaves at its beginning, and at the end none may be left.
    worst = (max(ramps(name, releases, random)) - 1) / TICK_RATE
    tell(f"promise 37: {name} {worst:.2f} s of {longest:.2f} s")
    assert worst < longest, name
    return worst / longest


@pytest.mark.parametrize("name", ["ur5", "puma560", "fanuc_m410ib"])
def test_promise_37_a_released_tool_jog_ramps_within_the_ramp_time(name: str) -> None:
    judge(name, releases=12)


@pytest.mark.soak
@pytest.mark.timeout(3_600)
def test_promise_37_no_release_outlasts_the_ramp_time_in_the_whole_catalogue() -> None:
    each = math.ceil(figure(37, "releases").count / len(SERIAL))
    assert max(judge(name, each) for name in SERIAL) > 0.5
