"""The request gate: who is connected with which grant, role check and replay check of each request.

Owns the rule that a grant belongs to one connection and ends with it: there is no token that
another connection could present (promise 28). How a connection earns its grant, `admission` knows.

Owns the permission that each request needs; a management operation declares its own. A request in
no table needs the highest role: a new message that is forgotten here is then refused rather than
open to everybody. `simplemsg.pendant.roles` owns which role has a permission.

Owns the order of the checks (role, then order of the frames) and which of their results the audit
log holds.

Owns the rule that no request which can move the robot is taken twice or late (promise 28): on one
connection the ids of such requests must increase. A repeated frame, or one that arrives behind a
later one, has an id that is used up. TLS prevents others from replaying frames; this rule covers
the connection's own software, and a proxy where there is no TLS.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from openpendant.simplemsg import Message
from openpendant.simplemsg.declaration import Direction
from openpendant.simplemsg.pendant import (
    PENDANT_MESSAGES,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Declare,
    Enabling,
    Execute,
    Forwarded,
    Hello,
    Home,
    JogBeat,
    JogRelease,
    JogStart,
    JogStep,
    JogUndo,
    JointMove,
    JointPath,
    Lobby,
    Login,
    Management,
    MotionControl,
    MotionControlAction,
    Pairing,
    PoseMove,
    PosePath,
    Prepare,
    ProgramRun,
    ResetStop,
    SetAccount,
    SetMode,
    SetSpeed,
    SoftwareStop,
    Subscribe,
)
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import (
    LEAST_ROLE,
    PERMISSIONS_OF,
    WITHOUT_LOGIN,
    Permission,
    Role,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .audit import AuditEntry, AuditEvent, Detail
from .exposure import is_loopback

FREE: frozenset[type[Message]] = frozenset(
    {Forwarded, Lobby, Hello, Declare, Login, SoftwareStop, JogRelease}
)
"""What anybody may ask: to come in and declare wishes, to stop, and to end a press of his own."""

TOPICS: frozenset[type[Message]] = frozenset({AuthorityBeat, JogBeat, Enabling})
"""What is taken without an answer: each only prolongs, or ends, what its own connection has."""

OF_MESSAGE: Mapping[type[Message], Permission] = {
    Subscribe: Permission.OBSERVE,
    Authority: Permission.MOVE,
    JointMove: Permission.MOVE,
    PoseMove: Permission.MOVE,
    JointPath: Permission.MOVE,
    PosePath: Permission.MOVE,
    Home: Permission.MOVE,
    Execute: Permission.MOVE,
    Prepare: Permission.MOVE,
    JogStart: Permission.MOVE,
    JogStep: Permission.MOVE,
    JogUndo: Permission.MOVE,
    SetSpeed: Permission.MOVE,
    MotionControl: Permission.RUN_PROGRAM,
    ProgramRun: Permission.RUN_PROGRAM,
    ResetStop: Permission.RESET,
    SetMode: Permission.SET_MODE,
    SetAccount: Permission.MANAGE_USERS,
    Pairing: Permission.PAIR_GUESTS,
}
"""The permission that a request with a layout of its own needs."""

CHANGES = frozenset(
    {
        Permission.SET_OUTPUT,
        Permission.EDIT_PROGRAM,
        Permission.CHANGE_FRAMES,
        Permission.CHANGE_TOOLS,
        Permission.CHANGE_SCENE,
    }
)
"""What changes programs, frames, tools, scene or outputs: such an operation is noted when asked."""

_FROM_PENDANTS = frozenset(
    kind
    for kind in PENDANT_MESSAGES
    if kind.PLACE.direction in (Direction.TO_SERVER, Direction.BOTH)
)

IN_ORDER = frozenset(
    {
        Permission.MOVE,
        Permission.RUN_PROGRAM,
        Permission.RESET,
        Permission.SET_MODE,
        Permission.FORCE_AUTHORITY,
    }
)
"""What can move the robot or lets it move: asked in order and once."""

OVERTAKEN: Mapping[Permission, bool] = {
    Permission.OBSERVE: False,
    Permission.STOP: False,
    Permission.PAIR_GUESTS: False,
    Permission.MANAGE_USERS: False,
    Permission.PLAN: False,
    Permission.EDIT_PROGRAM: False,
    Permission.CHANGE_FRAMES: False,
    Permission.CHANGE_TOOLS: False,
    Permission.CHANGE_SCENE: False,
    Permission.MOVE: True,
    Permission.RUN_PROGRAM: True,
    Permission.RESET: True,
    Permission.SET_MODE: True,
    Permission.FORCE_AUTHORITY: True,
    Permission.SET_OUTPUT: True,
}
"""True for a permission whose requests are refused once a stop of their connection overtook them:
what can move, reset, grant authority, change the mode or an output would undo the stop."""

_ONLY_END = frozenset({MotionControlAction.PAUSE, MotionControlAction.PROGRAM_STOP})


def permission_of(message: Message) -> Permission | None:
    """Return the permission for a request; None where every connection with a hello may send it.

    Of a management request `needs_of` says it.
    """
    match message:
        case Authority(action=AuthorityAction.RELEASE):
            return None
        case Authority(action=AuthorityAction.FORCE):
            return Permission.FORCE_AUTHORITY
    if type(message) in FREE or type(message) not in _FROM_PENDANTS:
        return None  # the pendant endpoint refuses an unknown request of any role
    return OF_MESSAGE.get(type(message), Permission.MANAGE_USERS)


def needs_of(operation: str) -> Permission | None:
    """Return the permission for a management operation; that of the highest role if unknown."""
    declared = OPERATIONS.get(operation)
    return Permission.MANAGE_USERS if declared is None else declared.NEEDS


def is_overtaken(message: Message, operation: str = "") -> bool:
    """Return True if a request is refused because a STOP sent after it has acted already.

    A request that only ends something, such as a pause or a release of the authority, is executed
    in its turn; a request in no table is refused.

    Args:
        operation: the one that a management request names; empty for none.
    """
    match message:
        case Authority(action=AuthorityAction.RELEASE):
            return False
        case MotionControl(action=action) if action in _ONLY_END:
            return False
        case Management():
            declared = OPERATIONS.get(operation)
            if declared is None:
                return True
            if declared.OVERTAKEN is not None or declared.NEEDS is None:
                return bool(declared.OVERTAKEN)
            return OVERTAKEN[declared.NEEDS]
    if type(message) in FREE or type(message) not in _FROM_PENDANTS:
        return False
    needed = OF_MESSAGE.get(type(message))
    return needed is None or OVERTAKEN[needed]


class Basis(Enum):
    """Basis of a grant."""

    SINGLE_USER = "single user"
    ACCOUNT = "account"
    PAIRING = "pairing"


@dataclass(frozen=True, slots=True)
class Granted:
    """Grant of a connection."""

    session: int
    role: Role
    name: str
    basis: Basis


@dataclass(frozen=True, slots=True)
class GrantEnded:
    """A connection's grant ended without its doing: it may now do what anybody may."""

    session: int
    reason: str


@dataclass(slots=True)
class Visitor:
    """A connection that completed hello.

    Attributes:
        session: its number, never used again.
        ended: why its last grant ended; empty where none did.
        has_failed: a login or a pairing of it failed.
        looks_on: it may look on, and wants to be sent state.
        via: name of the gateway that stated its address; empty where it is the socket's.
    """

    session: int
    address: str
    client: str
    cell: str
    grant: Granted | None = None
    checking: bool = False
    ended: str = ""
    has_failed: bool = False
    looks_on: bool = False
    via: str = ""


Record = Callable[[AuditEntry], None]
"""Takes what is to be noted in the audit log; must not block."""


class Visitors:
    """The connections of one process."""

    def __init__(self, record: Record, *, observe_without_login: bool) -> None:
        self._record = record
        self._observe_without_login = observe_without_login
        self._visitors: dict[int, Visitor] = {}

    def __iter__(self) -> Iterator[Visitor]:
        return iter(self._visitors.values())

    def __len__(self) -> int:
        return len(self._visitors)

    def find(self, session: int) -> Visitor | None:
        """Return a connection; None where it has not completed hello, or is gone."""
        return self._visitors.get(session)

    def add(self, visitor: Visitor, now: int, **detail: Detail) -> None:
        """Take a connection that completed hello.

        Args:
            detail: what else is noted of its coming.
        """
        self._visitors[visitor.session] = visitor
        self.note(AuditEvent.CONNECTED, visitor, now, client=visitor.client, **detail)

    def remove(self, session: int, now: int) -> None:
        """Forget a connection and its grant."""
        visitor = self._visitors.pop(session, None)
        if visitor is not None:
            self.note(AuditEvent.DISCONNECTED, visitor, now)

    def may(self, session: int, permission: Permission) -> Refusal | None:
        """Return why a connection may not do something; None where it may."""
        visitor = self._visitors.get(session)
        if visitor is None:
            return Refusal(VerdictCode.HELLO_FIRST)
        if permission in WITHOUT_LOGIN:
            return None
        grant = visitor.grant
        if grant is not None and permission in PERMISSIONS_OF[grant.role]:
            return None
        needs = f"{permission.value} needs the role {LEAST_ROLE[permission].value}"
        if grant is None:
            if permission is Permission.OBSERVE and self.may_look_on(visitor.address):
                return None
            why = f": {visitor.ended}" if visitor.ended else ""
            return Refusal(VerdictCode.LOGIN_NEEDED, f"{needs}; this connection has none{why}")
        text = f"{needs}; {grant.name} is {grant.role.value}"
        return Refusal(VerdictCode.ROLE_TOO_LOW, text)

    def may_look_on(self, address: str) -> bool:
        """Return True if whoever comes from an address may look on without a login."""
        return self._observe_without_login or is_loopback(address)

    def end(self, visitor: Visitor, reason: str, now: int) -> GrantEnded:
        """Take back what a connection was granted."""
        self.note(AuditEvent.LOGOUT, visitor, now, reason=reason)
        visitor.grant = None
        visitor.ended = reason
        return GrantEnded(visitor.session, reason)

    def note(self, event: AuditEvent, visitor: Visitor, now: int, **detail: Detail) -> None:
        """Note what a connection did; of one without a login, what it calls itself."""
        grant = visitor.grant
        if grant is None:
            detail.setdefault("client", visitor.client)
        if visitor.via:
            detail.setdefault("via", visitor.via)
        entry = AuditEntry(
            event,
            now,
            who="" if grant is None else grant.name,
            role="" if grant is None else grant.role.value,
            source=visitor.address,
            session=visitor.session,
            cell=visitor.cell,
            detail=detail,
        )
        self._record(entry)


class RequestOrder:
    """The highest request id of each connection among the requests that can move the robot."""

    def __init__(self) -> None:
        self._highest: dict[int, int] = {}

    def take(self, session: int, request_id: int) -> Refusal | None:
        """Use up a request id, and all below it.

        Returns:
            Why the request is refused; None where its id is new. The id stays used up if the
            request is refused later for another reason.
        """
        highest = self._highest.get(session)
        if highest is not None and request_id <= highest:
            text = f"request {request_id} comes after request {highest} of this connection"
            return Refusal(
                VerdictCode.REQUEST_REPEATED, text, value=float(request_id), limit=float(highest)
            )
        self._highest[session] = request_id
        return None

    def forget(self, session: int) -> None:
        """Forget a connection that ended; its number is never given to another."""
        self._highest.pop(session, None)


class RequestGate:
    """Gate that each request of a cell's pendants passes before it is handled."""

    def __init__(self, visitors: Visitors) -> None:
        self._visitors = visitors
        self._order = RequestOrder()

    def refusal(self, session: int, message: Message, now: int) -> Refusal | None:
        """Return why a connection may not ask something, and note it; None where it may."""
        permission = permission_of(message)
        if permission is None:
            return None
        return self._examined(session, message, permission, permission in IN_ORDER, now)

    def operation_refusal(
        self, session: int, message: Message, operation: str, now: int
    ) -> Refusal | None:
        """Return `refusal` for a management request; `operation` is empty if it names none."""
        permission = needs_of(operation)
        if permission is None:
            return None
        is_in_order = operation in OPERATIONS and OPERATIONS[operation].IN_ORDER
        refusal = self._examined(session, message, permission, is_in_order, now)
        if refusal is None and permission in CHANGES:
            self._note(AuditEvent.CHANGE_ASKED, session, now, operation=operation)
        return refusal

    def is_let_in(self, session: int) -> bool:
        """Return True if a connection has logged in, or need not."""
        visitor = self._visitors.find(session)
        return visitor is None or visitor.grant is not None

    def unread(self, session: int, size: int, most: int, now: int) -> Refusal | None:
        """Return why a large body of a connection is not even read; None where it is.

        Args:
            size: of the body [bytes].
            most: that is read of a connection without a login [bytes].
        """
        visitor = self._visitors.find(session)
        if visitor is None or self.is_let_in(session):
            return None
        why = f": {visitor.ended}" if visitor.ended else ""
        text = f"the request has {size} bytes; accepted without a login: {most}{why}"
        refusal = Refusal(VerdictCode.LOGIN_NEEDED, text, value=float(size), limit=float(most))
        self._note(AuditEvent.REFUSED, session, now, wanted="large request", code=int(refusal.code))
        return refusal

    def _examined(
        self, session: int, message: Message, permission: Permission, is_in_order: bool, now: int
    ) -> Refusal | None:
        refusal = self._visitors.may(session, permission)
        if refusal is None and is_in_order:
            refusal = self._order.take(session, getattr(message, "request_id", 0))
        if refusal is not None:
            wanted, code = permission.value, int(refusal.code)
            self._note(AuditEvent.REFUSED, session, now, wanted=wanted, code=code)
        return refusal

    def turned_down(self, session: int, message: Message, refusal: Refusal, now: int) -> None:
        """Note that a request which could move the robot passed the gate and was refused later."""
        if permission_of(message) in IN_ORDER:
            self._note_refused(session, message, refusal, now)

    def without_authority(
        self, session: int, message: Management, operation: str, refusal: Refusal, now: int
    ) -> None:
        """Note that an operation passed the gate and was refused for want of the authority."""
        self._note_refused(session, message, refusal, now, operation)

    def overtaken(self, session: int, message: Message, operation: str, now: int) -> Refusal:
        """Return the refusal of a request that a STOP has overtaken; its id is used up.

        The STOP was sent after the request and acted before it: to execute the request now would
        undo the STOP.
        """
        if isinstance(message, Management):
            refusal = self.operation_refusal(session, message, operation, now)
            is_in_order = operation in OPERATIONS and OPERATIONS[operation].IN_ORDER
        else:
            refusal = self.refusal(session, message, now)
            is_in_order = permission_of(message) in IN_ORDER
        if refusal is None:
            refusal = Refusal(VerdictCode.OVERTAKEN_BY_STOP)
            if is_in_order:
                self._note_refused(session, message, refusal, now)
        return refusal

    def _note_refused(
        self, session: int, message: Message, refusal: Refusal, now: int, operation: str = ""
    ) -> None:
        about: dict[str, Detail] = {
            "wanted": operation or type(message).PLACE.name,
            "request": getattr(message, "request_id", 0),
            "code": int(refusal.code),
            "text": refusal.sentence,
        }
        self._note(AuditEvent.REFUSED, session, now, **about)

    def closed(self, session: int) -> None:
        """Forget a connection that ended."""
        self._order.forget(session)

    def _note(self, event: AuditEvent, session: int, now: int, **detail: Detail) -> None:
        visitor = self._visitors.find(session)
        if visitor is not None:
            self._visitors.note(event, visitor, now, **detail)
