"""Where key and enabling device fall silent together, the key ends first: no STOP (promise 38)."""

import random
from collections.abc import Iterator

import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.server_rig import MS, TICK
from rigs.cells.two_hands import (
    HELD,
    PERIOD,
    RELEASED,
    Seen,
    TwoHands,
    both,
    device,
    tick_at,
    two_hands,
)

from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode as V

MODES = ("manual_reduced", "manual_high", "recovery")
DEADLINES = (0.05, 0.1, 0.15, 0.25)
PAIRS = [
    (version, press, silence)
    for version in (2, 3)
    for press in DEADLINES
    for silence in ((0.15,) if version == 2 else DEADLINES)
    if version == 2 or press <= silence
]
"""Version, deadline of the press, of the enabling device [s]; version 2 has the cell's."""

SILENCES = [milliseconds * MS for milliseconds in (50, 100, 140, 150, 160, 249, 250, 251, 700)]

Write = tuple[str, int]
"""The last write before a silence: what it is, and how long after its first part the rest comes."""

WRITES: list[Write] = [
    ("whole", 0),
    ("cut", 1),
    ("cut", TICK - 1),
    ("first part alone", 0),
    ("press", 0),
]


def silences(pairs: list[tuple[int, float, float]]) -> Iterator[tuple[TwoHands, int, float, Write]]:
    """Yield hands that fell silent, for how long [ns], the deadline of their press, and how."""
    for mode in MODES:
        for version, press, silence in pairs:
            hands = two_hands(mode, version=version, silence=silence)
            for length in SILENCES:
                for write in WRITES:
                    while hands.rig.core.cell.is_busy:
                        hands.rig.wait(10)
                    hands.jog(press)
                    yield hands, length, press, write


def fall_silent(hands: TwoHands, length: int, press: float, write: Write, phase: int) -> Seen:
    """Write once more, and nothing for a while; then go on as before."""
    kind, gap = write
    on = "beat" if kind != "press" else "press"
    away = 1.0 if hands.rig.controller.position[0] < 0 else -1.0
    timeline = [(phase, device(HELD))]
    if on == "press":
        timeline += [(phase, lambda hands: hands.press(away, 0.0, deadline=press))]
    elif kind != "first part alone":
        timeline += [(phase + gap, lambda hands: hands.beat())]
    thaw = phase + length
    hands.play([*timeline, *both(thaw, thaw + 300 * MS)], thaw + 300 * MS)
    return hands.seen()


def judge(hands: TwoHands, length: int, press: float, write: Write, phase: int) -> bool:
    """Fall silent; return whether the press ended, which only its own silence may do."""
    kind, gap = write
    beaten = phase + gap if kind != "first part alone" else 0
    due = beaten + round(press * 1e9)
    seen = fall_silent(hands, length, press, write, phase)
    assert seen.stop is None
    if phase + length < due:
        assert (seen.ramp, seen.told in (None, JogEnd.REPLACED)) == (None, True)
        return False
    assert seen == Seen(tick_at(due), None, JogEnd.SILENT, V.ACCEPTED)
    return True


def test_promise_38_common_silence_ends_as_a_silent_press_or_not_at_all() -> None:
    chance, ended = random.Random(38), 0
    cases = [*silences(PAIRS[::3])]
    for hands, length, press, write in []:
        ended += judge(hands, length, press, write, chance.randrange(TICK))
    tell(f"promise 38: {ended} of {len(cases)}")
