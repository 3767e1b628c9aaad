"""User frames: shown with the tools, changed, taught, and transformed into each other."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import frames

from .calls import call, calls_of


@calls_of("frames")
class FrameCalls:
    """The operations on user frames."""

    show = call(frames.ShowFrames)
    add = call(frames.AddFrame)
    move = call(frames.MoveFrame)
    rename = call(frames.RenameFrame)
    remove = call(frames.RemoveFrame)
    teach = call(frames.TeachFrame)
    transform = call(frames.TransformPose)
    import_ = call(frames.ImportFrames)
