"""The rig of `byte_rig` with the accounts of `admission_desk`; passwords are checked at once.

Owns what happens to a connection that the server ends: as on a loop, it is told so when the test
lets a turn pass (`settle`).
"""

from rigs.cells.admission_desk import BOOK, Desk, is_right
from rigs.cells.byte_rig import ByteClient, ByteRig

from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.connection_loads import LoadQuestion
from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.events import Port
from openpendant.simplemsg import ByteOrder
from openpendant.simplemsg.pendant import Login, LoginKind, Verdict
from openpendant.simplemsg.verdicts import VerdictCode


class GuardedBytes(ByteRig):
    """A server with accounts, its connections and what each was told."""

    def __init__(
        self, *, checks_at_once: bool = True, desk: Desk | None = None, **listen: int
    ) -> None:
        self.desk = desk or Desk(BOOK)
        self.checks_at_once = checks_at_once
        self.connected: list[ByteClient] = []
        super().__init__(self.desk.login, listen=listen)
        self.desk.login.places.most = self.settings.listen.max_connections

    def come(self, address: str, port: Port = Port.PENDANT) -> ByteClient:
        """Have a connection come."""
        client = self.client(port, ByteOrder.LITTLE, address)
        self.connected.append(client)
        return client

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        super().perform(outgoing)
        for item in outgoing:
            match item:
                case Ask(question=VerifyJob()) if self.checks_at_once:
                    assert isinstance(item.question, VerifyJob)
                    self.answered(item, is_right(item.question))
                case Ask(question=LoadQuestion()):
                    assert isinstance(item.question, LoadQuestion)
                    self.answered(item, self.clients.loads(item.question))
        return outgoing

    def log_in(self, client: ByteClient, name: str) -> VerdictCode:
        """Log in with the right password; return the code of the verdict."""
        client.heard()
        client.tell(Login(900, LoginKind.PASSWORD, name, f"{name}'s password"))
        (told,) = [each for each in client.heard() if isinstance(each, Verdict)]
        return VerdictCode(told.code)

    def settle(self) -> None:
        """Let the loop tell of connections that were ended."""
        for client in list(self.connected):
            if client.transport.is_over:
                self.connected.remove(client)
                client.shell.connection_lost(None)

    def check_deadlines(self, seconds: float = 0.0) -> None:
        """Let time pass, and have the server look for what is overdue."""
        self.now += round(seconds * 1e9)
        self.inbox.check_deadlines(self.now)
