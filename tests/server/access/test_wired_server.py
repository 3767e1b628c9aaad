import asyncio
import errno
import os
import statistics
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import pytest
from rigs.cells.expectations import expect, known
from rigs.clock.busy_machine import PATIENCE
from rigs.peers.server_clients import hello
from rigs.processes.guarded_server import guarded_server, served_operator

from openpendant.server.access import open_access
from openpendant.server.access.audit_file import AuditLog
from openpendant.server.access.passwords import DEFAULT_COST
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Connection,
    Message,
    Role,
    codec_for,
    joint_array,
)
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import PendantClient, Refused

pytestmark = pytest.mark.realtime

WRONG = "canary-that-is-wrong-5511"


async def test_promise_29_a_lock_is_told_at_once_and_a_stop_goes_through(tmp_path: Path) -> None:
    async with (
        guarded_server(tmp_path) as server,
        await PendantClient.connect(port=server.port) as pendant,
    ):
        codes, took = [], list[float]()
        for _ in range(10):
            began = time.monotonic()
            with pytest.raises(Refused) as refused:
                await pendant.login("otto", password=WRONG)
            codes.append(refused.value.code)
            if refused.value.code == V.LOCKED_OUT:
                took.append(time.monotonic() - began)
        assert codes == [V.LOGIN_FAILED] * 5 + [V.LOCKED_OUT] * 5
        # A busy machine delays one of them or another, a hash that is computed each of them.
        assert statistics.median(took) < 0.1, took
        await pendant.stop("locked out, and stopping")
        assert server.app.cells[0].core.cell.stop is not None


async def guess(source: str, port: int, name: str) -> float:
    """Try a wrong password from an address; return how long the answer took [s]."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(source, 0))
    answers = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=65_532)
    writer.write(answers.send(hello("")))
    answers.receive(await reader.read(65_536))
    writer.write(answers.send(messages.Login(1, messages.LoginKind.PASSWORD, name, WRONG)))
    began = time.perf_counter()
    (answer,) = answers.receive(await reader.read(65_536))
    taken = time.perf_counter() - began
    assert expect(messages.Verdict, answer).code == V.LOGIN_FAILED
    writer.close()
    return taken


@pytest.mark.soak
async def test_promise_29_an_unknown_user_is_answered_after_as_long_as_a_known_one(
    tmp_path: Path,
) -> None:
    """Over sockets, from ten addresses so that nobody is locked out; medians within 10 %."""
    taken: dict[str, list[float]] = {"otto": [], "nobody": []}
    async with guarded_server(tmp_path, cost=DEFAULT_COST) as server:
        for source in range(2, 12):
            for _ in range(4):
                for name, times in taken.items():
                    times.append(await guess(f"127.0.0.{source}", server.port, name))
    known, unknown = (statistics.median(times) for times in taken.values())
    assert known >= 0.05
    assert 0.9 <= unknown / known <= 1.1, f"{known:.3f} s and {unknown:.3f} s"


CODEC = codec_for(PENDANT, ByteOrder.LITTLE, 4)


def as_recorded(goal: tuple[float, ...]) -> list[Message]:
    joints = joint_array(goal)
    return [
        messages.Authority(2, messages.AuthorityAction.REQUEST),
        messages.AuthorityBeat(),
        messages.JointMove(3, 0.5, len(goal), joints),
        messages.JogStart(
            4, 1, 1, 0.15, messages.JogSpace.JOINTS, "", len(goal), joint_array([1.0] + [0.0] * 5)
        ),
        messages.JogBeat(1, 1),
        messages.JogBeat(1, 2),
        messages.SetSpeed(5, 1.0, 0.0),
        messages.ResetStop(6),
    ]


async def test_promise_28_recorded_frames_do_nothing_on_another_connection(tmp_path: Path) -> None:
    async with served_operator(tmp_path) as (server, otto):
        await otto.wait_until(lambda state: state.motion_possible == 1)
        async with otto.control():
            before = otto.joints()
            frames = as_recorded(tuple(angle + 0.2 for angle in before))
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            answers = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=65_532)
            for frame in (hello("a thief"), *frames):
                writer.write(CODEC.encode(frame))
                answers.send(frame)
            codes: list[int] = []

            async def read_codes() -> None:
                data = await reader.read(65_536)
                assert data, f"the server closed the connection; answered so far: {codes}"
                came = answers.receive(data)
                codes.extend(answer.code for answer in came if isinstance(answer, messages.Verdict))

            async with asyncio.timeout(PATIENCE):
                while len(codes) < 5:
                    await read_codes()
            with suppress(TimeoutError):  # nothing else comes
                await asyncio.wait_for(read_codes(), 0.3)
            assert codes == [V.LOGIN_NEEDED] * 5
            assert known(server.app.cells[0].core.cell.authority.holder).client == "otto"
            assert (await otto.next_state()).positions[:6] == pytest.approx(before)
            writer.close()


def full_disk(path: Path) -> Mock:
    path.touch()
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    synced = AssertionError("nothing was written, so there is nothing to sync")
    return Mock(write=Mock(side_effect=full), fileno=Mock(side_effect=synced))


async def test_a_full_disk_of_the_audit_log_moves_no_robot_and_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    log = partial(AuditLog, retry=0.02, opener=full_disk)
    monkeypatch.setattr(open_access, "AuditLog", log)
    async with served_operator(tmp_path) as (_, otto):
        await otto.wait_until(lambda state: state.motion_possible == 1)
        async with otto.control():
            goal = [angle + 0.05 for angle in otto.joints()]
            await (await otto.move_joints(goal, speed=0.5)).done()
            await otto.next_state()
            assert otto.joints() == pytest.approx(goal, abs=1e-3)
        await asyncio.sleep(0.2)
    said = [record for record in caplog.records if "audit log is not written" in record.message]
    assert [record.levelname for record in said] == ["ERROR"]
    assert "No space left on device" in said[0].message
