"""One rule applied to one frame: what each fault does.

Pure. How bytes are changed is `frame_surgery`'s business, how they wait is `fault_lane`'s, and
which rule fits is `fault_engine`'s.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from ..live.relay import Action, CloseBoth, Freeze, ProxyLinkId, ResetBoth
from ..trace import TraceDirection
from . import fault_rules as faults
from . import frame_surgery as surgery
from .fault_lane import Awaited, Lane, Prepared, Traffic, nanoseconds


@dataclass(frozen=True, slots=True)
class FaultCase:
    """One rule applied to one frame."""

    form: surgery.FrameForm
    prepared: Prepared
    traffic: Traffic
    direction: TraceDirection
    link: ProxyLinkId
    frame: bytes
    now: int

    @property
    def _lane(self) -> Lane:
        return self.traffic.lanes[self.direction]

    def apply(self) -> tuple[str, bool]:
        """Do the fault; return what was done, and whether the receiver will owe a reply.

        What was done is empty where the fault is done to the reply, once that comes.
        """
        expects = surgery.is_request(self.frame)
        match self.prepared.rule:
            case faults.Drop():
                return "dropped", False
            case faults.LostReply():
                return self._lose_reply(), False
            case faults.Refuse():
                return self._refuse(), False
            case faults.Busy():
                return self._be_busy(), False
            case faults.ResetLink() | faults.CloseLink() | faults.HalfOpen() as rule:
                return self._end(rule), False
            case faults.Duplicate() as rule:
                for _ in range(1 + rule.copies):
                    self._lane.put(self.frame, self.now)
                for _ in range(rule.copies if expects else 0):
                    self.traffic.awaited[self.direction].append(Awaited())
                return f"sent {1 + rule.copies} times", expects
            case faults.Corrupt() | faults.WrongByteOrder() as rule:
                return self._change(rule), expects
            case rule:
                return self._put_off(rule), expects

    def _put_off(
        self,
        rule: faults.Delay | faults.Split | faults.Coalesce | faults.Throttle | faults.Reorder,
    ) -> str:
        lane, frame, now = self._lane, self.frame, self.now
        match rule:
            case faults.Delay():
                ms = rule.ms + self.prepared.chance.random() * rule.jitter_ms
                lane.put(frame, now, delay=nanoseconds(ms))
                return f"held {ms:.3f} ms"
            case faults.Split():
                return self._split(rule)
            case faults.Coalesce():
                lane.gather(frame, now, rule.frames, nanoseconds(rule.within_ms))
                return f"held for {rule.frames} frames or {rule.within_ms:g} ms"
            case faults.Throttle():
                lane.put_at_rate(frame, now, rule.bytes_per_s)
                return f"slowed to {rule.bytes_per_s:g} bytes/s"
            case faults.Reorder():
                lane.set_aside(frame, now, rule.overtaken_by, nanoseconds(rule.within_ms))
                return f"set aside for {rule.overtaken_by} frames or {rule.within_ms:g} ms"

    def _split(self, rule: faults.Split) -> str:
        gap = nanoseconds(rule.gap_ms)
        if rule.size is not None:
            self._lane.put(self.frame, self.now, piece=rule.size, gap=gap)
            return f"sent in pieces of {rule.size} bytes"
        cuts = sorted({0, *(cut for cut in rule.at if cut < len(self.frame)), len(self.frame)})
        pieces = [self.frame[start:end] for start, end in pairwise(cuts)]
        self._lane.put_pieces(pieces, self.now, gap)
        return f"cut into {len(pieces)} pieces"

    def _change(self, rule: faults.Corrupt | faults.WrongByteOrder) -> str:
        changed, detail = self._changed(rule)
        self._lane.put(changed, self.now)
        return detail

    def _changed(self, rule: faults.Corrupt | faults.WrongByteOrder) -> tuple[bytes, str]:
        frame, chance = self.frame, self.prepared.chance
        if isinstance(rule, faults.WrongByteOrder):
            return surgery.in_other_order(frame, self.form), "sent in the other byte order"
        match rule.how:
            case faults.Corruption.BITS:
                changed = surgery.with_flipped_bits(frame, rule.bits, rule.offset, chance)
                wrong = [at for at, byte in enumerate(frame) if byte != changed[at]]
                return changed, f"bits flipped in bytes {', '.join(map(str, wrong))}"
            case faults.Corruption.LENGTH:
                return surgery.with_wrong_length(frame, rule.by), f"length field {rule.by:+d}"
            case faults.Corruption.TRUNCATE:
                cut = surgery.truncated(frame, rule.by)
                return cut, f"{len(frame) - len(cut)} bytes of the body cut off"
            case faults.Corruption.VALID_FIELDS:
                garbled = surgery.with_garbage_valid_fields(frame, self.form, chance)
                if garbled is None:
                    return frame, "forwarded as it was: it has no valid_fields"
                return garbled, "garbage in the upper bits of valid_fields"

    def _end(self, rule: faults.ResetLink | faults.CloseLink | faults.HalfOpen) -> str:
        if rule.forward:
            self._lane.put(self.frame, self.now)
        match rule:
            case faults.ResetLink():
                action: Action = ResetBoth(self.link)
                detail = "connection reset"
            case faults.CloseLink():
                action, detail = CloseBoth(self.link), "connection closed"
            case faults.HalfOpen():
                action, detail = Freeze(self.link), "connection half-open from here on"
        self._lane.put_action(action, self.now)
        return detail

    def _lose_reply(self) -> str:
        if surgery.is_reply(self.frame):
            return "the reply is lost"
        self._lane.put(self.frame, self.now)
        if not surgery.is_request(self.frame):
            return "forwarded as it was: nobody replies to it"
        self._owe(Awaited(lost_by=self.prepared))
        return ""

    def _refuse(self) -> str:
        if not surgery.is_request(self.frame):
            self._lane.put(self.frame, self.now)
            return "forwarded as it was: no request"
        self._owe(Awaited(answer=surgery.failure_reply(self.frame, self.form)))
        return "answered with failure, not forwarded"

    def _be_busy(self) -> str:
        if not surgery.is_request(self.frame):
            self._lane.put(self.frame, self.now)
            return "forwarded as it was: no request"
        if surgery.has_busy_answer(self.frame, self.form):
            self._owe(Awaited(answer=surgery.busy_reply(self.frame, self.form)))
            return "answered busy, not forwarded"
        self._lane.put(self.frame, self.now)
        self._owe(Awaited(withheld_by=self.prepared))
        return ""

    def _owe(self, awaited: Awaited) -> None:
        self.traffic.awaited[self.direction].append(awaited)
