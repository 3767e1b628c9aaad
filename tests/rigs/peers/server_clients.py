"""The server's clients in tests: pendants and ROS-I clients that remember what they were told."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from openpendant.server.events.events import Closed, Received
from openpendant.simplemsg import Arrival, CommType, JointTrajPt, Message, ReplyCode, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode

if TYPE_CHECKING:
    from rigs.cells.server_rig import Shell

_M = TypeVar("_M", bound=Message)
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
NEAR = (0.3, 0.0, 0.3)


class Peer:
    """One client's connection: what it sent is the core's business, what it got is kept here."""

    def __init__(self, rig: Shell, session: int) -> None:
        self.rig = rig
        self.session = session
        self.got: list[Message] = []
        self.closed_for: list[str] = []

    def send(self, message: Arrival) -> list[Message]:
        """Send a message and return what came back on this call stack."""
        before = len(self.got)
        self.rig.perform(self.rig.core.handle(Received(self.session, message), self.rig.now))
        return self.got[before:]

    def close(self) -> None:
        self.rig.perform(self.rig.core.handle(Closed(self.session), self.rig.now))

    def all(self, kind: type[_M]) -> list[_M]:
        return [message for message in self.got if isinstance(message, kind)]


class Pendant(Peer):
    """A pendant with shorthands for its requests; each uses a fresh request id."""

    last_request = 0

    def _next(self) -> int:
        self.last_request += 1
        return self.last_request

    def hello(
        self,
        client: str = "tester",
        state_rate: float = 0.0,
        version: int = messages.PROTOCOL_VERSION,
    ) -> list[Message]:
        return self.send(hello(client, state_rate, version=version))

    def code(self, message: Message) -> VerdictCode | None:
        """Send a request and return the code of its own verdict, None if none came yet."""
        request_id = getattr(message, "request_id", 0)
        codes = [
            VerdictCode(answer.code)
            for answer in self.send(message)
            if isinstance(answer, messages.Verdict) and answer.request_id == request_id
        ]
        assert len(codes) <= 1
        return codes[0] if codes else None

    def take(self) -> VerdictCode | None:
        return self.code(messages.Authority(self._next(), messages.AuthorityAction.REQUEST))

    def release(self) -> VerdictCode | None:
        return self.code(messages.Authority(self._next(), messages.AuthorityAction.RELEASE))

    def move(self, *joints: float, speed: float = 1.0) -> VerdictCode | None:
        return self.code(messages.JointMove(self._next(), speed, len(joints), joint_array(joints)))

    def path(self, *waypoints: Sequence[float], speed: float = 1.0) -> VerdictCode | None:
        points = tuple(messages.JointWaypoint(joint_array(waypoint)) for waypoint in waypoints)
        return self.code(messages.JointPath(self._next(), speed, len(waypoints[0]), points))

    def stop(self, reason: str = "enough") -> VerdictCode | None:
        return self.code(messages.SoftwareStop(self._next(), reason))

    def reset(self) -> VerdictCode | None:
        return self.code(messages.ResetStop(self._next()))

    def mode(self, mode: int) -> VerdictCode | None:
        return self.code(messages.SetMode(self._next(), mode))

    def speed(self, override: float, tool_speed: float = 0.0) -> VerdictCode | None:
        return self.code(messages.SetSpeed(self._next(), override, tool_speed))

    def control(self, action: messages.MotionControlAction) -> VerdictCode | None:
        return self.code(messages.MotionControl(self._next(), action))

    def enable(self, *positions: int) -> None:
        for position in positions:
            self.send(messages.Enabling(position))

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Make a management request that is answered on this call stack; return the answer."""
        request = messages.Management(77, json.dumps({"op": op, **fields}).encode())
        (reply,) = [each for each in self.send(request) if isinstance(each, messages.Management)]
        return _answer_in(reply)

    def answers(self) -> list[dict[str, Any]]:
        """Return what management requests were answered so far."""
        return [_answer_in(reply) for reply in self.all(messages.Management)]

    def verdicts(self) -> list[tuple[int, VerdictCode]]:
        return [(item.request_id, VerdictCode(item.code)) for item in self.all(messages.Verdict)]

    def outcomes(self) -> list[tuple[int, VerdictCode]]:
        return [(item.request_id, VerdictCode(item.code)) for item in self.all(messages.Outcome)]


def _answer_in(reply: messages.Management) -> dict[str, Any]:
    answer: dict[str, Any] = json.loads(reply.body)
    assert ("code" in answer) == (reply.reply_code == ReplyCode.FAILURE)
    return answer


class RosClient(Peer):
    """A ROS-I motion connection."""

    def point(
        self,
        sequence: int,
        *joints: float,
        duration: float = 0.5,
        velocity: float = 0.1,
        comm_type: CommType = CommType.REQUEST,
    ) -> ReplyCode | None:
        """Send one point and return the code of its reply."""
        message = JointTrajPt(
            sequence, joint_array(joints), velocity, duration, comm_type=comm_type
        )
        return self.code(message)

    def code(self, message: Message) -> ReplyCode | None:
        replies = self.send(message)
        assert len(replies) <= 1
        return ReplyCode(replies[0].reply_code) if replies else None

    def trajectory(self, *positions: tuple[float, ...]) -> list[ReplyCode | None]:
        return [self.point(index, *joints) for index, joints in enumerate(positions)]

    def stop(self) -> ReplyCode | None:
        return self.point(-4)


def hello(
    client: str = "tester",
    state_rate: float = 0.0,
    cell: str = "",
    version: int = messages.PROTOCOL_VERSION,
) -> messages.Hello:
    return messages.Hello(version, state_rate, cell, client)


def pose(
    motion: int = 1,
    speed: float = 0.5,
    position: Sequence[float] = NEAR,
    orientation: Sequence[float] = UPRIGHT,
) -> messages.PoseMove:
    return messages.PoseMove(9, motion, speed, "base", tuple(position), tuple(orientation))


def joints(*values: float, speed: float = 0.5) -> messages.JointMove:
    return messages.JointMove(9, speed, len(values), joint_array(values))
