"""A cell on a hand-driven clock with pendants of every role, for management requests as bytes.

Nothing differs from run to run: passwords cost nothing, the store has a clock of its own.
"""

from collections.abc import Mapping
from typing import Any

from frozen.body_file import Answer, Happening, Step
from rigs.cells.admission_desk import LAN, account, is_right
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.guarded_rig import log_in
from rigs.peers.server_clients import Pendant

from openpendant.server.access.accounts import (
    AccountBook,
    AccountChange,
    AccountRefused,
    StoredAccounts,
    make_change,
)
from openpendant.server.access.admission import Admission, VerifyJob
from openpendant.server.access.audit import AuditEntry
from openpendant.server.endpoints.pendant.access_requests import CoreAccess
from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.events import Port, Regranted
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import PENDANT, ByteOrder, ReplyCode, codec_for
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, Management
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

VISITOR = "visitor"
"""Has said hello and not logged in; the others have the role that they are called after."""

_CODEC = codec_for(PENDANT, ByteOrder.LITTLE, 4)
_MOST_MS = 5_000
_STEP_MS = 10


class AskedCell(EmulatedCell):
    """One cell with everything in it, and an account for each role."""

    def __init__(self) -> None:
        accounts = [account(role.value, role) for role in Role]
        login = Admission(AccountBook(accounts), single_user_host=False, record=_forget)
        self.login = login
        super().__init__(
            has_surroundings=True,
            access=CoreAccess(login, _forget),
            controller={"signals": "openpendant"},
        )
        self.accounts = StoredAccounts(self.store, "the start")
        for each in reversed(accounts):  # the first has to be an admin
            self.accounts.add(each)
        self.holder_of_control: Pendant | None = None
        self.pendants = {VISITOR: self._visitor()}
        for role in Role:
            pendant = self.pendants[role.value] = self._visitor()
            assert log_in(pendant, role.value) is VerdictCode.ACCEPTED
        self.wait(100)

    def _visitor(self) -> Pendant:
        pendant = self.stranger(Port.PENDANT, LAN)
        pendant.hello("an app")
        return pendant

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        super().perform(outgoing)
        for item in outgoing:
            match item:
                case Ask(question=VerifyJob() as job):
                    self.answered(item, is_right(job))
                case Ask(question=AccountChange() as change):
                    self._change(item, change)
        return outgoing

    def _change(self, asked: Ask, change: AccountChange) -> None:
        refusal: Refusal | None = None
        try:
            make_change(self.accounts, change, None)
        except AccountRefused as error:
            refusal = error.refusal
        for each in self.login.accounts_changed(self.accounts.book(), self.now):
            self.perform(self.core.handle(Regranted(each.session), self.now))
        self.answered(asked, refusal)

    def ask(self, who: str, body: bytes) -> tuple[bool, bytes]:
        """Make a request; return whether it was carried out, and the body of the answer."""
        pendant = self.pendants[who]
        request = Management(pendant._next(), body)
        assert _CODEC.decode(_CODEC.encode(request)) == request
        before = len(pendant.got)
        pendant.send(request)
        for _ in range(0, _MOST_MS, _STEP_MS):
            for answer in pendant.got[before:]:
                if isinstance(answer, Management) and answer.request_id == request.request_id:
                    return answer.reply_code == ReplyCode.SUCCESS, answer.body
            self.pass_time(_STEP_MS)
        raise AssertionError(f"no answer to {body[:100]!r}")

    def make(self, step: Step) -> Answer | None:
        if isinstance(step, Happening):
            self.do(step.what)
            return None
        done, body = self.ask(step.by, step.bytes)
        return Answer(done, body.decode())

    def do(self, what: Mapping[str, Any]) -> None:
        """Have something happen between requests.

        Args:
            what: one of `take`: who takes the control; `move`: how far each joint is moved [rad];
                `wait`: how long time passes [ms].
        """
        match what:
            case {"take": who}:
                self.holder_of_control = self.pendants[who]
                assert self.holder_of_control.take() is VerdictCode.ACCEPTED
            case {"move": by}:
                assert self.holder_of_control is not None
                goal = [at + each for at, each in zip(self.position, by, strict=True)]
                assert self.holder_of_control.move(*goal) is VerdictCode.ACCEPTED
                while self.core.cell.activity is not Activity.IDLE:
                    self.pass_time(_STEP_MS)
            case {"wait": milliseconds}:
                self.pass_time(milliseconds)
            case _:
                raise AssertionError(f"{what} is not known here")

    def pass_time(self, milliseconds: int) -> None:
        """Let time pass; who has the control keeps it."""
        for _ in range(0, milliseconds, _STEP_MS):
            if self.holder_of_control is not None and self.now % 500_000_000 == 0:
                self.holder_of_control.send(AuthorityBeat())
            self.wait(_STEP_MS)


def _forget(entry: AuditEntry) -> None:
    """Keep no log."""
