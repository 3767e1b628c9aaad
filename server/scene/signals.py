"""Digital inputs and outputs of one cell's controller, as the server knows them.

Owns when they are read, how old a value may be, and the outcome of a write. Requests go over the
state connection, 16 signals at a time, so that no answer gets between those of points. Knows no
socket and no clock.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from openpendant.simplemsg import Message, ReplyCode, message_type
from openpendant.simplemsg.pendant import ReadSignals, ReadSignalsReply, SetInputs, WriteOutputs
from openpendant.simplemsg.verdicts import VerdictCode

from ..events.effects import Effect, QueryController
from ..programs.interpreter.run_events import Offer, OfferedSignals, SignalKind
from ..refusal import Refusal

BANK = 16
"""Signals of one message."""

PERIOD_NS = 50_000_000
"""Period in which all signals are read [ns]."""

LARGEST_AGE_NS = 250_000_000
"""Greatest age of a value that a program may use [ns]."""

PATIENCE_NS = 500_000_000
"""Longest wait for an answer [ns]."""

MOST_SIGNALS = 512

Told = Callable[[Refusal | None, int], list[Effect]]
"""Takes why a write was refused, None where it was done, and the time."""


@dataclass(slots=True)
class _Asked:
    """A question under way; answers come in order."""

    message: ReadSignals | WriteOutputs | SetInputs
    at: int
    told: Told | None = None


@dataclass(slots=True)
class _Bank:
    inputs: int = 0
    outputs: int = 0
    read: int = field(default=-LARGEST_AGE_NS)

    @property
    def values(self) -> tuple[int, int]:
        return self.inputs, self.outputs


class CellSignals:
    """Inputs and outputs of one cell.

    Attributes:
        changes: how often a value changed, or values came or were dropped.
    """

    def __init__(self, *, is_offered: bool) -> None:
        """Know nothing yet."""
        self.is_offered = is_offered
        self.changes = 0
        self._counts: tuple[int, int] | None = None
        self._banks: dict[int, _Bank] = {}
        self._asked: deque[_Asked] = deque()
        self._is_up = False
        self._next_round = 0

    # Messages of the controller.

    def link_changed(self, up: bool, now: int) -> list[Effect]:
        """Take a change of the state connection, and drop all values: they may be outdated."""
        self._is_up = up
        self.changes += self._counts is not None
        self._counts = None
        self._banks.clear()
        self._next_round = now
        asked, self._asked = self._asked, deque()
        lost = Refusal(VerdictCode.SIGNALS_UNAVAILABLE, "the connection was lost")
        return [item for one in asked if one.told for item in one.told(lost, now)]

    def tick(self, now: int) -> list[Effect]:
        """Read all signals when a period has passed."""
        if not (self.is_offered and self._is_up):
            return []
        if self._asked:
            return self._give_up(now) if now - self._asked[0].at > PATIENCE_NS else []
        if now < self._next_round:
            return []
        self._next_round = max(self._next_round + PERIOD_NS, now)
        most = BANK if self._counts is None else max(self._counts)
        return [
            item
            for first in range(0, min(most, MOST_SIGNALS), BANK)
            for item in self._ask(_Asked(ReadSignals(first), now))
        ]

    def answered(self, reply: Message, now: int) -> list[Effect]:
        """Take an answer on the state connection; ignore one to another request."""
        if not self._asked:
            return []
        asked = self._asked[0]
        if message_type(reply) != message_type(asked.message):
            return []
        self._asked.popleft()
        done = reply.reply_code == ReplyCode.SUCCESS
        if isinstance(reply, ReadSignalsReply):
            counts = (reply.input_count, reply.output_count)
            before = self._banks.get(reply.first)
            self._banks[reply.first] = bank = _Bank(reply.inputs, reply.outputs, now)
            self.changes += counts != self._counts or bank.values != (before and before.values)
            self._counts = counts
        elif isinstance(asked.message, WriteOutputs | SetInputs) and done:
            self._written(asked.message)
        if asked.told is None:
            return []
        text = "the controller refused to set the signal"
        return asked.told(None if done else Refusal(VerdictCode.CONTROLLER_REFUSED, text), now)

    def _written(self, message: WriteOutputs | SetInputs) -> None:
        bank = self._banks.setdefault(message.first, _Bank())
        before = bank.values
        if isinstance(message, SetInputs):
            bank.inputs = bank.inputs & ~message.mask | message.values & message.mask
        else:
            bank.outputs = bank.outputs & ~message.mask | message.values & message.mask
        self.changes += bank.values != before

    def _give_up(self, now: int) -> list[Effect]:
        """Drop the unanswered questions and all values."""
        up = self._is_up
        out = self.link_changed(up, now)
        self._next_round = now + PATIENCE_NS
        return out

    def _ask(self, asked: _Asked) -> list[Effect]:
        self._asked.append(asked)
        return [QueryController(asked.message)]

    # Questions and writes.

    @property
    def offer(self) -> Offer:
        """Signals that the controller offers; a refusal if none, None while unknown."""
        if not self.is_offered:
            text = 'this controller offers none; accepted: [controller] signals = "openpendant"'
            return Refusal(VerdictCode.SIGNALS_UNAVAILABLE, text)
        return None if self._counts is None else OfferedSignals(*self._counts)

    @property
    def inputs(self) -> tuple[bool, ...]:
        """All inputs as last read; none while nothing is known."""
        return self._values(0)

    @property
    def outputs(self) -> tuple[bool, ...]:
        """All outputs as last read; none while nothing is known."""
        return self._values(1)

    def _values(self, kind: int) -> tuple[bool, ...]:
        if self._counts is None:
            return ()
        values = []
        for signal in range(self._counts[kind]):
            bank = self._banks.get(signal // BANK * BANK, _Bank())
            bits = bank.outputs if kind else bank.inputs
            values.append(bool(bits >> signal % BANK & 1))
        return tuple(values)

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Return the value of an input, by number from 0, if it was read just now."""
        return self._fresh("input", 0, signal, now)

    def output(self, signal: int, now: int) -> bool | Refusal:
        """Return the value of an output, by number from 0, if it was read just now."""
        return self._fresh("output", 1, signal, now)

    def set_output(
        self, signal: int, value: bool, now: int, told: Told | None = None
    ) -> list[Effect] | Refusal:
        """Give an output a value.

        Args:
            signal: its number, from 0.
            told: called once the controller has set it or not.
        """
        refusal = self._absent("output", signal)
        if refusal is not None:
            return refusal
        bit = 1 << signal % BANK
        message = WriteOutputs(signal // BANK * BANK, bit, bit if value else 0)
        return self._ask(_Asked(message, now, told))

    def set_input(self, signal: int, value: bool, now: int, told: Told) -> list[Effect] | Refusal:
        """Give an input of an emulated controller a value, as its cabling would.

        Only for a controller that is known to be emulated: SET_INPUTS never goes to a real one.

        Args:
            signal: its number, from 0.
            told: called once the controller has set it or not.
        """
        refusal = self._absent("input", signal)
        if refusal is not None:
            return refusal
        bit = 1 << signal % BANK
        message = SetInputs(signal // BANK * BANK, bit, bit if value else 0)
        return self._ask(_Asked(message, now, told))

    def _fresh(self, what: SignalKind, kind: int, signal: int, now: int) -> bool | Refusal:
        refusal = self._absent(what, signal)
        if refusal is not None:
            return refusal
        age = now - self._banks.get(signal // BANK * BANK, _Bank()).read
        if age > LARGEST_AGE_NS:
            text = f"{what} {signal} was last read {age / 1e6:.0f} ms ago"
            return Refusal(
                VerdictCode.SIGNALS_UNAVAILABLE, text, value=age / 1e9, limit=LARGEST_AGE_NS / 1e9
            )
        return self._values(kind)[signal]

    def _absent(self, what: SignalKind, signal: int) -> Refusal | None:
        """Return why a signal cannot be used; None where it can."""
        offer = self.offer
        if offer is None:
            return Refusal(VerdictCode.SIGNALS_UNAVAILABLE)
        return offer if isinstance(offer, Refusal) else offer.absent(what, signal)
