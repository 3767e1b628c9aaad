"""Access requests of a cell's pendants: hello, login, pairing, sessions and accounts.

Owns the messages of it; the rules are those of `access`. A password is checked, and an account is
changed, elsewhere: the core asks for it by an `Ask`, and is told by an event.

Owns whom the server talks to at all (`Greeting`): the version, the cell and the rate of a hello.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import count

from openpendant.simplemsg.pendant import (
    IN_VERSION_2,
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    PROTOCOL_VERSIONS,
    AccountRole,
    Capability,
    Hello,
    HelloReply,
    LoginKind,
    Pairing,
    PairingAction,
    PairingReply,
    SetAccount,
    Subscribe,
)
from openpendant.simplemsg.pendant import Login as LoginRequest
from openpendant.simplemsg.pendant.management import access
from openpendant.simplemsg.pendant.management.cell import ServedCells
from openpendant.simplemsg.pendant.management.declaration import Done
from openpendant.simplemsg.pendant.roles import NOT_IN_VERSION_2, Permission, Role
from openpendant.simplemsg.verdicts import VerdictCode

from ...access.accounts import AccountAction, AccountBook, AccountChange
from ...access.admission import Admission
from ...access.audit import AuditEntry, AuditEvent, Detail
from ...access.gateways import NOT_FIRST, TWICE
from ...access.lockout import SECOND_NS
from ...access.pairing import Chooser
from ...access.passwords import Secret
from ...access.request_gate import Basis, Granted, Record, RequestGate
from ...control import Holder
from ...events.effects import Close, Effect, Send, WithdrawCheck
from ...events.management_requests import ReplyTo, handles
from ...events.pending import Pending
from ...events.replies import NAME_BYTES, claimed, cut, verdict
from ...kinematics.question_rates import QuestionRates
from ...refusal import Refusal
from ...settings.cell_settings import CellSettings
from .connection_requests import ConnectionRequests
from .lobby import CellLobby
from .notifications import Listener, Listeners

_ROLES = {
    AccountRole.VIEWER: Role.VIEWER,
    AccountRole.OPERATOR: Role.OPERATOR,
    AccountRole.PROGRAMMER: Role.PROGRAMMER,
    AccountRole.ADMIN: Role.ADMIN,
}


def _forget(entry: AuditEntry) -> None:
    """Take an entry where no log is kept."""


def _single_user() -> Admission:
    return Admission(AccountBook(), single_user_host=True, record=_forget)


@dataclass(frozen=True, slots=True)
class CoreAccess:
    """Accounts, sessions and audit of a core; without it everybody on this machine is its user.

    Attributes:
        record: takes what is to be noted in the audit log; must not block.
        chooser: where pairing codes come from.
        numbers: of changes of accounts.
        lobby: the cells that share all this.
        questions: how often connections of all cells may ask about kinematics.
    """

    login: Admission = field(default_factory=_single_user)
    record: Record = _forget
    chooser: Chooser = field(default_factory=random.SystemRandom)
    numbers: Iterator[int] = field(default_factory=partial(count, 1))
    lobby: CellLobby = field(default_factory=CellLobby)
    questions: QuestionRates = field(default_factory=QuestionRates)


Regranted = Callable[[int, int], list[Effect]]
"""Told that a session may do other things from now on, and the time [ns]."""

_Answer = Callable[[Refusal | None], list[Effect]]


class AccessRequests:
    """The identities of the pendants of one cell.

    Attributes:
        gate: what each of their requests passes first.
        connections: what admins ask of the connections of the whole server.
        lobby: the cells of the server.
    """

    def __init__(
        self,
        access: CoreAccess,
        identity: Identity,
        regranted: Regranted,
        pending: Pending,
        enabling_deadline: Callable[[int], float],
        *,
        has_tls: bool,
    ) -> None:
        """Know nobody yet.

        Args:
            regranted: called when what a session may do has changed.
            enabling_deadline: returns for how long the enabling device of a session may be silent
                [s].
            has_tls: the pendant port is encrypted.
        """
        self._login = access.login
        self._record = access.record
        self._chooser = access.chooser
        self._cell = identity.cell
        self._server = identity.server
        self._has_tls = has_tls
        self._regranted = regranted
        self._pending = pending
        self._enabling_deadline = enabling_deadline
        self.gate = RequestGate(access.login.visitors)
        self._numbers = access.numbers
        self.connections = ConnectionRequests(access.login, pending)
        self.lobby = access.lobby

    # Who is here.

    def welcomed(self, session: int, address: str, client: str, now: int) -> None:
        """Take a connection that completed hello."""
        self._login.welcomed(session, address, client, self._cell, now)

    def closed(self, session: int, now: int) -> list[Effect]:
        """Forget a connection; its password is checked no more where that was not begun."""
        self.gate.closed(session)
        waiting = self._login.closed(session, now)
        return [] if waiting is None else [WithdrawCheck(waiting)]

    def waits(self, session: int) -> bool:
        """Return True while the login of a connection waits for its answer."""
        return self._login.waits(session)

    def may(self, session: int, permission: Permission) -> bool:
        """Return True if a connection may do something."""
        return self._login.may(session, permission) is None

    def cells_for(self, session: int, address: str) -> ServedCells:
        """Return what a connection from an address is told of the server's cells."""
        return self.lobby.describe(self._login, session, address, self._server)

    def forward_refused(self, session: int, address: str, now: int) -> Refusal:
        """Count and note that a connection said for whom it speaks when that counts no more.

        Args:
            address: where it comes from.
        """
        place = self._login.places.find(session)
        forwarder = None if place is None else place.forwarder
        why = NOT_FIRST if forwarder is None else TWICE
        peer = address if forwarder is None else forwarder.peer
        return self._login.gateways.refuse(peer, why, now)

    def look_on_fault(self, session: int) -> Refusal | None:
        """Return why a connection may not look on."""
        return self._login.may(session, Permission.OBSERVE)

    def move_fault(self, session: int) -> Refusal | None:
        """Return why the role of a connection does not let it move the robot."""
        return self._login.may(session, Permission.MOVE)

    def wants_state(self, session: int, wants: bool) -> None:
        """Take note whether a connection that said hello wants to be sent state."""
        visitor = self._login.visitors.find(session)
        if visitor is not None:
            visitor.looks_on = wants and self.may(session, Permission.OBSERVE)

    def declared(
        self, session: int, language: str, enabling_deadline: float, notices: int, now: int
    ) -> None:
        """Note what a connection declared."""
        visitor = self._login.visitors.find(session)
        if visitor is None:
            return
        about: dict[str, Detail] = {
            "language": language,
            "enabling_deadline": round(enabling_deadline, 6),
            "notices": notices,
        }
        self._login.visitors.note(AuditEvent.DECLARED, visitor, now, **about)

    def name_of(self, session: int, client: str) -> str:
        """Return how others are shown a connection; a name that no login proved says so."""
        grant = self._login.grant_of(session)
        if grant is None:
            return client and claimed(client)
        return client if grant.basis is Basis.SINGLE_USER else grant.name

    # Logging in.

    def log_in(self, session: int, message: LoginRequest, now: int) -> list[Effect]:
        """Begin to log in by password, or pair at once."""
        request_id, secret = message.request_id, Secret(message.secret)
        match message.kind:
            case LoginKind.PASSWORD:
                job = self._login.try_password(session, message.name, secret, now)
                if isinstance(job, Refusal):
                    return [Send(session, verdict(request_id, job))]
                asked = partial(self._verified, job.job_id, session, request_id)
                return self._pending.ask(job, asked)
            case LoginKind.PAIRING:
                paired = self._login.pair(session, secret, message.name, now)
                return self._granted(session, request_id, paired, now)
        text = f"kind {message.kind}; accepted: 1 password, 2 pairing code"
        return [Send(session, verdict(request_id, Refusal(VerdictCode.BAD_ARGUMENT, text)))]

    def _verified(
        self, job_id: int, session: int, request_id: int, is_right: bool | None, now: int
    ) -> list[Effect]:
        """Take the outcome of a password check; None where it could not be made."""
        if is_right is None:
            outcome: Granted | Refusal = self._login.not_verified(job_id)
        else:
            outcome = self._login.verified(job_id, is_right, now)
        return self._granted(session, request_id, outcome, now)

    def _granted(
        self, session: int, request_id: int, outcome: Granted | Refusal, now: int
    ) -> list[Effect]:
        if isinstance(outcome, Refusal):
            return [Send(session, verdict(request_id, outcome))]
        # Whoever logs in as somebody else loses the authority first, as somebody else would.
        return [*self._regranted(session, now), Send(session, verdict(request_id))]

    # Pairing codes.

    def pairing(self, session: int, message: Pairing, now: int) -> list[Effect]:
        """Issue the cell's pairing code, or end it."""
        match message.action:
            case PairingAction.ISSUE:
                code = self._login.issue_pairing(session, now, self._chooser)
                if isinstance(code, Refusal):
                    return [Send(session, verdict(message.request_id, code))]
                lifetime = (code.expires - now) // SECOND_NS
                return [Send(session, PairingReply(message.request_id, lifetime, code.shown))]
            case PairingAction.WITHDRAW:
                ended = self._login.withdraw_pairing(session, now)
                if isinstance(ended, Refusal):
                    return [Send(session, verdict(message.request_id, ended))]
                out = [item for guest in ended for item in self._regranted(guest.session, now)]
                return [*out, Send(session, verdict(message.request_id))]
        text = f"action {message.action}; accepted: 1 issue, 2 withdraw"
        refusal = Refusal(VerdictCode.BAD_ARGUMENT, text)
        return [Send(session, verdict(message.request_id, refusal))]

    # Accounts.

    def set_account(self, session: int, message: SetAccount, now: int) -> list[Effect]:
        """Add an account, or give one another password."""

        def answer(refusal: Refusal | None) -> list[Effect]:
            return [Send(session, verdict(message.request_id, refusal))]

        if message.role not in {*_ROLES, AccountRole.AS_IT_IS}:
            text = f"role {message.role}; accepted: 0 for a new password, 1 to 4 for a new account"
            return answer(Refusal(VerdictCode.BAD_ARGUMENT, text))
        role = _ROLES.get(AccountRole(message.role))
        action = AccountAction.SET_PASSWORD if role is None else AccountAction.ADD
        return self._change(session, answer, action, message.name, role, Secret(message.secret))

    def _change(
        self,
        session: int,
        answer: _Answer,
        action: AccountAction,
        name: str,
        role: Role | None = None,
        password: Secret | None = None,
    ) -> list[Effect]:
        grant = self._login.grant_of(session)
        author = "" if grant is None else grant.name
        change = AccountChange(next(self._numbers), author, action, name, role, password)
        return self._pending.ask(change, partial(self._changed, change, session, answer))

    def _changed(
        self,
        change: AccountChange,
        session: int,
        answer: _Answer,
        refusal: Refusal | None,
        now: int,
    ) -> list[Effect]:
        """Take the outcome of a change; what follows from it for others is told by the book."""
        visitor = self._login.visitors.find(session)
        if refusal is None and visitor is not None:
            role = "" if change.role is None else change.role.value
            about = {"action": change.action.value, "account": change.name, "new_role": role}
            self._login.visitors.note(AuditEvent.ACCOUNT_CHANGED, visitor, now, **about)
        return answer(refusal)

    # Management requests.

    @handles(access.WhoAmI)
    def _who_am_i(
        self, asked: access.WhoAmI, reply: ReplyTo[access.WhoIAm], now: int
    ) -> list[Effect]:
        grant = self._login.grant_of(reply.session)
        return reply.answer(
            {
                "session": reply.session,
                "name": "" if grant is None else grant.name,
                "role": "" if grant is None else grant.role.value,
                "basis": "" if grant is None else grant.basis.value,
                "permissions": [
                    each.value
                    for each in Permission
                    if self.may(reply.session, each)
                    and (reply.version >= PROTOCOL_VERSION or each not in NOT_IN_VERSION_2)
                ],
            }
        )

    @handles(access.Logout)
    def _log_out(self, asked: access.Logout, reply: ReplyTo[Done], now: int) -> list[Effect]:
        ended = self._login.logout(reply.session, now)
        out = [] if ended is None else self._regranted(reply.session, now)
        return [*out, *reply.answer({})]

    @handles(access.ReadExposure)
    def _read_exposure(
        self, asked: access.ReadExposure, reply: ReplyTo[access.ServerExposure], now: int
    ) -> list[Effect]:
        return reply.answer({"logins_demanded": self._login.is_guarded, "tls": self._has_tls})

    @handles(access.ListSessions)
    def _list_sessions(
        self, asked: access.ListSessions, reply: ReplyTo[access.Sessions], now: int
    ) -> list[Effect]:
        sessions: list[access.Session] = [
            {
                "session": visitor.session,
                "client": visitor.client,
                "address": visitor.address,
                "name": "" if visitor.grant is None else visitor.grant.name,
                "role": "" if visitor.grant is None else visitor.grant.role.value,
                "enabling_deadline": round(self._enabling_deadline(visitor.session), 6),
            }
            for visitor in self._login.visitors
            if visitor.cell == self._cell
        ]
        return reply.answer({"sessions": sessions})

    @handles(access.ListUsers)
    def _list_users(
        self, asked: access.ListUsers, reply: ReplyTo[access.Users], now: int
    ) -> list[Effect]:
        accounts = sorted(self._login.accounts, key=lambda account: account.key)
        found: list[access.User] = [
            {"name": account.name, "role": account.role.value, "disabled": account.disabled}
            for account in accounts
        ]
        problems = self._login.accounts.unreadable
        unreadable: list[access.UnreadableUser] = [
            {"name": name, "problem": problems[name]} for name in sorted(problems)
        ]
        return reply.answer({"users": found, "unreadable": unreadable})

    @handles(access.RemoveUser)
    def _remove_user(
        self, asked: access.RemoveUser, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        return self._change_asked(reply, AccountAction.REMOVE, asked.name)

    @handles(access.SetUserRole)
    def _set_user_role(
        self, asked: access.SetUserRole, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        return self._change_asked(reply, AccountAction.SET_ROLE, asked.name, Role(asked.role))

    @handles(access.DisableUser)
    def _disable_user(
        self, asked: access.DisableUser, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        return self._change_asked(reply, AccountAction.DISABLE, asked.name)

    @handles(access.EnableUser)
    def _enable_user(
        self, asked: access.EnableUser, reply: ReplyTo[Done], now: int
    ) -> list[Effect]:
        return self._change_asked(reply, AccountAction.ENABLE, asked.name)

    def _change_asked(
        self, reply: ReplyTo[Done], action: AccountAction, name: str, role: Role | None = None
    ) -> list[Effect]:
        def answer(refusal: Refusal | None) -> list[Effect]:
            return reply.answer({}) if refusal is None else reply.refuse(refusal)

        return self._change(reply.session, answer, action, name, role)


ALWAYS = (
    Capability.JOINT_MOVE
    | Capability.POSE_MOVE
    | Capability.JOINT_PATH
    | Capability.POSE_PATH
    | Capability.SOFTWARE_STOP
    | Capability.JOG
    | Capability.MODES
    | Capability.PAUSE
    | Capability.PROGRAMS
    | Capability.LOGIN
    | Capability.NOTICES
    | Capability.PLANS
)
"""The rest needs an environment."""


_LEAST_RATE, _GREATEST_RATE = 1.0, 125.0


@dataclass(frozen=True, slots=True)
class Identity:
    """The description of this server in a hello.

    Attributes:
        server: name and version of the program.
        display: manufacturer and model of the robot.
    """

    cell: str
    robot: str
    server: str
    display: str = ""


class Greeting:
    """The hello of one cell: nothing of a connection is answered before it.

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
        """Offer what a cell has.

        Args:
            offers: to connections of the newest version.
        """
        self.offers = offers
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
        return [Send(session, self._reply(listener))]

    def _unwelcome(self, hello: Hello) -> Refusal | None:
        version = hello.protocol_version
        if version not in PROTOCOL_VERSIONS:
            spoken = " and ".join(map(str, PROTOCOL_VERSIONS))
            text = f"the server speaks versions {spoken}, not {version}"
            return Refusal(VerdictCode.VERSION, text, value=version, limit=PROTOCOL_VERSION)
        if hello.cell not in ("", self._identity.cell):
            text = f"no cell {hello.cell!r} here, only {self._identity.cell!r}"
            return Refusal(VerdictCode.UNKNOWN_CELL, text)
        return rate_fault(hello.state_rate)

    def _welcome(self, listener: Listener, hello: Hello, now: int) -> None:
        session = listener.session
        listener.welcomed = True
        listener.version = hello.protocol_version
        if listener.version < PROTOCOL_VERSION:
            self._listeners.older.add(session)
        listener.hello_name = cut(hello.client, NAME_BYTES)
        self._access.welcomed(session, listener.address, listener.hello_name, now)
        listener.holder = Holder(session, self._access.name_of(session, listener.hello_name))
        listener.looks_on = self._access.may(session, Permission.OBSERVE)
        self._listeners.set_rate(session, hello.state_rate, now)
        self._access.wants_state(session, hello.state_rate > 0)

    def _reply(self, listener: Listener) -> HelloReply:
        is_older = listener.version < PROTOCOL_VERSION
        return HelloReply(
            protocol_version=listener.version,
            session=listener.session,
            capabilities=self.offers & IN_VERSION_2 if is_older else self.offers,
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
        """Set how often a pendant is sent state."""
        refusal = rate_fault(message.state_rate)
        if refusal is None:
            self._listeners.set_rate(session, message.state_rate, now)
            self._access.wants_state(session, message.state_rate > 0)
        return refusal


def rate_fault(rate: float) -> Refusal | None:
    """Return why a wanted state rate [Hz] is refused; 0 means none."""
    if rate == 0 or _LEAST_RATE <= rate <= _GREATEST_RATE:
        return None
    text = f"a state rate of {rate:g} Hz; accepted: 0, or {_LEAST_RATE:g} to {_GREATEST_RATE:g}"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=rate, limit=_GREATEST_RATE)
