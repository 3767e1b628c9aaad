"""Admission: how a connection earns a role, what it was granted, and when it loses it.

Owns login, pairing and the single user (promises 28 and 29). The core never hashes: `try_password`
returns a job for the password worker, and its outcome comes back as one more event. `roles` owns
what a role allows, `request_gate` who is connected and with which grant, `lockout` how often
somebody may guess.

A server without accounts that listens on loopback only has a single user: every local connection is
admin, under the name of its hello. On any other server a connection that has not logged in may send
STOP and, from the machine itself, observe.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from openpendant.simplemsg.pendant.roles import Permission, Role
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .accounts import Account, AccountBook, account_key, name_fault
from .audit import AuditEvent, Detail
from .exposure import is_loopback
from .gateways import Gateways
from .lockout import SECOND_NS, Charge, Lockout
from .pairing import Chooser, PairingCode, PairingCodes
from .passwords import NOBODYS_HASH, PasswordHash, Secret
from .places import ConnectionPlaces
from .request_gate import Basis, Granted, GrantEnded, Record, Visitor, Visitors

GUEST_ROLE = Role.OPERATOR


@dataclass(frozen=True, slots=True)
class VerifyJob:
    """A password to be checked by the password worker.

    What decides whose turn it is stands in no journal: only the outcome is repeated from there. Nor
    does the name, which may be a password in the wrong field.

    Attributes:
        source: address that asks, as `lockout.source_of` says.
        account: key of the account, whether there is one or not.
        has_failed: an attempt at this account failed from there, and none succeeded since.
    """

    job_id: int
    session: int
    password: Secret
    kept: PasswordHash = field(repr=False)
    source: str = field(repr=False)
    account: str = field(repr=False)
    has_failed: bool = field(repr=False)


@dataclass(frozen=True, slots=True)
class _Check:
    """A password check under way; it is settled even if its connection is gone."""

    visitor: Visitor
    account: Account | None
    charge: Charge


class Admission:
    """Login state of the connections of one process.

    Attributes:
        single_user_host: without accounts, a connection from this machine is admin.
        places: the connections, and which of them has a place as what.
        gateways: whose word on the address of a connection is believed.
    """

    def __init__(
        self,
        book: AccountBook,
        *,
        single_user_host: bool,
        record: Record,
        observe_without_login: bool = False,
        pairing: PairingCodes | None = None,
        max_connections: int = 256,
        gateways: Gateways | None = None,
    ) -> None:
        """Admit nobody yet.

        Args:
            single_user_host: the server listens on loopback addresses only.
            observe_without_login: whoever reaches the server may look on.
            gateways: none is believed where left out.
        """
        self.visitors = Visitors(record, observe_without_login=observe_without_login)
        self.gateways = gateways or Gateways((), record)
        self.places = ConnectionPlaces(self.visitors, max_connections, self.gateways)
        self._book = book
        self.single_user_host = single_user_host
        self._lockout = Lockout()
        # Apart, so that neither kind of guess makes the other forgotten.
        self._pairing_lockout = Lockout()
        self._pairing = pairing or PairingCodes()
        self._checks: dict[int, _Check] = {}
        self._next_job = 1

    @property
    def accounts(self) -> AccountBook:
        """The accounts as they are now."""
        return self._book

    @property
    def is_guarded(self) -> bool:
        """True where whoever would move the robot has to log in."""
        return not (self._book.is_empty and self.single_user_host)

    def needs_login(self, address: str) -> bool:
        """Return True if whoever comes from an address has to log in to move a robot."""
        return self.is_guarded or not is_loopback(address)

    def welcomed(
        self, session: int, address: str, client: str, cell: str, now: int
    ) -> Granted | None:
        """Take a connection that completed hello; return what it is granted without a login."""
        visitor = Visitor(session, address, client, cell)
        place = self.places.find(session)
        forwarder = None if place is None else place.forwarder
        about: dict[str, Detail] = {}
        if forwarder is not None:
            visitor.via = forwarder.gateway
            about["encrypted"] = forwarder.is_encrypted
        if not self.needs_login(address):
            name = client or f"session {session}"
            visitor.grant = Granted(session, Role.ADMIN, name, Basis.SINGLE_USER)
        self.visitors.add(visitor, now, **about)
        return visitor.grant

    def closed(self, session: int, now: int) -> int | None:
        """Forget a connection.

        Returns:
            The job of the password check that it waits for, which may be withdrawn; None for none.
            Where it was begun already, its outcome counts all the same.
        """
        visitor = self.visitors.find(session)
        self.visitors.remove(session, now)
        if visitor is None or not visitor.checking:
            return None
        return next(job for job, check in self._checks.items() if check.visitor is visitor)

    def waits(self, session: int) -> bool:
        """Return True while a password of a connection waits for its turn or is checked."""
        visitor = self.visitors.find(session)
        return visitor is not None and visitor.checking

    def may(self, session: int, permission: Permission) -> Refusal | None:
        """Return why a connection may not do something; None where it may."""
        return self.visitors.may(session, permission)

    def grant_of(self, session: int) -> Granted | None:
        """Return what a connection was granted; None for nothing."""
        visitor = self.visitors.find(session)
        return None if visitor is None else visitor.grant

    def try_password(
        self, session: int, name: str, password: Secret, now: int
    ) -> VerifyJob | Refusal:
        """Start a login.

        A name without an account takes the same time and gets the same answer, so that nobody
        learns which names exist.

        Returns:
            The job for the password worker, whose outcome goes to `verified` or `not_verified`.
        """
        visitor = self.visitors.find(session)
        if visitor is None:
            return Refusal(VerdictCode.HELLO_FIRST)
        if visitor.checking:
            text = "this connection's last password is being checked"
            return Refusal(VerdictCode.LOGIN_BUSY, text)
        account = self._book.find(name)
        charge = self._charge(self._lockout, visitor, account_key(name), account, now)
        if isinstance(charge, Refusal):
            return charge
        visitor.checking = True
        job_id = self._next_job
        self._next_job += 1
        self._checks[job_id] = _Check(visitor, account, charge)
        kept = NOBODYS_HASH if account is None else account.password
        queued = charge.source, charge.account, charge.has_failed
        return VerifyJob(job_id, session, password, kept, *queued)

    def verified(self, job_id: int, is_right: bool, now: int) -> Granted | Refusal:
        """Take the outcome of a password check; a second one of the same job counts for nothing."""
        check = self._checks.pop(job_id, None)
        if check is None:
            return Refusal(VerdictCode.LOGIN_FAILED)
        visitor, account = check.visitor, check.account
        visitor.checking = False
        # The account may have been changed, disabled or removed during the check of the password.
        is_current = account is not None and self._book.find(account.name) == account
        if account is None or account.disabled or not (is_right and is_current):
            self._lockout.failed(check.charge)
            visitor.has_failed = True
            self._note_failure(visitor, account, now)
            return Refusal(VerdictCode.LOGIN_FAILED)
        self._lockout.succeeded(check.charge)
        if self.visitors.find(visitor.session) is not visitor:
            return Refusal(VerdictCode.LOGIN_FAILED, "the connection ended meanwhile")
        granted = Granted(visitor.session, account.role, account.name, Basis.ACCOUNT)
        full = self._room_refusal(visitor, granted, now)
        if full is not None:
            return full
        visitor.grant = granted
        self.visitors.note(AuditEvent.LOGIN, visitor, now, client=visitor.client)
        return visitor.grant

    def not_verified(self, job_id: int) -> Refusal:
        """Take back a password check that the worker could not make; it counts as no attempt."""
        check = self._checks.pop(job_id, None)
        if check is not None:
            check.visitor.checking = False
            self._lockout.withdrawn(check.charge)
        return Refusal(VerdictCode.LOGIN_BUSY)

    def logout(self, session: int, now: int) -> GrantEnded | None:
        """End a connection's grant at its own request; None where there is none to end."""
        visitor = self.visitors.find(session)
        if visitor is None or visitor.grant is None or visitor.grant.basis is Basis.SINGLE_USER:
            return None
        return self.visitors.end(visitor, "logged out", now)

    def accounts_changed(self, book: AccountBook, now: int) -> list[Granted | GrantEnded]:
        """Take another set of accounts; return what that changes for connections.

        A connection is logged out if its account was removed, disabled or given another password,
        and takes on a changed role at once. The first account ends the grant of the single user.
        """
        before, self._book = self._book, book
        changes = [self._follow(visitor, before, now) for visitor in self.visitors]
        return [change for change in changes if change is not None]

    def _follow(
        self, visitor: Visitor, before: AccountBook, now: int
    ) -> Granted | GrantEnded | None:
        grant = visitor.grant
        if grant is None or grant.basis is Basis.PAIRING:
            return None
        if grant.basis is Basis.SINGLE_USER:
            if self._book.is_empty:
                return None
            return self.visitors.end(visitor, "there are accounts now; log in", now)
        old, new = before.find(grant.name), self._book.find(grant.name)
        if new is None or new.disabled or old is None or new.password != old.password:
            return self.visitors.end(visitor, "the account was changed; log in again", now)
        if new.role is grant.role:
            return None
        visitor.grant = Granted(visitor.session, new.role, new.name, Basis.ACCOUNT)
        self.visitors.note(AuditEvent.ROLE_CHANGED, visitor, now, before=grant.role.value)
        return visitor.grant

    def issue_pairing(self, session: int, now: int, chooser: Chooser) -> PairingCode | Refusal:
        """Make a pairing code for the cell of the connection that asks."""
        visitor = self._teacher(session)
        if isinstance(visitor, Refusal):
            return visitor
        code = self._pairing.issue(visitor.cell, _name_of(visitor), now, chooser)
        minutes = (code.expires - now) / (60 * SECOND_NS)
        self.visitors.note(AuditEvent.PAIRING_ISSUED, visitor, now, minutes=minutes)
        return code

    def withdraw_pairing(self, session: int, now: int) -> list[GrantEnded] | Refusal:
        """End the code of the connection's cell, and what the cell's guests were granted."""
        teacher = self._teacher(session)
        if isinstance(teacher, Refusal):
            return teacher
        self._pairing.withdraw(teacher.cell)
        self.visitors.note(AuditEvent.PAIRING_WITHDRAWN, teacher, now)
        return [
            self.visitors.end(visitor, "the lesson is over", now)
            for visitor in self.visitors
            if visitor.cell == teacher.cell
            and visitor.grant is not None
            and visitor.grant.basis is Basis.PAIRING
        ]

    def _teacher(self, session: int) -> Visitor | Refusal:
        visitor = self.visitors.find(session)
        refusal = self.may(session, Permission.PAIR_GUESTS)
        return refusal or visitor or Refusal(VerdictCode.HELLO_FIRST)

    def pair(self, session: int, code: Secret, name: str, now: int) -> Granted | Refusal:
        """Make a connection a guest of its cell."""
        visitor = self.visitors.find(session)
        if visitor is None:
            return Refusal(VerdictCode.HELLO_FIRST)
        fault = name_fault(name)
        if fault is not None:
            return fault
        # One key for all codes: five wrong ones lock pairing at an address, and nothing else.
        charge = self._charge(self._pairing_lockout, visitor, "", None, now)
        if isinstance(charge, Refusal):
            return charge
        found = self._pairing.redeem(code, now)
        if found is None or found.cell != visitor.cell:
            self._pairing_lockout.failed(charge)
            visitor.has_failed = True
            self.visitors.note(AuditEvent.LOGIN_FAILED, visitor, now, by="pairing")
            return Refusal(VerdictCode.PAIRING_WRONG)
        self._pairing_lockout.succeeded(charge)
        if self._is_taken(name, visitor):
            return Refusal(VerdictCode.NAME_TAKEN, f"somebody is called {name!r} already")
        granted = Granted(session, GUEST_ROLE, name, Basis.PAIRING)
        full = self._room_refusal(visitor, granted, now)
        if full is not None:
            return full
        visitor.grant = granted
        self.visitors.note(AuditEvent.PAIRED, visitor, now, issuer=found.issuer)
        return visitor.grant

    def _room_refusal(self, visitor: Visitor, granted: Granted, now: int) -> Refusal | None:
        """Return why there is no place for who proved who he is; he stays who he was."""
        full = self.places.login_refusal(visitor.session, granted)
        if full is not None:
            about: dict[str, Detail] = {"wanted": "login", "account": granted.name}
            self.visitors.note(AuditEvent.REFUSED, visitor, now, **about, code=int(full.code))
        return full

    def _is_taken(self, name: str, visitor: Visitor) -> bool:
        """Return True if an account, or another connection, has this name."""
        key = account_key(name)
        return self._book.find(name) is not None or any(
            account_key(other.grant.name) == key
            for other in self.visitors
            if other is not visitor and other.grant is not None
        )

    def _charge(
        self, lockout: Lockout, visitor: Visitor, key: str, account: Account | None, now: int
    ) -> Charge | Refusal:
        charge = lockout.attempt(visitor.address, key, now)
        if isinstance(charge, Charge):
            return charge
        # Rounded up: who comes again when told is not sent away once more.
        seconds = math.ceil(charge / (SECOND_NS / 10)) / 10
        target = "" if account is None else account.name
        self.visitors.note(AuditEvent.LOCKED_OUT, visitor, now, seconds=seconds, account=target)
        text = f"too many wrong attempts; the next one is taken in {math.ceil(seconds)} s"
        return Refusal(VerdictCode.LOCKED_OUT, text, value=seconds)

    def _note_failure(self, visitor: Visitor, account: Account | None, now: int) -> None:
        # An unknown name is not logged: it may be a password typed into the wrong field.
        target = "" if account is None else account.name
        is_known = account is not None
        self.visitors.note(AuditEvent.LOGIN_FAILED, visitor, now, account=target, known=is_known)


def _name_of(visitor: Visitor) -> str:
    return "" if visitor.grant is None else visitor.grant.name
