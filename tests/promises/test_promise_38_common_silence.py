"""Where key and enabling device fall silent together, the key ends first: no STOP (promise 38)."""

import itertools
import random
from collections.abc import Sequence

import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.server_rig import MS, TICK
from rigs.cells.two_hands import HELD, Seen, TwoHands, both, device, tick_at, two_hands

from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode as V

MODES = ("manual_reduced", "manual_high", "recovery")
DEADLINES = (0.05, 0.1, 0.15, 0.25)
THE_CELLS = 0.15

Pair = tuple[int, float, float]
"""Version, deadline of the press, of the enabling device [s]."""

PAIRS: list[Pair] = [
    *((2, press, THE_CELLS) for press in DEADLINES),
    *((3, press, silence) for press in DEADLINES for silence in DEADLINES if press <= silence),
]

SHORTEST, LONGEST = figure(38, "shortest").ns, figure(38, "longest").ns
SILENCES = [SHORTEST, 100 * MS, 149 * MS, 150 * MS, 151 * MS, 250 * MS, 260 * MS, LONGEST]

WRITES = {"whole": 0, "cut": 1, "cut by a tick": TICK - 1, "first part alone": 0, "a press": 0}
"""The last write before a silence, and how long after its first part the rest comes [ns]."""


def fall_silent(hands: TwoHands, press: float, length: int, write: str, phase: int) -> bool:
    """Write once more, nothing for a while, and then as before; return whether the press ended."""
    hands.rest()
    hands.jog(press)
    last, deadline = phase + WRITES[write], round(press * 1e9)
    timeline = [(phase, device(HELD))]
    if write == "a press":
        timeline.append((phase, lambda hands: hands.key_again(press)))
    elif write == "first part alone":
        last = 0
    else:
        timeline.append((last, lambda hands: hands.beat()))
    thaw = phase + length
    hands.play([*timeline, *both(thaw, thaw + 200 * MS)], thaw + 200 * MS)
    seen = hands.seen()
    assert seen.stop is None
    if thaw < last + deadline:
        assert seen.ramp is None
        assert seen.told in (None, JogEnd.REPLACED)
        return False
    assert seen == Seen(tick_at(last + deadline), None, JogEnd.SILENT, V.ACCEPTED)
    return True


def judge(cases: Sequence[tuple[str, Pair, int, str]]) -> None:
    chance, ended = random.Random(38), 0
    for (mode, pair), group in itertools.groupby(cases, lambda case: case[:2]):
        version, press, silence = pair
        hands = two_hands(mode, version=version, silence=silence)
        for _, _, length, write in group:
            ended += fall_silent(hands, press, length, write, chance.randrange(TICK))
    tell(f"promise 38: {ended} of {len(cases)} silences ended a press, none made a STOP")
    assert 0.3 < ended / len(cases) < 0.9


ALL = list(itertools.product(MODES, PAIRS, SILENCES, WRITES))


@pytest.mark.parametrize("mode", MODES)
def test_promise_38_common_silence_ends_as_a_silent_press_or_not_at_all(mode: str) -> None:
    judge([case for case in ALL if case[0] == mode][:: len(MODES) * 4 - 1])


@pytest.mark.soak
def test_promise_38_common_silence_never_makes_a_stop_whatever_wrote_last() -> None:
    judge(ALL)
