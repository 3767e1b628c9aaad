"""The client's programs, recordings, frames, tools, scene, devices and accounts, in groups.

What each operation asks and tells is said in `management`; here the two that move the robot get
their motions. `sync_managing` has the same groups, blocking.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, cast

from .management.access import AccessCalls, UserCalls
from .management.calls import AsyncCalls, Manage, Request, then
from .management.devices import RobotCalls, SignalCalls, TraceCalls
from .management.frames import FrameCalls
from .management.programs import ProgramCalls
from .management.recordings import PlaybackAccount, RecordingCalls, play
from .management.scene import SceneCalls
from .management.tools import ToolCalls
from .motions import MotionHandle
from .moves import Moves
from .observing import Observing

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


class Recordings(RecordingCalls, AsyncCalls):
    """Recordings.

    Attributes:
        play: plays one back; returns once the motion has begun, and its `done` tells the end.
    """

    def __init__(self, manage: Manage, begin: Begin) -> None:
        """Made by the client."""
        super().__init__(manage)

        async def begun(request: Request[PlaybackAccount]) -> PlaybackHandle:
            answer, motion = await begin(request.body)
            return PlaybackHandle(motion, cast(PlaybackAccount, answer))

        self.play = then(play, begun)


class Frames(FrameCalls, AsyncCalls):
    """User frames."""


class Tools(ToolCalls, AsyncCalls):
    """Tools."""


class Scene(SceneCalls, AsyncCalls):
    """The scene."""


class Signals(SignalCalls, AsyncCalls):
    """Signals of the controller."""


class Robots(RobotCalls, AsyncCalls):
    """The robot itself."""


class Trace(TraceCalls, AsyncCalls):
    """The trace of the tool."""


class Access(AccessCalls, AsyncCalls):
    """Connections."""


class Users(UserCalls, AsyncCalls):
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
        self.recordings = Recordings(self.manage, self._manage_motion)
        self.frames = Frames(self.manage)
        self.tools = Tools(self.manage)
        self.scene = Scene(self.manage)
        self.signals = Signals(self.manage)
        self.robots = Robots(self.manage)
        self.trace = Trace(self.manage)
        self.access = Access(self.manage)
        self.users = Users(self.manage)
