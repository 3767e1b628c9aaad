"""Keys and enabling devices in any order, with ticks that come late (promise 37).

What leaves is compared with rules that were written anew (`press_rules`), in each turn: whether a
STOP leaves, whether a press may move the robot, whether the robot slows down, and what is told.
"""

import random
from collections import Counter
from collections.abc import Callable

import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.press_rules import PressRules
from rigs.cells.server_rig import MS, TICK
from rigs.cells.two_hands import HELD, PANIC, RELEASED, TwoHands, two_hands

from openpendant.simplemsg.pendant import Activity, JogEnded

FEW = 300
WRITE = 50 * MS
LENGTH = 900 * MS
MODES = ("manual_reduced", "manual_high", "recovery")
DEADLINES = [(3, 0.25, 0.25), (3, 0.15, 0.25), (3, 0.05, 0.05), (2, 0.25, 0.15), (2, 0.05, 0.15)]

Happening = tuple[int, str]
"""When it arrives [ns], and what."""


def _written(chance: random.Random, at: int) -> list[Happening]:
    """Return a write of a page: in one packet, or cut into two."""
    gap = chance.choice((0, 0, 0, 0, 0, 1, chance.randrange(15 * MS)))
    return [(at, "held"), (at + gap, "beat")]


def _released(chance: random.Random, at: int) -> list[Happening]:
    """Return a release of both hands, in either order, and perhaps a press some time after it."""
    gap = chance.choice((0, 1, chance.randrange(35 * MS)))
    hands = ["key up", "released"]
    chance.shuffle(hands)
    out = [(at, hands[0]), (at + gap, hands[1])]
    if chance.random() < 0.7:
        later = at + gap + chance.choice((0, 1, chance.randrange(200 * MS)))
        out += [(later, "held"), (later, "press")]
    return out


def happenings(chance: random.Random) -> list[Happening]:
    """Return what arrives in a run, in order."""
    out: list[Happening] = []
    at = 0
    while at < LENGTH - 300 * MS:
        at += chance.randrange(1, WRITE)
        match chance.choices(range(10), (12, 2, 2, 2, 3, 2, 1, 2, 2, 3))[0]:
            case 0:
                for _ in range(chance.randrange(1, 5)):
                    out += _written(chance, at)
                    at += WRITE
            case 1:
                at += chance.randrange(400 * MS)
            case 2 | 3 as alone:
                for _ in range(chance.randrange(1, 7)):
                    out.append((at, "beat" if alone == 2 else "held"))
                    at += WRITE
            case 4:
                out += _released(chance, at)
            case 5:
                out += [(at, "released"), (at + chance.randrange(25 * MS), "held")]
            case 6:
                out.append((at, "panic"))
            case 7:
                out += [(at, "held")] * chance.randrange(2) + [(at, "press")]
            case 8:
                until = at + chance.randrange(200 * MS)
                merged = [each for write in range(3) for each in _written(chance, until)]
                out += [(until, what) for _, what in merged]
            case 9:
                again = at + chance.randrange(250 * MS)
                out += [(at, "key up"), (at, "released"), (again, "held"), (again, "press")]
    return sorted(out, key=lambda each: each[0])


def late_ticks(chance: random.Random) -> list[int]:
    """Return the ticks that do not come; no more than eight in a row, which stops nothing else."""
    out: list[int] = []
    for _ in range(chance.randrange(3)):
        first = chance.randrange(1, LENGTH // TICK - 20)
        out += [(first + tick) * TICK for tick in range(chance.randrange(1, 9))]
    together = sorted(set(out))
    return [at for at in together if not all(at - n * TICK in together for n in range(1, 9))]


class Interleaving:
    """One run, with the rules beside it."""

    def __init__(self, hands: TwoHands, press: float, silence: float, counts: Counter[str]) -> None:
        hands.rest()
        hands.jog(press)
        self._hands, self._press, self._counts = hands, press, counts
        self._rules = PressRules(round(silence * 1e9))
        self._rules.device(HELD, hands.rig.now)
        self._rules.pressed(hands.press_number, round(press * 1e9), hands.rig.now)
        self._rules.beat(hands.press_number, hands.beat_number, hands.rig.now)
        self._acts: dict[str, Callable[[], None]] = {
            "held": lambda: self._sign(HELD),
            "released": lambda: self._sign(RELEASED),
            "panic": lambda: self._sign(PANIC),
            "beat": self._beat,
            "key up": self._key_up,
            "press": self._key_down,
        }

    def run(self, chance: random.Random) -> None:
        timeline = [(at, lambda _, act=self._acts[what]: act()) for at, what in happenings(chance)]
        self._hands.play(timeline, LENGTH, late_ticks(chance), self._tick)

    # What is seen.

    @property
    def _is_driven(self) -> bool:
        return self._hands.rig.core.cell.driving.driven_jog is not None

    def _turn(self, act: Callable[[], object]) -> bool:
        """Let something happen; return whether a STOP left that ended a jog."""
        rig, was_driven = self._hands.rig, self._is_driven
        before = len(rig.stops)
        act()
        return was_driven and len(rig.stops) > before

    def _agree(self, was_driven: bool) -> None:
        jog = self._hands.rig.core.cell.driving.driven_jog
        assert (jog is not None and jog.press.ended is None) == self._rules.is_held
        if jog is None and was_driven:
            told = self._hands.pendant.all(JogEnded)[-1].reason
            assert told == self._rules.why
            self._counts[f"{self._rules.why.name.lower()}"] += 1
            self._rules.at_rest()

    # What happens.

    def _sign(self, position: int) -> None:
        was_driven = self._is_driven
        stopped = self._turn(lambda: self._hands.device(position))
        assert stopped == (self._rules.device(position, self._hands.rig.now) and was_driven)
        self._agree(was_driven)

    def _beat(self) -> None:
        hands = self._hands
        assert not self._turn(hands.beat)
        self._rules.beat(hands.press_number, hands.beat_number, hands.rig.now)

    def _key_up(self) -> None:
        hands = self._hands
        assert not self._turn(hands.key_up)
        self._rules.released(hands.press_number, hands.rig.now)

    def _key_down(self) -> None:
        hands = self._hands
        takes = hands.rig.activity() in (Activity.IDLE, Activity.JOGGING)
        may = self._rules.may_press(hands.rig.now)
        hands.rate = 1.0 if hands.rig.controller.position[0] < 0 else -1.0
        assert not self._turn(lambda: hands.key_again(self._press))
        assert hands.is_pressed == (may and takes)
        self._counts["presses taken"] += hands.is_pressed
        self._counts["presses refused"] += not may
        if hands.is_pressed:
            self._rules.pressed(hands.press_number, round(self._press * 1e9), hands.rig.now)

    def _tick(self) -> None:
        rig, was_driven = self._hands.rig, self._is_driven
        before = self._hands.newest_speed
        stopped = self._turn(rig.tick)
        assert stopped == self._rules.tick(rig.now)
        if self._is_driven and not self._rules.is_held:
            assert self._hands.newest_speed < before or before == self._hands.newest_speed == 0.0
        self._agree(was_driven)


def interleave(runs: int, seed: int) -> Counter[str]:
    chance, counts = random.Random(seed), Counter[str]()
    for first in range(0, runs, 10):
        version, press, silence = chance.choice(DEADLINES)
        hands = two_hands(chance.choice(MODES), version=version, silence=silence)
        for _ in range(min(10, runs - first)):
            Interleaving(hands, press, silence, counts).run(chance)
    return counts


@pytest.mark.parametrize("seed", range(6))
def test_promise_37_nothing_moves_beyond_the_table_whatever_comes_when(seed: int) -> None:
    counts = interleave(FEW // 6, seed)
    assert min(counts[each] for each in ("released", "silent", "stopped", "presses taken")) > 3


@pytest.mark.soak
@pytest.mark.timeout(3_600)
def test_promise_37_nothing_moves_beyond_the_table_in_ten_thousand_interleavings() -> None:
    counts = interleave(figure(37, "interleavings").count, seed=37)
    tell(f"promise 37: {dict(counts)}")
    assert min(counts[each] for each in ("released", "silent", "stopped", "presses taken")) > 500
