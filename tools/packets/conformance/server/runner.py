"""Runner of the checks on a server, one after the other; each ends in a finding.

Owns which checks apply, what an exception means, the deadline of a check, that a target which died
is told from one that is gone, and how a run ends early. Knows no bytes.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence

from ..check import (
    PASSED,
    CannotJudge,
    CheckFinding,
    CheckVerdict,
    Judgement,
    Profile,
    Result,
    RuleBroken,
    Section,
    failed,
    not_applicable,
)
from .checks import ServerCheck, server_checks
from .link import LongLivedLinks
from .monitor import INTERRUPTED, MotionInterrupted
from .moving import Restored, restore
from .target import Options, Target
from .wire import TargetUnreachable

REVIVALS = 3
"""So often a target that takes no connections is tried again before it is given up."""

_REVIVAL_PAUSE = 0.7
_RESTORE_WITHIN = 60.0
_HALT_WITHIN = 5.0
_MOST_BREACHES = 3
_LOG_LINES = 6
_NOT_ALLOWED = "it would move the robot; not run without --yes-it-may-move"
_UNREACHABLE = "target unreachable"
_FIXED_LAYOUT = (
    "a lone PING is not answered; a controller that reads every frame as a point might move"
)

Progress = Callable[[Result], None]


def applicable(options: Options, only: Sequence[str] = ()) -> tuple[ServerCheck, ...]:
    """Return the checks of a profile, in the order in which they are run."""
    wanted = {word.upper() for word in only}
    return tuple(
        entry
        for entry in server_checks()
        if _applies(entry, options) and (not wanted or wanted & {entry.number, entry.section.name})
    )


def _applies(entry: ServerCheck, options: Options) -> bool:
    match entry.section:
        case Section.PENDANT:
            with_port = options.pendant_port is not None
            return with_port and options.profile in (Profile.GENERIC, Profile.PENDANT)
        case Section.MOTOMAN:
            return options.dialect == "motoman" and options.profile is not Profile.PENDANT
    return options.profile in entry.profiles


async def judge(
    options: Options,
    *,
    only: Sequence[str] = (),
    checks: Iterable[ServerCheck] | None = None,
    progress: Progress | None = None,
    on_start: Callable[[Callable[[], None]], None] | None = None,
) -> Judgement:
    """Judge a server; raise TargetUnreachable where nobody is there at the first look.

    Whatever ends it early, a robot that may move is sent STOP first, and the checks that are left
    are not applicable; `on_start` is given what ends it.
    """
    target = Target(options)
    if on_start is not None:
        on_start(target.guard.interrupt)
    chosen = applicable(options, only) if checks is None else tuple(checks)
    run = _Run(target, chosen)
    results = []
    try:
        await run.begin()
        for entry in chosen:
            result = await run.one(entry)
            results.append(result)
            if progress is not None:
                progress(result)
    finally:
        await run.end()
    ports = [options.motion_port, options.state_port, options.pendant_port]
    subject = ":".join(str(part) for part in (options.host, *ports) if part is not None)
    return Judgement(f"server {subject}", "server", tuple(results))


class _Run:
    """One run: the target, and what is left of its credit."""

    def __init__(self, target: Target, chosen: Sequence[ServerCheck]) -> None:
        self._target = target
        self._links = LongLivedLinks(chosen)
        self._revivals = REVIVALS
        self._is_alive = True

    async def begin(self) -> None:
        """Survey the target; TargetUnreachable where nobody is there."""
        target = self._target
        try:
            await target.guard.over(target.survey())
        except MotionInterrupted:
            await target.close()

    async def end(self) -> None:
        """Leave nothing open, and no robot in motion."""
        if self._target.may_have_moved:
            await self._halt()
        await self._links.end()
        await self._target.close()

    async def one(self, entry: ServerCheck) -> Result:
        """Run one check and put in order what it leaves behind."""
        began = asyncio.get_running_loop().time()
        finding = await self._finding(entry)
        seconds = asyncio.get_running_loop().time() - began
        return Result(entry, finding, seconds)

    async def _finding(self, entry: ServerCheck) -> CheckFinding:
        reason = self._why_not(entry)
        if reason:
            return not_applicable(reason)
        if not self._is_alive and not await self._is_reachable():
            return not_applicable(_UNREACHABLE)
        finding = await _outcome(entry, self._target, self._links)
        log = await self._target.close()
        if finding.verdict is CheckVerdict.FAILED and log:
            last = "; ".join(log[-_LOG_LINES:])
            finding = CheckFinding(finding.verdict, f"{finding.detail} [{last}]", finding.habit)
        if self._target.guard.is_interrupted:
            await self._halt()
            return finding
        if self._target.may_have_moved:
            finding = await self._put_back(finding)
        self._is_alive = await self._target.is_alive() or await self._is_reachable()
        if not self._is_alive:
            detail = f"{finding.detail}; " if finding.detail else ""
            return failed(f"{detail}after this check the target takes no connection any more")
        return finding

    def _why_not(self, entry: ServerCheck) -> str:
        """Return why a check is not run; empty where it is."""
        target = self._target
        if target.guard.is_interrupted:
            return INTERRUPTED
        if entry.moves and not target.options.may_move:
            return _NOT_ALLOWED
        is_safe = entry.is_plain or entry.section is Section.PENDANT
        return "" if is_safe or target.knows_ping else _FIXED_LAYOUT

    async def _put_back(self, finding: CheckFinding) -> CheckFinding:
        """Bring the robot back to its start; a check that left it far from there has failed."""
        target = self._target
        try:
            async with asyncio.timeout(_RESTORE_WITHIN):
                restored = await target.guard.over(restore(target))
        except (TimeoutError, TargetUnreachable, MotionInterrupted) as error:
            reason = str(error) or f"it did not come back within {_RESTORE_WITHIN:g} s"
            restored = Restored(reason, target.reach)
        target.blocked = restored.reason
        if target.guard.is_interrupted:
            await self._halt()
        if target.guard.breaches >= _MOST_BREACHES and not target.blocked:
            target.blocked = f"it went too far {target.guard.breaches} times"
        if restored.away > target.reach:
            detail = f"{finding.detail}; " if finding.detail else ""
            return failed(f"{detail}it left the robot {restored.away:.4g} rad or m from its start")
        return finding

    async def _halt(self) -> None:
        """Send STOP on a new connection and wait for the robot to stand, where it can be seen."""
        target = self._target
        if target.home is None or not target.may_have_moved:
            return
        try:
            async with asyncio.timeout(_HALT_WITHIN):
                await target.motion()
                target.send_stop()
                watch = await target.state()
                if await watch.standstill(_HALT_WITHIN):
                    target.may_have_moved = False
        except (TimeoutError, TargetUnreachable):
            return  # nothing more can be done from here
        finally:
            await target.close()

    async def _is_reachable(self) -> bool:
        """Return True if the target takes connections, within the attempts left for the run."""
        while not await self._target.is_alive():
            if not self._revivals:
                return False
            self._revivals -= 1
            await asyncio.sleep(_REVIVAL_PAUSE)
        return True


async def _outcome(entry: ServerCheck, target: Target, links: LongLivedLinks) -> CheckFinding:
    if target.options.may_move and target.home is not None:
        target.guard.put_up(target.home, target.reach)
    try:
        await target.guard.over(links.before(entry, target))
        async with asyncio.timeout(entry.deadline):
            return await target.guard.over(entry.judge(target)) or PASSED
    except MotionInterrupted as error:
        return not_applicable(INTERRUPTED) if target.guard.is_interrupted else failed(str(error))
    except RuleBroken as error:
        return failed(str(error))
    except CannotJudge as error:
        return not_applicable(str(error))
    except TargetUnreachable as error:
        return failed(str(error))
    except TimeoutError:
        return failed(f"the check was not done after {entry.deadline:g} s")
    except Exception as error:
        # A fault of the tester's. One check must not end a run of an hour, nor count as passed.
        return failed(f"the tester itself failed: {type(error).__name__}: {error}")
