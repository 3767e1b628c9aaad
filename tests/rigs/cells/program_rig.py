"""A run of a program against an imagined robot: events go in, actions come out as short texts."""

from __future__ import annotations

from collections.abc import Mapping

from rigs.data.program_samples import linked

from openpendant.server.programs.interpreter.motion_blocks import BlockMove, MotionBlock
from openpendant.server.programs.interpreter.run_events import (
    Action,
    AttachToTool,
    DetachFromTool,
    Event,
    EventRefused,
    Failed,
    Finished,
    InputValue,
    PauseMotion,
    QueryInput,
    ReplaceBreakpoints,
    RequestAborted,
    RequestDone,
    RequestMotion,
    ResumeMotion,
    RunReport,
    Start,
    StopMotion,
    TimePassed,
    WriteOutput,
)
from openpendant.server.programs.interpreter.runner import Runner
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.statements import Way


class ProgramRig:
    """A runner with its clock.

    Attributes:
        now: monotonic time [ns].
        actions: all actions so far, but for reports.
        request: number of the request made last.
    """

    def __init__(self, statements: str, others: Mapping[str, str] | None = None) -> None:
        self.runner = Runner(linked(statements, others))
        self.now = 0
        self.actions: list[Action] = []
        self.request = 0

    def do(self, event: Event) -> list[str]:
        found = [each for each in self.runner.handle(event, self.now) if not _is_report(each)]
        self.actions += found
        for action in found:
            self.request = getattr(action, "request", self.request)
        return [text_of(action) for action in found]

    def start(self, index: int = 0, passes: int | None = 1, *, step: bool = False) -> list[str]:
        return self.do(Start(index, passes, step))

    def done(self) -> list[str]:
        return self.do(RequestDone(self.request))

    def value(self, value: bool) -> list[str]:
        return self.do(InputValue(self.request, value))

    def abort(self, refusal: Refusal) -> list[str]:
        return self.do(RequestAborted(self.request, refusal))

    def after(self, seconds: float) -> list[str]:
        """Let time go on, with one tick at its end."""
        self.now += round(seconds * 1e9)
        return self.do(TimePassed())

    def ticks(self, most: int = 100) -> list[str]:
        """Let ticks of 10 ms go by until something comes out; return that."""
        for _ in range(most):
            if found := self.after(0.01):
                return found
        raise AssertionError(f"nothing came out in {most} ticks")

    def break_at(self, *places: tuple[str, int]) -> None:
        self.do(ReplaceBreakpoints(frozenset(places)))

    @property
    def block(self) -> MotionBlock:
        return next(a.block for a in reversed(self.actions) if isinstance(a, RequestMotion))

    @property
    def here(self) -> list[tuple[str, int]]:
        """The call stack: program and number of the statement."""
        return [(place.program, place.index) for place in self.runner.status.stack]

    def run_out(self, limit: int = 10_000) -> list[str]:
        """Answer everything with success, inputs with on, until the run ends; return the log."""
        log: list[str] = []
        found = self.start()
        for _ in range(limit):
            log += found
            if not found or found[-1] == "finished" or found[-1].startswith("failed"):
                return log
            if isinstance(self.actions[-1], QueryInput):
                found = self.value(True)
            else:
                found = self.done()
        raise AssertionError(f"not at its end after {limit} actions")


def text_of(action: Action) -> str:
    match action:
        case RequestMotion(_, block):
            moves = " ".join(_move_text(each) for each in block.moves)
            return f"approach {moves}" if block.approach else f"move {moves}"
        case PauseMotion():
            return "pause motion"
        case ResumeMotion():
            return "resume motion"
        case StopMotion():
            return "stop motion"
        case WriteOutput(_, signal, value):
            return f"output {signal} {'on' if value else 'off'}"
        case QueryInput(_, signal):
            return f"ask {signal}"
        case AttachToTool(_, name):
            return f"attach {name}"
        case DetachFromTool(_, name):
            return f"detach {name}"
        case Finished():
            return "finished"
        case Failed(refusal):
            return f"failed {refusal.code.name}"
        case EventRefused(refusal):
            return f"refused {refusal.code.name}"
    raise AssertionError(action)


def _move_text(each: BlockMove) -> str:
    way = "" if each.move.way is Way.PTP else f":{each.move.way}"
    via = "".join(f"<{point.name}" for point in each.via)
    zone = "~" if each.move.zone else ""
    return f"{each.target.name}{way}{via}{zone}"


def _is_report(action: Action) -> bool:
    return isinstance(action, RunReport)
