"""Performer of the terminal pendant: turns commands of the core into calls of the client library.

Owns the order of the calls: one jog request at a time is pending and another meanwhile is dropped,
never queued; a stop is sent at once, beside all others. The result of each command becomes one
message to the user. The open program is reloaded when it may have changed. Decides nothing.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Coroutine, Iterable, Mapping
from typing import Any

from openpendant.simplemsg.pendant import Motion, RunKind
from openpendant.simplemsg.pendant.management.plans import PositionGoal
from openpendant.simplemsg.verdicts import VerdictCode

from ..client import (
    EnablingDevice,
    Hold,
    NotUnderstood,
    PendantClient,
    PendantError,
    Pose,
    Refused,
)
from ..motions import MotionHandle
from . import commands as do
from .cell_view import CellView
from .commands import JOINTS, CellList, Command
from .panel import Panel
from .taught_program import DryRunFindings, ProgramEdit, TaughtProgram
from .wording import plan_line, refusal_line, why_request

_MOST_PARTS = 1_000
"""A list or a text that comes in more parts than that is taken for endless."""


class OpenPrograms:
    """The stored programs and the open program on one connection."""

    def __init__(self, client: PendantClient, panel: Panel) -> None:
        self._client = client
        self._panel = panel

    async def names(self) -> list[str]:
        """Return the names of all programs."""
        names: list[str] = []
        first = 0
        for _ in range(_MOST_PARTS):
            answer = await self._client.programs.list(first=first)
            names += [str(each["name"]) for each in answer["programs"]]
            if answer["next"] is None:
                return names
            first = answer["next"]
        raise NotUnderstood("the server's list of programs does not end")

    async def create(self, name: str) -> None:
        """Create an empty program and show it."""
        await self._client.programs.create(name)
        self._panel.messages.add(f"{name} is new and empty")
        self._panel.opened(await self._load(name))

    async def open(self, name: str) -> None:
        """Show a program, or ask to create it if none has that name."""
        try:
            self._panel.opened(await self._load(name))
        except Refused as refused:
            if refused.code not in (VerdictCode.NOT_FOUND, VerdictCode.PROGRAM_UNKNOWN):
                raise
            self._panel.not_there(name)

    async def load_anew(self, name: str) -> None:
        """Reload the open program, which another client has changed, and say what is shown now."""
        shown = self._panel.teaching.program
        if shown is None or shown.name != name:
            return
        try:
            program = await self._load(name)
        except Refused as refused:
            if refused.code == VerdictCode.NOT_FOUND:
                self._panel.teaching.closed()
            raise
        if program.revision != shown.revision:
            self._panel.messages.add(
                f"{name} was changed: revision {program.revision} is shown now,"
                f" in the place of {shown.revision}; no dry run was made of it"
            )
        self._panel.opened(program)

    async def edit(self, edit: ProgramEdit) -> None:
        """Edit the open program."""
        program = self._panel.teaching.program
        if program is None:
            return
        try:
            await self._client.manage(program.request(edit))
        finally:
            # After a refusal too: somebody else may have saved another revision.
            self._panel.opened(await self._load(program.name))

    async def walk(self, name: str) -> None:
        """Request a dry run, which can take seconds; other commands run meanwhile."""
        found: DryRunFindings | None = None
        try:
            answer = await self._client.manage({"op": "programs.dry_run", "name": name})
            program = await self._load(name)
            if program.revision == int(answer["revision"]):
                found = DryRunFindings.read(name, program.revision, answer)
            else:
                self._panel.messages.add(f"{name} was changed meanwhile: . makes a dry run anew")
            if (open_now := self._panel.teaching.program) is not None and open_now.name == name:
                self._panel.opened(program)
        finally:
            self._panel.teaching.walked(found)

    async def _load(self, name: str) -> TaughtProgram:
        text, revision = await self._body(name, "text", None)
        document, _ = await self._body(name, "json", revision)
        return TaughtProgram.read(revision, text, json.loads(document))

    async def _body(self, name: str, form: str, revision: int | None) -> tuple[str, int]:
        """Load one form of a program; a long one arrives in parts."""
        parts: list[str] = []
        offset: int | None = 0
        for _ in range(_MOST_PARTS):
            request = {"op": "programs.load", "name": name, "format": form, "offset": offset}
            answer = await self._client.manage(request | {"revision": revision})
            parts.append(answer["body"])
            revision, offset = int(answer["revision"]), answer["next"]
            if offset is None:
                return "".join(parts), revision
        raise NotUnderstood(f"the server's text of program {name} does not end")


MOVE_SPEED = 0.1
"""Fraction of the joints' largest speed of a move to a typed target, and of a plan; the override
comes on top."""

_AXES = ("x", "y", "z", "a", "b", "c")


class Performer:
    """The commands of one pendant that run on one connection."""

    def __init__(self, client: PendantClient, panel: Panel) -> None:
        self._client = client
        self._panel = panel
        self._programs = OpenPrograms(client, panel)
        self._tasks: set[asyncio.Task[None]] = set()
        self._jog: asyncio.Task[None] | None = None
        self._enabling: EnablingDevice | None = None
        self._enabling_turn = asyncio.Lock()

    def perform(self, commands: Iterable[Command]) -> None:
        """Start to carry out commands; returns at once."""
        for command in commands:
            if isinstance(command, do.PulseJog | do.StepJog):
                if self._jog is None or self._jog.done():
                    self._jog = self._begin(self._jogged(command))
            else:
                self._begin(self._carry_out(command))

    def _begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(self._told(work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _told(self, work: Coroutine[Any, Any, None]) -> None:
        try:
            await work
        except Refused as refused:
            line = refusal_line(refused, self._cell.joints, self._panel.remedies)
            why = self._panel.enabling.why_off
            is_lost = refused.code == VerdictCode.ENABLING_LOST and why
            self._panel.messages.add(f"enabling let go ({why}): {line}" if is_lost else line)
            if refused.code in (VerdictCode.NOT_ENABLED, VerdictCode.ENABLING_LOST):
                self.perform(self._panel.not_enabled())
            self.perform(self._panel.refused(refused))
        except PendantError as error:
            self._panel.messages.add(str(error))
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            self._panel.messages.add(f"the server's answer cannot be read: {error!r}")

    async def close(self) -> None:
        """Cancel the commands that run; the caller closes the connection."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._enable(False)

    async def _jogged(self, command: do.PulseJog | do.StepJog) -> None:
        if isinstance(command, do.PulseJog):
            await self._pulse(command)
            return
        if command.frame == JOINTS:
            motion = await self._client.step(dict(command.increments))
        else:
            increments = {_AXES[axis]: value for axis, value in command.increments}
            motion = await self._client.step_tool(**increments, frame=command.frame)
        # Over once it has begun: the next one is refused by the server while this one moves.
        self._begin(self._ended(motion, ""))

    async def _pulse(self, pulse: do.PulseJog) -> None:
        """Press and never beat: the server ends the press at its deadline."""
        if not self._client.has_quotable_state:
            # The library would wait for a state, and move for a key that was let go long ago.
            self._panel.messages.add("STALE: no jog on values that are too old for a held key")
            return
        signs = {axis: float(sign) for axis, sign in pulse.axes}
        if pulse.frame == JOINTS:
            jog = self._client.jog(signs, deadline=pulse.deadline, longest=0.0)
        else:
            jog = self._client.jog_tool(
                **{_AXES[axis]: sign for axis, sign in signs.items()},
                frame=pulse.frame,
                deadline=pulse.deadline,
                longest=0.0,
            )
        await jog.__aenter__()

    async def _carry_out(self, command: Command) -> None:
        client = self._client
        match command:
            case do.StopRobot():
                await self._stop(command)
            case do.UnlatchStop():
                await client.reset_stop()
            case do.Enable(held=held):
                await self._enable(held)
            case do.TakeControl(force=force):
                await client.take_control(force=force)
            case do.GiveControl():
                await client.release_control()
            case do.ChangeMode(mode=mode):
                await client.set_mode(mode)
            case do.ChangeSpeed(override=override, tool_speed=cap):
                await client.set_speed(override, tool_speed=cap)
            case do.PauseRobot():
                await client.pause()
            case do.ResumeRobot():
                await client.resume()
            case do.StopProgram():
                await client.program_stop()
            case do.AskList(kind=kind):
                self._panel.told_list(kind, await self._list(kind))
            case _ if isinstance(command, do.ChangesList):
                await self._change(command)
            case do.PlanWay(name=name):
                await self._plan(name)
            case do.AskPairingCode():
                code = await client.issue_pairing_code()
                self._panel.messages.add(
                    f"pairing code {code}: {self._panel.attach_command} --pairing"
                )
            case do.EndPairing():
                await client.end_pairing()
                self._panel.messages.add(
                    "the pairing code is ended, and so is what its guests may do"
                )
            case do.AskWhy():
                request = why_request(self._cell.mode)
                answer = await client.manage(dict(request))
                self._panel.why_told(answer, await self._holds())
            case do.AskPrograms():
                self._panel.listed(await self._programs.names())
            case do.MakeProgram(name=name):
                await self._programs.create(name)
            case do.OpenProgram(name=name):
                await self._programs.open(name)
            case do.ReloadProgram(name=name):
                await self._programs.load_anew(name)
            case do.ApplyEdit(edit=edit):
                await self._programs.edit(edit)
            case do.AskDryRun(name=name):
                await self._programs.walk(name)
            case _:
                motion, name = await self._motion(command)
                self._panel.messages.add(f"{name} began")
                await self._ended(motion, name)

    async def _list(self, kind: CellList) -> Mapping[str, Any]:
        client = self._client
        match kind:
            case CellList.RECORDINGS:
                return await client.recordings.list()
            case CellList.SCENE:
                return await client.scene.show()
            case CellList.SIGNALS:
                return await client.signals.read()
            case CellList.POSITIONS:
                return await client.positions.list()
            case CellList.PLANS:
                return await client.plans.show()
        return await client.frames.show()

    async def _change(self, command: do.ChangesList) -> None:
        """Change what one of the cell's lists has, and say so."""
        client = self._client
        match command:
            case do.RecordMotion(name=name):
                await client.recordings.start(name)
                said = f"recording {name} began"
            case do.EndRecording():
                made = await client.recordings.stop()
                said = f"recording ended: {made['samples']} samples, {made['duration']:.1f} s"
            case do.ChooseTool(name=tool, revision=revision):
                await client.tools.select(tool, expected_revision=revision)
                said = f"tool {tool} is selected" if tool else "no tool is selected"
            case do.SwitchOutput(number=number, value=value):
                await client.signals.set(number, value)
                said = f"output {number} is {'on' if value else 'off'}"
            case do.TeachPosition(name=name, revision=revision):
                kept = await client.positions.save(name, expected_revision=revision)
                warning = f": {kept['warning']}" if kept["warning"] else ""
                said = f"position {name} is where the robot stands{warning}"
            case do.ForgetPosition(name=name, revision=revision):
                await client.positions.delete(name, expected_revision=revision)
                said = f"position {name} is deleted"
            case do.ForgetPlan(plan=number):
                await client.plans.drop(number)
                said = f"plan {number} is dropped"
        self._panel.messages.add(said)

    async def _plan(self, name: str) -> None:
        """Have the way to a named position planned; show what was found, and the plans."""
        goal: PositionGoal = {"kind": "position", "name": name}
        label = f"to {name}"
        made = await self._client.plans.make(goal, speed=MOVE_SPEED, label=label)
        self._panel.messages.add(plan_line(label, made))
        self._panel.told_list(CellList.PLANS, await self._client.plans.show())

    async def _stop(self, stop: do.StopRobot) -> None:
        try:
            await self._client.stop(stop.reason)
        except Refused as refused:
            self._panel.stop_key.refused(
                stop.press, refusal_line(refused, (), self._panel.remedies)
            )
            raise
        self._panel.stop_key.confirmed(stop.press)

    async def _holds(self) -> list[Hold]:
        """Return what the robot is held by; empty where the server cannot say now."""
        try:
            return await self._client.retreat()
        except Refused:
            return []

    @property
    def _cell(self) -> CellView:
        return self._panel.cell

    async def _enable(self, held: bool) -> None:
        async with self._enabling_turn:
            if self._enabling is not None:
                await self._enabling.__aexit__(None, None, None)
                self._enabling = None
            if held:
                self._enabling = self._client.enabling()
                await self._enabling.__aenter__()

    async def _motion(self, command: Command) -> tuple[MotionHandle, str]:
        """Start a motion; return it with its name."""
        client = self._client
        match command:
            case do.UndoJog():
                return await client.undo_jog(), "undo of the jog"
            case do.GoHome(target=target):
                return await client.home(target), f"way to {target}"
            case do.MoveJoints(goal=goal, name=name):
                return await client.move_joints(goal, speed=MOVE_SPEED), name
            case do.MoveToPose(name=name):
                pose = Pose(command.position, command.orientation)
                move = client.move_to_pose(pose, motion=Motion.LIN, speed=MOVE_SPEED)
                return await move, name
            case do.RunProgram():
                return await self._run(command)
            case do.ExecutePlan(plan=number):
                return await client.execute(number), f"plan {number}"
            case do.PlayBack(name=name):
                return await client.recordings.play(name), f"recording {name}"
        raise AssertionError(f"{command} is no motion")

    async def _run(self, asked: do.RunProgram) -> tuple[MotionHandle, str]:
        try:
            motion = await self._client.run_program(
                asked.name,
                run=asked.run,
                line=asked.line,
                loops=asked.loops,
                revision=asked.revision,
            )
        except Refused as refused:
            if refused.code == VerdictCode.REVISION_CONFLICT:
                self._begin(self._programs.load_anew(asked.name))
            raise
        # The end of a step is not that of its program, which reports its own.
        whole = asked.run == RunKind.ALL
        return motion, f"program {asked.name}" if whole else f"one step of {asked.name}"

    async def _ended(self, motion: MotionHandle, name: str) -> None:
        """Wait for the end of a motion; the caller reports a failure."""
        await motion.done()
        if name:
            self._panel.messages.add(f"{name} ended")
