"""The blocking client's programs, recordings, frames, tools, scene, devices and accounts."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any

from .client import PendantClient
from .loop_thread import LoopThread
from .management.calls import SyncCalls, then
from .management.groups import (
    AccessCalls,
    FrameCalls,
    ProgramCalls,
    RecordingCalls,
    RobotCalls,
    SceneCalls,
    SignalCalls,
    ToolCalls,
    TraceCalls,
    UserCalls,
)
from .managing import PlaybackHandle
from .motions import MotionHandle
from .sync_session import SyncMotion, SyncSession


class SyncPlayback(SyncMotion):
    """A recording that is played back, which has begun.

    Attributes:
        account: what was asked and what is possible.
    """

    def __init__(self, thread: LoopThread, motion: PlaybackHandle) -> None:
        """Made by the client's `recordings.play`."""
        super().__init__(thread, motion)
        self.account = motion.account


class SyncPrograms(ProgramCalls, SyncCalls):
    """Stored programs.

    Attributes:
        run: runs one, or a step of it; the client's `run_program`.
    """

    def __init__(self, thread: LoopThread, background: PendantClient) -> None:
        """Made by the client."""
        super().__init__(thread, background.manage)

        def begun(run: Coroutine[Any, Any, MotionHandle]) -> SyncMotion:
            return SyncMotion(thread, thread.call(run))

        self.run = then(background.run_program, begun)


class SyncRecordings(RecordingCalls, SyncCalls):
    """Recordings.

    Attributes:
        play: plays one back; returns once the motion has begun, and its `done` tells the end.
    """

    def __init__(self, thread: LoopThread, background: PendantClient) -> None:
        """Made by the client."""
        super().__init__(thread, background.manage)

        def begun(playback: Coroutine[Any, Any, PlaybackHandle]) -> SyncPlayback:
            return SyncPlayback(thread, thread.call(playback))

        self.play = then(background.recordings.play, begun)


class SyncFrames(FrameCalls, SyncCalls):
    """User frames."""


class SyncTools(ToolCalls, SyncCalls):
    """Tools."""


class SyncScene(SceneCalls, SyncCalls):
    """The scene."""


class SyncSignals(SignalCalls, SyncCalls):
    """Signals of the controller."""


class SyncRobots(RobotCalls, SyncCalls):
    """The robot itself."""


class SyncTrace(TraceCalls, SyncCalls):
    """The trace of the tool."""


class SyncAccess(AccessCalls, SyncCalls):
    """Connections."""


class SyncUsers(UserCalls, SyncCalls):
    """Accounts."""


class SyncManaging(SyncSession):
    """Management operations in groups, with the names and arguments of `Managing`."""

    def __init__(self, thread: LoopThread, background: PendantClient) -> None:
        """Use `connect` instead."""
        super().__init__(thread, background)
        self.programs = SyncPrograms(thread, background)
        self.recordings = SyncRecordings(thread, background)
        self.frames = SyncFrames(thread, background.manage)
        self.tools = SyncTools(thread, background.manage)
        self.scene = SyncScene(thread, background.manage)
        self.signals = SyncSignals(thread, background.manage)
        self.robots = SyncRobots(thread, background.manage)
        self.trace = SyncTrace(thread, background.manage)
        self.access = SyncAccess(thread, background.manage)
        self.users = SyncUsers(thread, background.manage)
