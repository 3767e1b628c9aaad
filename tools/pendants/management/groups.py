"""Groups of management operations as both clients have them: a class a group, a line a call."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import (
    access,
    cell,
    devices,
    frames,
    kinematics,
    programs,
    recordings,
    scene,
    shapes,
)

from .calls import CallGroup, Way, call, calls_of


class CellCalls(CallGroup[Way]):
    """The operations on the cell as a whole, which are the clients' own calls."""

    snapshot = call(cell.SnapshotRequest)
    cells = call(cell.CellsRequest)
    why = call(cell.WhyRequest)
    retreat: call[[], list[cell.Hold]] = call(cell.RetreatRequest, part="holds")


@calls_of("programs")
class ProgramCalls(CallGroup[Way]):
    """The operations on stored programs."""

    list = call(programs.ListPrograms)
    create = call(programs.CreateProgram)
    load = call(programs.LoadProgram)
    history = call(programs.ProgramHistory)
    save = call(programs.SaveProgram)
    check = call(programs.CheckProgram)
    delete = call(programs.DeleteProgram)
    rename = call(programs.RenameProgram)
    edit = call(programs.EditProgram)
    record = call(programs.RecordPoint)
    touch_up = call(programs.TouchUpPoint)
    undo = call(programs.UndoEdit)
    redo = call(programs.RedoEdit)
    breakpoints = call(programs.SetBreakpoints)
    dry_run = call(programs.StartDryRun)
    dry_run_progress = call(programs.AskDryRunProgress)


@calls_of("recordings")
class RecordingCalls(CallGroup[Way]):
    """The operations on recordings; `play` moves the robot and is the clients' own."""

    list = call(recordings.ListRecordings)
    describe = call(recordings.DescribeRecording)
    start = call(recordings.StartRecording)
    stop = call(recordings.StopRecording)
    trim = call(recordings.TrimRecordingPart)
    rename = call(recordings.RenameARecording)
    delete = call(recordings.DeleteRecording)


@calls_of("frames")
class FrameCalls(CallGroup[Way]):
    """The operations on user frames."""

    show = call(frames.ShowFrames)
    add = call(frames.AddFrame)
    move = call(frames.MoveFrame)
    rename = call(frames.RenameFrame)
    remove = call(frames.RemoveFrame)
    teach = call(frames.TeachFrame)
    transform = call(frames.TransformPose)
    import_ = call(frames.ImportFrames)


@calls_of("tools")
class ToolCalls(CallGroup[Way]):
    """The operations on tools."""

    add = call(frames.AddTool)
    move = call(frames.MoveTool)
    remove = call(frames.RemoveTool)
    select = call(frames.SelectTool)
    calibrate = call(frames.CalibrateTool)
    import_ = call(frames.ImportTools)


@calls_of("scene")
class SceneCalls(CallGroup[Way]):
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


@calls_of("signals")
class SignalCalls(CallGroup[Way]):
    """The operations on signals."""

    read = call(devices.ReadAllSignals)
    set = call(devices.SetSignal)


@calls_of("robots")
class RobotCalls(CallGroup[Way]):
    """The operations on the robot itself."""

    list = call(devices.ListRobots)
    describe = call(devices.DescribeRobot)
    load = call(devices.LoadRobot)


@calls_of("kinematics")
class KinematicsCalls(CallGroup[Way]):
    """The questions on the robot's kinematics."""

    fk = call(kinematics.ForwardKinematics)
    jacobian = call(kinematics.ToolJacobian)
    ik = call(kinematics.InverseKinematics)


@calls_of("shapes")
class ShapeCalls(CallGroup[Way]):
    """The questions on what robots look like."""

    show = call(shapes.ShowShapes)
    meshes: call[[], list[shapes.RobotMesh]] = call(shapes.ListMeshes, part="meshes")
    mesh = call(shapes.ReadMesh)


@calls_of("trace")
class TraceCalls(CallGroup[Way]):
    """The operations on the trace of the tool."""

    show = call(devices.ShowTrace)
    clear = call(devices.ClearTrace)


@calls_of("access")
class AccessCalls(CallGroup[Way]):
    """The operations on connections."""

    whoami = call(access.WhoAmI)
    logout = call(access.Logout)
    sessions = call(access.ListSessions)
    exposure = call(access.ReadExposure)
    connections = call(access.ListConnections)
    close = call(access.CloseConnection)
    bar = call(access.BarAddress)
    unbar = call(access.UnbarAddress)


@calls_of("users")
class UserCalls(CallGroup[Way]):
    """The operations on accounts."""

    list = call(access.ListUsers)
    remove = call(access.RemoveUser)
    set_role = call(access.SetUserRole)
    disable = call(access.DisableUser)
    enable = call(access.EnableUser)


class GroupedCalls(CellCalls[Way]):
    """The operations on the cell and, in groups, on what is in it, as both clients have them.

    Attributes:
        frames: user frames.
        tools: tools.
        scene: objects around the robot.
        signals: inputs and outputs.
        robots: the robot itself.
        kinematics: forward kinematics, Jacobian, inverse kinematics.
        trace: where the tool went.
        access: who is connected.
        users: who has an account.
    """

    def __init__(self, way: Way) -> None:
        super().__init__(way)
        self.frames = FrameCalls(way)
        self.tools = ToolCalls(way)
        self.scene = SceneCalls(way)
        self.signals = SignalCalls(way)
        self.robots = RobotCalls(way)
        self.kinematics = KinematicsCalls(way)
        self.trace = TraceCalls(way)
        self.access = AccessCalls(way)
        self.users = UserCalls(way)
