"""The server under test: its ports, what is known of it, and the connections of one check.

Owns opening and closing, the byte order that was found, and where the robot stood at first. It
decides nothing about verdicts; what cannot be had is raised as `CannotJudge` or
`TargetUnreachable`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import (
    JOINT_SLOTS,
    MOTOMAN,
    PENDANT,
    STANDARD,
    ByteOrder,
    Codec,
    Dialect,
    MsgType,
    Ping,
    codec_for,
)

from ..check import CannotJudge, Profile, RuleBroken
from .answers import STOP, LivenessProbe
from .monitor import Guard, Watch
from .wire import TargetUnreachable, Wire, open_wire

_Kept = TypeVar("_Kept")

CLOSING_PAUSE = 0.02
"""So long the target gets to notice that a check's connections are closed [s]."""

FENCE_TOLERANCE = 0.01
"""A joint may be so far beyond the amplitude before it is stopped [rad or m]."""

_FIRST_WORD = 2.5
_MOST_TOPICS = 20
_ORDERS: tuple[Literal["little", "big"], ...] = ("little", "big")
_MOTION = "motion"


@dataclass(frozen=True, slots=True)
class Options:
    """Options of the user for one run.

    Attributes:
        state_port: where it reports; None where it has no such port.
        order: its byte order; None to find it out.
        joint: index of the joint to move; None for the last one that can.
        amplitude: how far it is moved [rad or m].
    """

    host: str
    motion_port: int
    state_port: int | None = None
    pendant_port: int | None = None
    profile: Profile = Profile.GENERIC
    dialect: str = "standard"
    order: ByteOrder | None = None
    real_size: int = 4
    may_move: bool = False
    joint: int | None = None
    amplitude: float = 0.05
    limits: JointLimits | None = None


class Target:
    """The target and the connections that are open to it.

    Attributes:
        order: its byte order, as found.
        home: all ten slots at the first look, [rad or m]; None before it and without state port.
        moved_joint: index of the joint that is moved; None before it was chosen.
        blocked: reason for which the robot could not be brought back to its start, else empty.
        may_have_moved: the robot may not be where it was at the first look.
        knows_ping: it answers a lone PING, so it tells frames apart by their header.
        guard: breaks off what is done when the robot goes too far.
        idle_link: a motion link that stays open all the run; None where others would be kept out.
        long_watch: the same for the state port.
    """

    def __init__(self, options: Options) -> None:
        """Take the options; `survey` fills the rest."""
        self.options = options
        self.order = options.order or ByteOrder.LITTLE
        self.home: tuple[float, ...] | None = None
        self.moved_joint: int | None = None
        self.may_have_moved = False
        self.blocked = ""
        self.knows_ping = True
        self.guard = Guard(self.send_stop)
        self.idle_link: Wire | None = None
        self.long_watch: Watch | None = None
        self._wires: list[Wire] = []
        self._kept: dict[str, Any] = {}

    # Connections.

    def codec(self, order: ByteOrder | None = None, dialect: Dialect | None = None) -> Codec:
        """Return the codec of the target, or one in another order or dialect."""
        known = dialect or (MOTOMAN if self.options.dialect == "motoman" else STANDARD)
        return codec_for(known, order or self.order, self.options.real_size)

    @property
    def other_order(self) -> ByteOrder:
        """The byte order that the target was not found to speak."""
        return ByteOrder.BIG if self.order is ByteOrder.LITTLE else ByteOrder.LITTLE

    async def _open(self, name: str, port: int, codec: Codec) -> Wire:
        wire = await open_wire(name, self.options.host, port, codec)
        self._wires.append(wire)
        return wire

    async def motion(self, order: ByteOrder | None = None) -> Wire:
        """Connect to the motion port."""
        return await self._open(_MOTION, self.options.motion_port, self.codec(order))

    def send_stop(self) -> None:
        """Send STOP on every open connection to the motion port; wait for nothing."""
        for wire in self._wires:
            if wire.name == _MOTION:
                wire.send(self.codec().encode(STOP))

    async def state_wire(self) -> Wire:
        """Connect to the state port; raise CannotJudge where the target has none."""
        if self.options.state_port is None:
            raise CannotJudge("no state port was given")
        return await self._open("state", self.options.state_port, self.codec())

    async def state(self) -> Watch:
        """Connect to the state port and watch it."""
        return Watch(await self.state_wire(), self.guard.look)

    async def pendant(self, order: ByteOrder = ByteOrder.LITTLE) -> Wire:
        """Connect to the pendant port; raise CannotJudge where the target has none."""
        if self.options.pendant_port is None:
            raise CannotJudge("no pendant port was given")
        return await self._open("pendant", self.options.pendant_port, codec_for(PENDANT, order, 4))

    def keep(self, wire: Wire) -> Wire:
        """Leave a connection open when the others are closed; who keeps it closes it."""
        self._wires.remove(wire)
        return wire

    async def close(self) -> list[str]:
        """Close what is open, let the target notice, and return what travelled last."""
        logs = [line for wire in self._wires for line in wire.log]
        for wire in self._wires:
            wire.close()
        self._wires.clear()
        # Only who commanded the robot must be seen to leave before the next may command it.
        await asyncio.sleep(CLOSING_PAUSE if self.may_have_moved else CLOSING_PAUSE / 4)
        return logs

    async def is_alive(self) -> bool:
        """Return True if the target still takes connections on the port that is judged."""
        options = self.options
        port = options.motion_port
        if options.profile is Profile.PENDANT and options.pendant_port is not None:
            port = options.pendant_port
        try:
            wire = await open_wire(_MOTION, options.host, port, self.codec())
        except TargetUnreachable:
            return False
        # One that closes at once has stopped listening in all but name, or has no room left.
        lost = await wire.is_closed_within(CLOSING_PAUSE / 4)
        wire.close()
        return not lost

    # What is known of it.

    async def survey(self) -> None:
        """Find byte order, knowledge of PING, position; TargetUnreachable where a port is shut."""
        if self.options.profile is Profile.PENDANT:
            await self.pendant()
            await self.close()
            return
        if self.options.order is None:
            await self._find_order()
        self.knows_ping = await self._answers_ping()
        if self.options.state_port is not None:
            watch = await self.state()
            await watch.begin(_FIRST_WORD)
            if watch.joints:
                self.home = watch.position
        await self.close()

    async def _find_order(self) -> None:
        """Try both orders: on the state port the target speaks first, on the other it answers."""
        for order in (ByteOrder.LITTLE, ByteOrder.BIG):
            self.order = order
            if self.options.state_port is not None:
                wire = await self.state_wire()
                told = await wire.poll(_FIRST_WORD) is not None
                is_wrong = bool(wire.stray)
            else:
                wire = await self.motion()
                wire.send(Ping())
                told, is_wrong = await wire.poll(1.0) is not None, False
            await self.close()
            if told:
                return
            if self.options.state_port is not None and not is_wrong:
                break  # silent in any order
        self.order = ByteOrder.LITTLE

    async def _answers_ping(self) -> bool:
        """Send one PING, on a connection of its own, and look for the type of whatever comes.

        Its sixteen bytes are too few for a point. A reader of fixed layout waits for more, and
        would take PINGs in a row for a point near zero.
        """
        wire = await self.motion()
        wire.send(Ping())
        came: list[bytes] = []
        while (frame := await wire.poll(1.0)) is not None and len(came) < _MOST_TOPICS:
            came.append(frame.data)
            if frame.msg_type == MsgType.PING:
                break
        came.append(wire.unread)
        await self.close()
        types = {int.from_bytes(data[4:8], order) for data in came for order in _ORDERS}
        return int(MsgType.PING) in types

    @property
    def probe(self) -> LivenessProbe:
        """The liveness probe that this target knows."""
        return LivenessProbe(knows_ping=self.knows_ping)

    @property
    def is_minimum(self) -> bool:
        """It is judged by docs/minimum-controller.md, which is stricter than the protocol."""
        return self.options.profile is Profile.MINIMUM

    @property
    def reach(self) -> float:
        """Largest permitted distance of the robot from its first position [rad or m]."""
        return self.options.amplitude + FENCE_TOLERANCE

    @property
    def dof(self) -> int:
        """Driven joints; without the robot's file, the slots up to the last that is not 0."""
        if self.options.limits is not None:
            return self.options.limits.dof
        used = [slot for slot in range(JOINT_SLOTS) if self.home is not None and self.home[slot]]
        return max(used, default=0) + 1

    async def once(
        self, name: str, make: Callable[[Target], Awaitable[_Kept]], *, is_subject: bool = False
    ) -> _Kept:
        """Return what was observed once and is judged by several checks.

        Raises:
            CannotJudge: it could not be observed, now or at the first attempt.
            RuleBroken: the same, where that is what the check is about.
        """
        if name not in self._kept:
            try:
                self._kept[name] = await make(self)
            except (CannotJudge, RuleBroken, TargetUnreachable) as error:
                self._kept[name] = error
        kept = self._kept[name]
        if isinstance(kept, Exception):
            if is_subject and isinstance(kept, RuleBroken):
                raise RuleBroken(str(kept))
            raise CannotJudge(f"{name} could not be observed: {kept}")
        return kept  # type: ignore[no-any-return]  # what `make` gave under this name
