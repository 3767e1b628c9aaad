"""`openpendant why` names each condition as it is broken, on a server and an emulator that run."""

import asyncio
import os
import signal
from typing import Any

import pytest
from rigs.clock.busy_machine import SCALE

from openpendant.simplemsg.pendant import Activity, OperatingMode, OperatorAction, OperatorEvent
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools import why

pytestmark = pytest.mark.realtime

READY, NOT_READY = 0, 1


class ReplyTo:
    def __init__(self, port: int, capsys: pytest.CaptureFixture[str]) -> None:
        self._address = f"127.0.0.1:{port}"
        self._capsys = capsys

    async def asked(self, kind: str = "move") -> tuple[int, str]:
        code = await asyncio.to_thread(why.main, [self._address, "--kind", kind])
        return code, self._capsys.readouterr().out

    async def expect(self, condition: str, code: V, kind: str = "move") -> None:
        """Ask until that condition is the first broken one; cause and remedy stand below."""
        for _ in range(20):
            exit_code, said = await self.asked(kind)
            if f"> NO  {condition} " in said:
                assert exit_code == NOT_READY
                assert f"cause:  {CATALOGUE[code].cause} ({code.name}, {int(code)})" in said
                assert f"remedy: {CATALOGUE[code].remedy}" in said
                return
            await asyncio.sleep(0.1 * SCALE)
        raise AssertionError(said)


async def test_each_condition_is_named_as_it_is_broken(
    start_cell: Any, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    cell = await start_cell(server=("--store", str(tmp_path / "store.db")))
    pendant = await cell.ready_pendant()
    reply_to = ReplyTo(cell.ports["pendant"], capsys)
    await reply_to.expect("authority", V.NOT_IN_CONTROL)

    await pendant.take_control()
    exit_code, said = await reply_to.asked()
    assert (exit_code, "is ready for a move" in said) == (READY, True)
    await reply_to.expect("mode", V.MODE_FORBIDS, kind="jog")

    await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
    await reply_to.expect("enabling", V.NOT_ENABLED, kind="jog")
    await pendant.set_mode(OperatingMode.AUTOMATIC)

    await pendant.stop("tea")
    await reply_to.expect("stop", V.STOP_LATCHED)
    await pendant.reset_stop()

    goal = [pendant.joints()[0] + 1.0, *pendant.joints()[1:]]
    await pendant.move_joints(goal, speed=0.05)
    await reply_to.expect("standing", V.MOVING)
    await pendant.program_stop()
    await pendant.wait_until(lambda state: state.activity == Activity.IDLE)

    revision = (await pendant.manage({"op": "programs.create", "name": "waits"}))["revision"]
    edit = {"edit": "insert", "statements": [{"statement": "wait", "duration": 60.0}]}
    await pendant.manage(
        {"op": "programs.edit", "name": "waits", "expected_revision": revision, "edit": edit}
    )
    await pendant.run_program("waits")
    await reply_to.expect("program", V.PROGRAM_RUNNING)
    await pendant.program_stop()

    place = {"type": "sphere", "radius": 0.05}
    ball = {"name": "ball", "shape": place, "position": pendant.tool_pose().position}
    await pendant.manage({"op": "scene.add", "object": ball, "expected_revision": 0})
    await reply_to.expect("scene", V.START_IN_COLLISION)
    await pendant.manage({"op": "scene.remove", "name": "ball", "expected_revision": 1})

    await cell.tell_controller(OperatorEvent(action=OperatorAction.EMERGENCY_STOP))
    await reply_to.expect("controller", V.CONTROLLER_NOT_READY)
    await cell.tell_controller(OperatorEvent(action=OperatorAction.RESET))


async def test_a_silent_controller_and_a_dead_one_are_named(
    start_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = await start_cell(server=("--store", "off"))
    pendant = await cell.ready_pendant()
    await pendant.take_control()
    reply_to = ReplyTo(cell.ports["pendant"], capsys)

    os.kill(cell.emulator.pid, signal.SIGSTOP)
    try:
        await reply_to.expect("feedback", V.FEEDBACK_STALE)
    finally:
        os.kill(cell.emulator.pid, signal.SIGCONT)
    os.kill(cell.emulator.pid, signal.SIGKILL)
    await reply_to.expect("link", V.CONTROLLER_DOWN)
