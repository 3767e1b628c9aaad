"""Runs checks on a server one after the other; whatever happens, each ends in a finding.

Owns which checks apply, what an exception means, the deadline of a check, and that a target which
died is told from one that is gone. Knows no bytes.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence

from ..findings import Finding, Judgement, Result, Section, Verdict, failed, not_applicable
from .checks import Profile, ServerCheck, server_checks
from .moving import restore
from .target import Options, Target
from .wire import CannotJudge, RuleBroken, Unreachable

REVIVALS = 3
"""So often a target that takes no connections is tried again before it is given up."""

_REVIVAL_PAUSE = 0.7
_RESTORE_WITHIN = 40.0
_LOG_LINES = 6
_NOT_ALLOWED = "it would move the robot; not run without --yes-it-may-move"
_UNREACHABLE = "target unreachable"

Progress = Callable[[Result], None]


def applicable(options: Options, only: Sequence[str] = ()) -> tuple[ServerCheck, ...]:
    """Return the checks of a profile, in the order in which they are run.

    Args:
        options: profile, dialect and ports.
        only: numbers or names of sections; empty for all.
    """
    wanted = {word.upper() for word in only}
    return tuple(
        entry
        for entry in server_checks()
        if _applies(entry, options)
        and (not wanted or wanted & {entry.info.number, entry.info.section.name})
    )


def _applies(entry: ServerCheck, options: Options) -> bool:
    match entry.info.section:
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
) -> Judgement:
    """Judge a server.

    Args:
        options: where it is and what may be done.
        only: numbers or names of sections; empty for all.
        checks: the checks to run; those of the profile by default.
        progress: told each result as it is found.

    Raises:
        Unreachable: nobody is there at the first look.
    """
    target = Target(options)
    await target.survey()
    chosen = applicable(options, only) if checks is None else tuple(checks)
    run = _Run(target)
    results = []
    for entry in chosen:
        result = await run.one(entry)
        results.append(result)
        if progress is not None:
            progress(result)
    ports = [options.motion_port, options.state_port, options.pendant_port]
    subject = ":".join(str(part) for part in (options.host, *ports) if part is not None)
    return Judgement(f"server {subject}", "server", tuple(results))


class _Run:
    """One run: the target, and what is left of its credit."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._revivals = REVIVALS
        self._is_alive = True

    async def one(self, entry: ServerCheck) -> Result:
        """Run one check and put in order what it leaves behind."""
        began = asyncio.get_running_loop().time()
        finding = await self._finding(entry)
        seconds = asyncio.get_running_loop().time() - began
        return Result(entry.info, finding, seconds)

    async def _finding(self, entry: ServerCheck) -> Finding:
        if entry.info.moves and not self._target.options.may_move:
            return not_applicable(_NOT_ALLOWED)
        if not self._is_alive and not await self._is_reachable():
            return not_applicable(_UNREACHABLE)
        finding = await _outcome(entry, self._target)
        log = await self._target.close()
        if finding.verdict is Verdict.FAILED and log:
            last = "; ".join(log[-_LOG_LINES:])
            finding = Finding(finding.verdict, f"{finding.detail} [{last}]", finding.habit)
        if self._target.may_have_moved:
            self._target.grounded = await _put_back(self._target)
        self._is_alive = await self._target.is_alive() or await self._is_reachable()
        if not self._is_alive:
            detail = f"{finding.detail}; " if finding.detail else ""
            return failed(f"{detail}after this check the target takes no connection any more")
        return finding

    async def _is_reachable(self) -> bool:
        """Tell whether the target takes connections, with a few more attempts in the whole run."""
        while not await self._target.is_alive():
            if not self._revivals:
                return False
            self._revivals -= 1
            await asyncio.sleep(_REVIVAL_PAUSE)
        return True


async def _outcome(entry: ServerCheck, target: Target) -> Finding:
    try:
        async with asyncio.timeout(entry.deadline):
            return await entry.body(target)
    except RuleBroken as error:
        return failed(str(error))
    except CannotJudge as error:
        return not_applicable(str(error))
    except Unreachable as error:
        return failed(str(error))
    except TimeoutError:
        return failed(f"the check was not done after {entry.deadline:g} s")
    except Exception as error:
        # A fault of the tester's. One check must not end a run of an hour, nor count as passed.
        return failed(f"the tester itself failed: {type(error).__name__}: {error}")


async def _put_back(target: Target) -> str:
    try:
        async with asyncio.timeout(_RESTORE_WITHIN):
            return await restore(target)
    except (TimeoutError, Unreachable) as error:
        return str(error) or f"it did not come back within {_RESTORE_WITHIN:g} s"
