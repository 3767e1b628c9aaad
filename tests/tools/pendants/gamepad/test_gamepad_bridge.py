"""A gamepad from a pipe to the server: what leaves, when, and that a device that goes lets go."""

import asyncio
import errno
import os
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.panel_rig import snapshot
from rigs.data.device_bytes import (
    DROPPED,
    ENABLING,
    LEFT_Y,
    REL,
    STOP,
    axis,
    button,
    opening,
    report,
)
from rigs.data.device_bytes import KEY as KEYS
from rigs.peers.plugged_device import PluggedDevice
from rigs.peers.scripted_pendant_server import (
    SESSION,
    ScriptedPendantServer,
    scripted_server,
)

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import PendantClient, Refused
from openpendant.tools.pendants.gamepad.bridge import GamepadBridge
from openpendant.tools.pendants.gamepad.device import DeviceUnusable, InputDevice
from openpendant.tools.pendants.gamepad.settings import DeviceKind, settings_of

pytestmark = pytest.mark.virtual_clock

DEADLINE = 0.15


def loop_ns() -> int:
    return int(asyncio.get_running_loop().time() * 1e9)


class Bridged:
    """A bridge between a pipe and a scripted server."""

    ran: asyncio.Task[None]

    def __init__(self, server: ScriptedPendantServer, plug: PluggedDevice, **table: Any) -> None:
        self.server = server
        self.plug = plug
        data = {"gamepad": {"device": str(plug.path), "deadline": DEADLINE, **table}}
        self.bridge = GamepadBridge(settings_of(data, {}, ""), self.connect, clock=loop_ns)
        self.pad = self.bridge.gamepad

    async def connect(self) -> PendantClient:
        return await PendantClient.connect("127.0.0.1", self.server.port, state_rate=25)

    async def until(self, holds: Callable[[], object], within: float = 5.0) -> None:
        async with asyncio.timeout(within):
            while not holds():  # noqa: ASYNC110 - what is waited for tells nobody
                await asyncio.sleep(0.005)

    async def hold(self) -> None:
        self.plug.write(button(ENABLING, down=True))
        await self.until(lambda: self.pad.is_held)

    async def press(self, share: float = -1.0) -> None:
        """Hold the enabling button and push the stick; wait until the press is accepted."""
        presses = len(self.all(messages.JogStart))
        await self.hold()
        self.plug.write(axis(LEFT_Y, share))
        await self.until(lambda: len(self.all(messages.JogStart)) > presses)
        await asyncio.sleep(0.01)

    async def shake(self, seconds: float) -> None:
        """Let the stick tremble, so that the device is seen to live."""
        for step in range(round(seconds / 0.1)):
            self.plug.write(axis(LEFT_Y, -1.0 + 0.001 * (step % 2)))
            await asyncio.sleep(0.1)

    def all(self, kind: Any) -> list[Any]:
        return self.server.all(kind)

    @property
    def lines(self) -> str:
        return "\n".join(self.pad.messages.lines)


@asynccontextmanager
async def bridged(folder: Path, *, name: str = "js0", **table: Any) -> AsyncIterator[Bridged]:
    """Yield a bridge that is connected, in control, and reads a device that was just opened."""
    plug = PluggedDevice(folder / name)
    plug.plug()
    async with scripted_server() as server:
        server.answers["snapshot"] = {**snapshot()}
        made = Bridged(server, plug, **table)
        server.holder = SESSION
        made.ran = asyncio.create_task(made.bridge.run())
        try:
            await made.until(lambda: made.pad.cell.state is not None)
            if name.startswith("js"):
                plug.write(opening())
            await asyncio.sleep(0.05)
            yield made
        finally:
            made.ran.cancel()
            await asyncio.gather(made.ran, return_exceptions=True)
            plug.pull()


async def test_a_stick_jogs_the_robot_while_the_enabling_button_is_held(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        made.plug.write(button(ENABLING, down=False))
        await made.until(lambda: made.all(messages.JogRelease))
    start = made.server.one(messages.JogStart)
    assert (start.space, start.frame) == (messages.JogSpace.TOOL, "base")
    assert start.values[:6] == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert start.deadline == pytest.approx(DEADLINE)
    assert made.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED


async def test_the_key_and_its_enabling_device_are_let_go_together_the_key_in_front(
    tmp_path: Path,
) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        before = len(made.server.got)
        made.plug.write(button(ENABLING, down=False))
        await asyncio.sleep(0.01)
        came = [(at, type(each)) for at, each in made.server.got[before:]]
        (release, enabling) = [each for each in came if each[1] is not messages.JogBeat]
        assert (release[1], enabling[1]) == (messages.JogRelease, messages.Enabling)
        assert release[0] == enabling[0]


async def test_signs_leave_every_40_ms_with_enabling_in_front(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        await made.shake(1.0)
        times = made.server.times(messages.JogBeat)
        gaps = [later - first for first, later in pairwise(times)]
        assert max(gaps) < 0.07
        kinds = [type(each) for _, each in made.server.got]
        for index, kind in enumerate(kinds):
            if kind is messages.JogBeat:
                assert kinds[index - 1] is messages.Enabling


async def test_an_aim_takes_over_and_a_later_one_waits_for_no_more_than_the_one_before(
    tmp_path: Path,
) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        for step in range(50):
            made.plug.write(axis(LEFT_Y, -1.0 + 0.015 * step))
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.1)
        starts = made.all(messages.JogStart)
        assert 5 <= len(starts) <= 15
        assert starts[-1].values[0] == pytest.approx((0.265 - 0.15) / 0.85, abs=0.03)


async def test_a_refused_aim_lets_go_as_the_robot_would_go_on_the_old_way(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        made.server.refusals[messages.JogStart] = (V.BAD_ARGUMENT, "no such way")
        made.plug.write(axis(LEFT_Y, 1.0))
        await made.until(lambda: made.all(messages.JogRelease), within=0.1)
        await asyncio.sleep(0.01)
        beats = len(made.all(messages.JogBeat))
        await made.shake(0.5)
        assert len(made.all(messages.JogBeat)) == beats
        assert len(made.all(messages.JogStart)) == 2
        assert "no such way" in made.lines
        assert not made.pad.is_held


async def test_a_refused_press_is_told_and_not_tried_again(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        made.server.refusals[messages.JogStart] = (V.NOT_ENABLED, "not enabled")
        await made.press()
        await made.shake(0.5)
        assert len(made.all(messages.JogStart)) == 1
        assert "Let the enabling button go, then press it again." in made.lines


# The device is gone.


async def test_a_pipe_that_ends_lets_go_within_the_turn_that_reads_its_end(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        ended = asyncio.get_running_loop().time()
        made.plug.pull()
        await asyncio.sleep(0.001)
        assert made.server.times(messages.JogRelease) == [pytest.approx(ended, abs=1e-6)]
        assert made.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED
        await asyncio.sleep(1.0)
        assert len(made.all(messages.JogStart)) == 1
        assert "unplugged; what it held was released. Trying again" in made.lines


async def test_half_an_event_lets_go_likewise(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        made.plug.write(axis(LEFT_Y, -0.5)[:5])
        await asyncio.sleep(0.001)
        assert len(made.all(messages.JogRelease)) == 1
        assert "it ended within an event" in made.lines


async def test_a_still_stick_goes_on_for_two_seconds_and_no_longer(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        pressed = made.server.times(messages.JogStart)[0]
        await made.until(lambda: made.all(messages.JogRelease))
        assert made.server.times(messages.JogRelease)[0] - pressed == pytest.approx(2.0, abs=0.03)


async def test_a_device_that_is_plugged_in_again_moves_nothing_before_it_was_let_go(
    tmp_path: Path,
) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        made.plug.pull()
        await asyncio.sleep(0.2)
        made.plug.plug()
        made.plug.write(opening(down=frozenset({ENABLING}), a1=-1.0))
        await asyncio.sleep(2.0)
        await made.shake(0.5)
        assert len(made.all(messages.JogStart)) == 1
        made.plug.write(button(ENABLING, down=False) + axis(LEFT_Y, 0.0))
        await asyncio.sleep(0.05)
        await made.press()


async def test_a_device_that_comes_and_goes_is_told_once_for_each_change(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        made.plug.pull()
        await asyncio.sleep(20.0)
        made.plug.plug()
        await asyncio.sleep(6.0)
        told = [line for line in made.pad.messages.lines if "js0" in line or "unplugged" in line]
    assert [line.partition(" ")[0] for line in told] == ["reading", "unplugged;", "no", "reading"]
    assert (
        f"no such device {tmp_path / 'js0'}; plug it in, or name another with --device" in told[2]
    )
    assert told[2].endswith("Trying every 0.5 to 5 s")


async def test_lost_events_of_a_cap_let_go(tmp_path: Path) -> None:
    async with bridged(tmp_path, name="event7") as made:
        made.plug.write(report((KEYS, 256, 1), (REL, 1, -350)))
        await made.until(lambda: made.all(messages.JogStart))
        made.plug.write(DROPPED)
        await asyncio.sleep(0.001)
        assert len(made.all(messages.JogRelease)) == 1


async def test_a_relative_cap_that_is_let_go_ends_the_press(tmp_path: Path) -> None:
    async with bridged(tmp_path, name="event7") as made:
        for _ in range(10):
            made.plug.write(report((KEYS, 256, 1), (REL, 1, -350)))
            await asyncio.sleep(0.05)
        last = asyncio.get_running_loop().time() - 0.05
        await made.until(lambda: made.all(messages.JogRelease))
        assert made.server.times(messages.JogRelease)[0] - last == pytest.approx(0.11, abs=0.02)
        assert made.pad.is_held


# The link to the server.


async def test_a_stop_leaves_at_once_and_in_front_of_what_it_lets_go(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        made.plug.write(button(STOP, down=True))
        await made.until(lambda: made.all(messages.SoftwareStop))
        assert made.server.one(messages.SoftwareStop).reason == "gamepad"
        assert len(made.all(messages.JogRelease)) == 1
        assert not made.pad.stop_key.is_owed


async def test_a_stop_without_a_link_leaves_first_on_the_next(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        made.server.hang_up()
        await made.until(lambda: not made.pad.cell.is_connected)
        made.plug.write(button(STOP, down=True))
        await made.until(lambda: made.all(messages.SoftwareStop))
        kinds = [type(each) for _, each in made.server.got]
        assert kinds.index(messages.SoftwareStop) - kinds.index(messages.Hello, 1) <= 2


async def test_another_connection_moves_nothing_before_the_button_was_let_go(
    tmp_path: Path,
) -> None:
    async with bridged(tmp_path) as made:
        await made.press()
        made.server.hang_up()
        await made.until(lambda: not made.pad.cell.is_connected)
        await made.until(lambda: made.pad.cell.is_connected)
        await made.shake(0.5)
        assert len(made.all(messages.JogStart)) == 1
        made.plug.write(button(ENABLING, down=False) + axis(LEFT_Y, 0.0))
        await asyncio.sleep(0.05)
        await made.press()


async def test_without_control_the_first_press_asks_for_it(tmp_path: Path) -> None:
    async with bridged(tmp_path) as made:
        made.server.holder = 0
        await asyncio.sleep(0.1)
        made.plug.write(axis(LEFT_Y, -1.0) + button(ENABLING, down=True))
        await made.until(lambda: made.all(messages.Authority))
        made.server.holder = SESSION
        await made.shake(0.5)
        assert made.all(messages.JogStart) == []


async def test_a_server_that_refuses_for_good_ends_the_bridge(tmp_path: Path) -> None:
    async with scripted_server() as server:
        server.cells = ("left", "right")
        made = Bridged(server, PluggedDevice(tmp_path / "js0"))
        with pytest.raises(Refused):
            await made.bridge.run()


@pytest.mark.parametrize("kind", ["file", "folder"])
async def test_what_is_no_device_is_named(tmp_path: Path, kind: str) -> None:
    place = tmp_path / "js0"
    if kind == "folder":
        place.mkdir()
    else:
        place.write_bytes(opening())
    async with scripted_server() as server:
        server.answers["snapshot"] = {**snapshot()}
        made = Bridged(server, PluggedDevice(place))
        made.ran = asyncio.create_task(made.bridge.run())
        await made.until(lambda: f"{place} is no input device" in made.lines)
        made.ran.cancel()
        await asyncio.gather(made.ran, return_exceptions=True)


@pytest.mark.parametrize(
    ("number", "told"),
    [
        (errno.EACCES, "not allowed to read /dev/input/js9; add this user to the group"),
        (errno.EPERM, "not allowed to read /dev/input/js9; add this user to the group"),
        (errno.ENOENT, "no such device /dev/input/js9; plug it in, or name another"),
        (errno.ENOTDIR, "no such device /dev/input/js9; plug it in, or name another"),
        (errno.ENODEV, "no device is behind /dev/input/js9; plug it in, or name another"),
        (errno.ENXIO, "no device is behind /dev/input/js9; plug it in, or name another"),
        (errno.EMFILE, "/dev/input/js9 cannot be opened: Too many open files"),
    ],
)
async def test_what_cannot_be_opened_is_named_with_what_helps(
    number: int, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: str, flags: int) -> int:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", refuse)
        with pytest.raises(DeviceUnusable) as unusable:
            InputDevice("/dev/input/js9", DeviceKind.GAMEPAD, print, print, loop_ns)
    assert str(unusable.value).startswith(told)


async def test_a_read_that_fails_is_a_device_that_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with bridged(tmp_path) as made:
        await made.press()

        def fail(file: int, most: int) -> bytes:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))

        with monkeypatch.context() as patched:
            patched.setattr(os, "read", fail)
            made.plug.write(axis(LEFT_Y, -0.9))
            await asyncio.sleep(0.001)
        assert len(made.all(messages.JogRelease)) == 1
        assert "unplugged; what it held was released. Trying again" in made.lines
