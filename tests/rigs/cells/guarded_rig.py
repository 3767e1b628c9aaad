"""A pendant server on a hand-driven clock whose pendants have to log in, for tests of access."""

import random

from rigs.cells.admission_desk import BOOK, LAN, Desk, is_right
from rigs.cells.server_rig import IDENTITY, LIMITS, NoTool, ServerRig
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.audit import AuditEvent
from openpendant.server.core.cell_core import CellCore
from openpendant.server.endpoints.pendant.access_requests import CoreAccess
from openpendant.server.events.effects import Ask, Backend, Effect, WithdrawCheck
from openpendant.server.events.events import Port, Regranted
from openpendant.simplemsg.pendant import Login, LoginKind
from openpendant.simplemsg.verdicts import VerdictCode


class GuardedRig(ServerRig):
    """The rig of `server_rig` with the accounts of `admission_desk`; passwords cost nothing."""

    def __init__(self, book: AccountBook = BOOK) -> None:
        super().__init__()
        self.desk = Desk(book)
        self.changes: list[Ask] = []
        self.checks_at_once = True
        self.checks: list[Ask] = []
        access = CoreAccess(self.desk.login, self.desk.log.append, random.Random(1))
        self.core = CellCore(self.settings, LIMITS, IDENTITY, NoTool(), access=access)
        self.connect_controller()

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        super().perform(outgoing)
        for item in outgoing:
            match item:
                case Ask(backend=Backend.PASSWORDS):
                    self.checks.append(item)
                case Ask(backend=Backend.ACCOUNTS):
                    self.changes.append(item)
                case WithdrawCheck(id=number):
                    for asked in [each for each in self.checks if each.id == number]:
                        self.checks.remove(asked)
                        self.answered(asked, None)
        if self.checks_at_once:
            self.answer_checks()
        return outgoing

    def answer_checks(self) -> None:
        while self.checks:
            asked = self.checks.pop(0)
            assert isinstance(asked.question, VerifyJob)
            self.answered(asked, is_right(asked.question))

    def follow(self, book: AccountBook) -> None:
        for change in self.desk.login.accounts_changed(book, self.now):
            self.perform(self.core.handle(Regranted(change.session), self.now))

    def visitor(self, address: str = LAN, state_rate: float = 0.0) -> Pendant:
        pendant = self.stranger(Port.PENDANT, address)
        pendant.hello("an app", state_rate)
        pendant.got.clear()
        return pendant

    def user(self, name: str) -> Pendant:
        pendant = self.visitor()
        assert log_in(pendant, name) is VerdictCode.ACCEPTED
        pendant.got.clear()
        return pendant

    def noted(self, event: AuditEvent) -> list[str]:
        return [entry.who for entry in self.desk.log if entry.event is event]


def log_in(pendant: Pendant, name: str, password: str | None = None) -> VerdictCode | None:
    """Log in with the right password or another, and return the code of the verdict."""
    secret = f"{name}'s password" if password is None else password
    return pendant.code(Login(900, LoginKind.PASSWORD, name, secret))
