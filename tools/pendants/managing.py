"""The client's programs, recordings, frames, tools, scene, devices and accounts, in groups.

What each operation asks and tells is said in `management`; here the two that move the robot get
their motions. `sync_client` has the same groups, blocking.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, cast

from openpendant.simplemsg.pendant.management.declaration import Request, body_of
from openpendant.simplemsg.pendant.management.recordings import PlaybackAccount, PlayRecording

from .management.calls import AsyncCalls, function_of, then
from .management.groups import ProgramCalls, RecordingCalls
from .mesh_download import AsyncShapeCalls
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
        super().__init__(motion.request_id, motion._outcome)
        self.account = account


class Programs(ProgramCalls[AsyncCalls]):
    """Stored programs.

    Attributes:
        run: runs one, or a step of it; the client's `run_program`.
    """

    def __init__(self, way: AsyncCalls, moves: Moves) -> None:
        super().__init__(way)
        self.run = moves.run_program


class AsyncRecordingCalls(RecordingCalls[AsyncCalls]):
    """Recordings.

    Attributes:
        play: plays one back; returns once the motion has begun, and its `done` tells the end.
    """

    def __init__(self, way: AsyncCalls, begin: Begin) -> None:
        super().__init__(way)

        async def begun(request: Request[PlaybackAccount]) -> PlaybackHandle:
            answer, motion = await begin(body_of(request))
            return PlaybackHandle(motion, cast(PlaybackAccount, answer))

        self.play = then(function_of(PlayRecording), begun)


class Managing(Moves, Observing):
    """Management operations that move the robot, too.

    Attributes:
        programs: stored programs: teach, edit, undo, dry run, run.
        recordings: continuous recordings: start, stop, trim, play.
        shapes: what robots look like; meshes and their download.
    """

    def __init__(self) -> None:
        super().__init__()
        self.programs = Programs(self._way, self)
        self.recordings = AsyncRecordingCalls(self._way, self._manage_motion)
        self.shapes = AsyncShapeCalls(self._way)
