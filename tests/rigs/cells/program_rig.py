"""A run of a program against an imagined robot: events go in, actions come out as short texts."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from rigs.data.program_samples import linked

from openpendant.server.programs.interpreter import run_events as run
from openpendant.server.programs.interpreter.motion_blocks import BlockMove, MotionBlock
from openpendant.server.programs.interpreter.runner import Runner
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.statements import Way
from openpendant.simplemsg.verdicts import VerdictCode

_ASKED: dict[str, run.Event] = {
    "pause": run.Pause(),
    "resume": run.Resume(),
    "stop": run.Stop(),
    "forward": run.StepForward(),
    "back": run.StepBack(),
}


@dataclass(frozen=True)
class Scenario:
    """What happens in a run, one after the other, and what comes out of it.

    Attributes:
        events: `EVENT -> ACTION, ACTION; EVENT; …`, where nothing comes out of the second one. The
            events are `start`, `step`, `start at 2`, `start for ever`, `done`, `on`, `off`,
            `0.5 s`, `ticks`, `pause`, `resume`, `stop`, `forward`, `back`, `passed 1`, `answer 7`
            of a request, `abort CODE`, `break main:2`, and `where`, which tells state and places.
    """

    statements: str
    events: str
    others: Mapping[str, str] = field(default_factory=dict)

    def as_it_happens(self) -> str:
        rig = ProgramRig(self.statements, self.others)
        return "; ".join(rig.told(each.partition(" -> ")[0]) for each in self.events.split("; "))


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
        self.actions: list[run.Action] = []
        self.request = 0

    def do(self, event: run.Event) -> list[str]:
        done = self.runner.handle(event, self.now)
        found = [each for each in done if not isinstance(each, run.RunReport)]
        self.actions += found
        for action in found:
            self.request = getattr(action, "request", self.request)
        return [text_of(action) for action in found]

    def start(self, index: int = 0, passes: int | None = 1, *, step: bool = False) -> list[str]:
        return self.do(run.Start(index, passes, step))

    def done(self) -> list[str]:
        return self.do(run.RequestDone(self.request))

    def value(self, value: bool) -> list[str]:
        return self.do(run.InputValue(self.request, value))

    def abort(self, refusal: Refusal) -> list[str]:
        return self.do(run.RequestAborted(self.request, refusal))

    def after(self, seconds: float) -> list[str]:
        """Let time go on, with one tick at its end."""
        self.now += round(seconds * 1e9)
        return self.do(run.TimePassed())

    def ticks(self, most: int = 100) -> list[str]:
        """Let ticks of 10 ms go by until something comes out; return that."""
        for _ in range(most):
            if found := self.after(0.01):
                return found
        raise AssertionError(f"nothing came out in {most} ticks")

    def break_at(self, *places: tuple[str, int]) -> None:
        self.do(run.ReplaceBreakpoints(frozenset(places)))

    @property
    def block(self) -> MotionBlock:
        return next(a.block for a in reversed(self.actions) if isinstance(a, run.RequestMotion))

    @property
    def here(self) -> list[tuple[str, int]]:
        """The call stack: program and number of the statement."""
        return [(place.program, place.index) for place in self.runner.status.stack]

    def told(self, event: str) -> str:
        """Have an event of a scenario happen; return it with what came out of it."""
        found = self._happen(*event.split())
        return f"{event} -> {', '.join(found)}" if found else event

    def _happen(self, what: str, *more: str) -> list[str]:
        match what, more:
            case (("start" | "step"), (*_, index)) if "at" in more:
                return self.start(int(index), step=what == "step")
            case (("start" | "step"), _):
                return self.start(passes=None if more else 1, step=what == "step")
            case (("on" | "off"), ()):
                return self.value(what == "on")
            case "passed", (place,):
                return self.do(run.Passed(self.request, int(place)))
            case "answer", (request,):
                return self.do(run.RequestDone(int(request)))
            case "abort", (code,):
                return self.abort(Refusal(VerdictCode[code]))
            case "break", places:
                pairs = (place.split(":") for place in places)
                self.break_at(*((program, int(index)) for program, index in pairs))
                return []
            case seconds, ("s",):
                return self.after(float(seconds))
            case "done", ():
                return self.done()
            case "ticks", ():
                return self.ticks()
            case "where", ():
                return [self._place()]
        return self.do(_ASKED[what])

    def _place(self) -> str:
        status = self.runner.status
        words = [status.state.name.lower()]
        if status.state is run.RunState.PAUSED:
            words.append(status.pause.name.lower())
        words += [f"{program}:{index}" for program, index in self.here]
        return " ".join([*words, *["stepping"] * self.runner.is_stepping])

    def run_out(self, limit: int = 10_000) -> list[str]:
        """Answer everything with success, inputs with on, until the run ends; return the log."""
        log: list[str] = []
        found = self.start()
        for _ in range(limit):
            log += found
            if not found or found[-1] == "finished" or found[-1].startswith("failed"):
                return log
            if isinstance(self.actions[-1], run.QueryInput):
                found = self.value(True)
            else:
                found = self.done()
        raise AssertionError(f"not at its end after {limit} actions")


def text_of(action: run.Action) -> str:
    match action:
        case run.RequestMotion(_, block):
            moves = " ".join(_move_text(each) for each in block.moves)
            return f"approach {moves}" if block.approach else f"move {moves}"
        case run.PauseMotion():
            return "pause motion"
        case run.ResumeMotion():
            return "resume motion"
        case run.StopMotion():
            return "stop motion"
        case run.WriteOutput(_, signal, value):
            return f"output {signal} {'on' if value else 'off'}"
        case run.QueryInput(_, signal):
            return f"ask {signal}"
        case run.AttachToTool(_, name):
            return f"attach {name}"
        case run.DetachFromTool(_, name):
            return f"detach {name}"
        case run.Finished():
            return "finished"
        case run.Failed(refusal):
            return f"failed {refusal.code.name}"
        case run.EventRefused(refusal):
            return f"refused {refusal.code.name}"
    raise AssertionError(action)


def _move_text(each: BlockMove) -> str:
    way = "" if each.move.way is Way.PTP else f":{each.move.way}"
    via = "".join(f"<{point.name}" for point in each.via)
    zone = "~" if each.move.zone else ""
    return f"{each.target.name}{way}{via}{zone}"
