"""The scene: objects around the robot, which of them may touch, and what the robot carries."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import scene

from .calls import call, calls_of


@calls_of("scene")
class SceneCalls:
    """The operations on the scene."""

    show = call(scene.ShowScene)
    add = call(scene.AddObject)
    remove = call(scene.RemoveObject)
    move = call(scene.MoveObject)
    allow = call(scene.AllowContact)
    forbid = call(scene.ForbidContact)
    attach = call(scene.AttachObject)
    detach = call(scene.DetachObject)
    import_ = call(scene.ImportScene)
    nearest = call(scene.NearestBodies)
