"""The client's programs, recordings, frames, tools, scene, devices and accounts, in groups.

What each operation asks and tells is said in `management`; here the two that move the robot get
their motions. `sync_client` has the same groups, blocking.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, cast

from openpendant.simplemsg.pendant.management.declaration import Request, body_of
from openpendant.simplemsg.pendant.management.recordings import PlaybackAccount, PlayRecording

from .management.calls import AsyncCalls, Manage, function_of, then
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
from .motions import MotionHandle
from .observing import Observing
from .operating import Moves

Begin = Callable[[dict[str, Any]], Coroutine[Any, Any, tuple[dict[str, Any], MotionHandle]]]
"""Sends a management request that moves the robot; returns the answer and the motion."""


class PlaybackHandle(MotionHandle):
    """A recording that is played back, which has begun.

    Attributes:
        account: what was asked and what is possible.
    """

    def __init__(self, motion: MotionHandle, account: PlaybackAccount) -> None:
        """Made by the client's `recordings.play`."""
        super().__init__(motion.request_id, motion._outcome)
        self.account = account


class Programs(ProgramCalls, AsyncCalls):
    """Stored programs.

    Attributes:
        run: runs one, or a step of it; the client's `run_program`.
    """

    def __init__(self, manage: Manage, moves: Moves) -> None:
        """Made by the client."""
        super().__init__(manage)
        self.run = moves.run_program


class AsyncRecordingCalls(RecordingCalls, AsyncCalls):
    """Recordings.

    Attributes:
        play: plays one back; returns once the motion has begun, and its `done` tells the end.
    """

    def __init__(self, manage: Manage, begin: Begin) -> None:
        """Made by the client."""
        super().__init__(manage)

        async def begun(request: Request[PlaybackAccount]) -> PlaybackHandle:
            answer, motion = await begin(body_of(request))
            return PlaybackHandle(motion, cast(PlaybackAccount, answer))

        self.play = then(function_of(PlayRecording), begun)


class AsyncFrameCalls(FrameCalls, AsyncCalls):
    """User frames."""


class Tools(ToolCalls, AsyncCalls):
    """Tools."""


class AsyncSceneCalls(SceneCalls, AsyncCalls):
    """The scene."""


class AsyncSignalCalls(SignalCalls, AsyncCalls):
    """Signals of the controller."""


class AsyncRobotCalls(RobotCalls, AsyncCalls):
    """The robot itself."""


class AsyncTraceCalls(TraceCalls, AsyncCalls):
    """The trace of the tool."""


class Access(AccessCalls, AsyncCalls):
    """Connections."""


class AsyncUserCalls(UserCalls, AsyncCalls):
    """Accounts."""


class Managing(Moves, Observing):
    """Management operations in groups.

    Attributes:
        programs: stored programs: teach, edit, undo, dry run, run.
        recordings: continuous recordings: start, stop, trim, play.
        frames: user frames.
        tools: tools.
        scene: objects around the robot.
        signals: inputs and outputs.
        robots: the robot itself.
        trace: where the tool went.
        access: who is connected.
        users: who has an account.
    """

    def __init__(self) -> None:
        """Use `connect` instead."""
        super().__init__()
        self.programs = Programs(self.manage, self)
        self.recordings = AsyncRecordingCalls(self.manage, self._manage_motion)
        self.frames = AsyncFrameCalls(self.manage)
        self.tools = Tools(self.manage)
        self.scene = AsyncSceneCalls(self.manage)
        self.signals = AsyncSignalCalls(self.manage)
        self.robots = AsyncRobotCalls(self.manage)
        self.trace = AsyncTraceCalls(self.manage)
        self.access = Access(self.manage)
        self.users = AsyncUserCalls(self.manage)
