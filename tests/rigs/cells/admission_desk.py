"""A login with three accounts, cheap password checks and a list for a log, for tests of access."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from openpendant.server.access.accounts import Account, AccountBook
from openpendant.server.access.admission import Admission, VerifyJob
from openpendant.server.access.audit import AuditEntry
from openpendant.server.access.gateways import Gateway, Gateways
from openpendant.server.access.pairing import PairingCodes
from openpendant.server.access.passwords import PasswordHash, Secret
from openpendant.server.access.request_gate import Granted
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.roles import Role

SECOND = 1_000_000_000
START = 1_000 * SECOND

LAN = "192.0.2.10"
LOCAL = "127.0.0.1"
CELL = "cell"


def fake_hash(password: str) -> PasswordHash:
    """Return a "hash" that costs nothing: the password itself, padded."""
    return PasswordHash(salt="ab" * 16, digest=password.encode().hex().ljust(64, "0"))


def account(name: str, role: Role, *, disabled: bool = False) -> Account:
    """Return an account whose password is `NAME's password`."""
    return Account(
        name=name, role=role, password=fake_hash(f"{name}'s password"), disabled=disabled
    )


BOOK = AccountBook(
    [
        account("ann", Role.ADMIN),
        account("otto", Role.OPERATOR),
        account("vera", Role.VIEWER),
        account("gone", Role.ADMIN, disabled=True),
    ]
)


@dataclass
class Desk:
    """A login and everything that it noted."""

    book: AccountBook = field(default_factory=lambda: BOOK)
    single_user_host: bool = False
    observe_without_login: bool = False
    gateways: Sequence[Gateway] = ()
    log: list[AuditEntry] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.login = Admission(
            self.book,
            single_user_host=self.single_user_host,
            observe_without_login=self.observe_without_login,
            record=self.log.append,
            pairing=PairingCodes(),
            gateways=Gateways(self.gateways, self.log.append),
        )

    def arrive(self, session: int, address: str = LAN, cell: str = CELL) -> Granted | None:
        """Have a connection complete its hello."""
        return self.login.welcomed(session, address, f"app {session}", cell, START)

    def attempt(
        self, session: int, name: str, password: str, now: int = START
    ) -> Granted | Refusal:
        """Log in, with the worker's answer at once."""
        job = self.login.try_password(session, name, Secret(password), now)
        if isinstance(job, Refusal):
            return job
        return self.login.verified(job.job_id, is_right(job), now)

    def log_in(self, session: int, name: str, now: int = START) -> Granted:
        granted = self.attempt(session, name, f"{name}'s password", now)
        assert isinstance(granted, Granted)
        return granted


def is_right(job: VerifyJob) -> bool:
    """Check a password as `fake_hash` keeps it."""
    return fake_hash(job.password.reveal()) == job.kept
