"""Hello, and the state that a pendant wants from then on.

Owns whom the server talks to at all: the version, the cell and the rate of a hello. Who a pendant
is, and what it may do, is `access`' business.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Capability,
    Hello,
    HelloReply,
    Subscribe,
)
from openpendant.simplemsg.pendant.roles import Permission
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Close, Effect, Send
from ...events.replies import NAME_BYTES, cut, verdict
from ...refusal import Refusal
from ...settings.cell_settings import CellSettings
from .access_requests import AccessRequests
from .listeners import Listener, Listeners
from .request_arguments import rate_fault

_ALWAYS = ~(Capability.RECORDING | Capability.SIGNALS | Capability.SCENE)
"""The rest needs surroundings."""


@dataclass(frozen=True, slots=True)
class Identity:
    """What hello says of this server.

    Attributes:
        cell: name of the cell.
        robot: name of the robot.
        server: name and version of the program.
        cells: name and robot of every cell of this server; empty for this one alone.
    """

    cell: str
    robot: str
    server: str
    cells: tuple[tuple[str, str], ...] = ()


class Greeting:
    """The door of one cell: everybody comes in here, and nothing else is answered before.

    Attributes:
        offers: what the server offers to whoever comes in.
    """

    def __init__(
        self,
        identity: Identity,
        dof: int,
        settings: CellSettings,
        listeners: Listeners,
        access: AccessRequests,
        offers: Capability,
    ) -> None:
        """Make a door.

        Args:
            identity: what the answer says of this server.
            dof: driven joints of the robot.
            settings: the cell's configuration.
            listeners: the connections.
            access: told who came in.
            offers: what the surroundings of the robot add to what is always offered.
        """
        self.offers = _ALWAYS | offers
        self._identity = identity
        self._dof = dof
        self._settings = settings
        self._listeners = listeners
        self._access = access

    def hello(self, session: int, hello: Hello, now: int) -> list[Effect]:
        """Welcome a connection, or refuse it and part with it."""
        listener = self._listeners[session]
        if listener.welcomed:
            refusal = Refusal(VerdictCode.BAD_ARGUMENT, "hello was said already")
            return [Send(session, verdict(0, refusal))]
        refused_for = self._unwelcome(hello)
        if refused_for is not None:
            listener.leaving = True
            return [Send(session, verdict(0, refused_for)), Close(session, refused_for.sentence)]
        self._welcome(listener, hello, now)
        return [Send(session, self._reply(session))]

    def _unwelcome(self, hello: Hello) -> Refusal | None:
        if hello.protocol_version != PROTOCOL_VERSION:
            text = f"the server speaks version {PROTOCOL_VERSION}, not {hello.protocol_version}"
            return Refusal(VerdictCode.VERSION, text)
        if hello.cell not in ("", self._identity.cell):
            text = f"no cell {hello.cell!r} here, only {self._identity.cell!r}"
            return Refusal(VerdictCode.UNKNOWN_CELL, text)
        return rate_fault(hello.state_rate)

    def _welcome(self, listener: Listener, hello: Hello, now: int) -> None:
        session = listener.session
        listener.welcomed = True
        listener.hello_name = cut(hello.client, NAME_BYTES)
        self._access.welcomed(session, listener.address, listener.hello_name, now)
        listener.client = self._access.name_of(session, listener.hello_name)
        listener.looks_on = self._access.may(session, Permission.OBSERVE)
        self._listeners.set_rate(session, hello.state_rate, now)

    def _reply(self, session: int) -> HelloReply:
        return HelloReply(
            protocol_version=PROTOCOL_VERSION,
            session=session,
            capabilities=self.offers,
            max_frame=MAX_PENDANT_FRAME,
            dof=self._dof,
            tick_rate=float(self._settings.tick_rate),
            max_state_rate=self._listeners.max_rate,
            authority_timeout=self._settings.pendants.authority_timeout,
            cell=self._identity.cell,
            robot=cut(self._identity.robot, NAME_BYTES),
            server=cut(self._identity.server, NAME_BYTES),
        )

    def subscribe(self, session: int, message: Subscribe, now: int) -> Refusal | None:
        """Set how often a pendant is sent state.

        Returns:
            Why the rate is refused.
        """
        refusal = rate_fault(message.state_rate)
        if refusal is None:
            self._listeners.set_rate(session, message.state_rate, now)
        return refusal
