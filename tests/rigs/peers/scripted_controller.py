"""A scripted controller: follows its points exactly and misbehaves as told. Two joints."""

from bisect import bisect_right
from dataclasses import dataclass, field
from enum import Enum

from openpendant import simplemsg as wire


class Fault(Enum):
    """What the controller does to a point instead of taking it."""

    REFUSE = "answers failure"
    WRONG_TYPE = "answers with another type"
    SILENT = "does not answer"
    LATE = "answers after 600 ms"
    TWICE = "answers twice"
    LINK_LOST = "closes the connection"


@dataclass
class ScriptedController:
    """Follows every point exactly at its time; a stop freezes it."""

    position: tuple[float, ...] = (0.0, 0.0)
    faults: dict[int, Fault] = field(default_factory=dict)
    reports: bool = True
    coasts: bool = False
    mode: int = wire.ControllerMode.AUTO
    e_stopped: bool = False
    error_code: int = 0
    powered: bool = True
    awaited: int = 0
    points: list[wire.JointTrajPtFull | wire.JointTrajPt] = field(default_factory=list)
    _began: int = 0
    _times: list[int] = field(default_factory=list)
    _path: list[wire.JointTrajPtFull] = field(default_factory=list)
    _stopped: bool = True
    _foreign_velocity: tuple[float, ...] = (0.0, 0.0)

    def take(self, point: wire.JointTrajPtFull, now: int) -> None:
        if point.sequence == 0:
            self._began, self._times, self._path = now, [], []
            self._stopped = False
        self._times.append(self._began + round(point.time * 1e9))
        self._path.append(point)

    def stop(self, now: int) -> None:
        if not self.coasts:
            self.position = self.state(now)[0]
            self._stopped, self._foreign_velocity = True, (0.0, 0.0)

    def be_moved(
        self, position: tuple[float, ...], velocity: tuple[float, ...] = (0.0, 0.0)
    ) -> None:
        """Be where its own pendant has brought it, and brings it on."""
        self._stopped = True
        self.position, self._foreign_velocity = position, velocity

    def fall_behind(self, lag: int) -> None:
        """Be where all points that were taken are reached so much later [ns]."""
        self._began += lag
        self._times = [time + lag for time in self._times]

    def state(self, now: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return (position, velocity), two joints each."""
        if self._stopped or not self._path:
            return self.position, self._foreign_velocity
        index = bisect_right(self._times, now) - 1
        if index < 0:
            return self.position, (0.0, 0.0)
        self.position = self._path[index].positions[:2]
        return self.position, self._path[index].velocities[:2]

    def feedback(self, now: int) -> wire.JointFeedback:
        position, velocity = self.state(now)
        return wire.JointFeedback(
            robot_id=0,
            valid_fields=wire.ValidField.POSITION | wire.ValidField.VELOCITY,
            time=now / 1e9,
            positions=wire.joint_array(position),
            velocities=wire.joint_array(velocity),
            accelerations=wire.joint_array(()),
        )

    def status(self, now: int) -> wire.Status:
        moves = any(self.state(now)[1])
        return wire.Status(
            drives_powered=tri(self.powered),
            e_stopped=tri(self.e_stopped),
            error_code=self.error_code,
            in_error=tri(self.error_code != 0),
            in_motion=tri(moves),
            mode=self.mode,
            motion_possible=tri(not self.e_stopped and not self.error_code),
        )


def tri(value: bool) -> wire.TriState:
    return wire.TriState.TRUE if value else wire.TriState.FALSE
