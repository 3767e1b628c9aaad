"""Management requests to record with their answers: their file, the cell that is asked, new ones.

The file has one JSON object a line:

    {"cell": "frames", "do": {"wait": 100}}
    {"cell": "frames", "id": "frames.show: right", "by": "viewer", "body": "…", "done": true,
     "answer": "…"}

All lines of a cell are made in one, in an order in which each right request has something to work
on. A new one is a line more, without an answer. A body is its text; a list of texts, each with how
often it is repeated where it is; or `hex` where it is no text. In front of the right request of an
operation stand the same with a key too many, without a key, with values of another type or out of
bounds, and from a role that may not; none of them changes anything. Those that the file has not are
made up here.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from frozen.frozen_files import SCHEMAS
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
from openpendant.server.access.connection_loads import ConnectionLoad
from openpendant.server.endpoints.pendant.access_requests import CoreAccess
from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.events import Port, Regranted
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import PENDANT, ByteOrder, ReplyCode, codec_for
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, Management
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

Body: TypeAlias = str | list[str | list[Any]] | dict[str, str]


@dataclass(frozen=True)
class Question:
    name: str
    by: str
    body: Body

    @property
    def bytes(self) -> bytes:
        match self.body:
            case str():
                return self.body.encode()
            case dict():
                return bytes.fromhex(self.body["hex"])
        return "".join(
            each if isinstance(each, str) else each[0] * each[1] for each in self.body
        ).encode()


@dataclass(frozen=True)
class Happening:
    """What happens between requests; see `AskedCell.do`."""

    what: Mapping[str, Any]


@dataclass(frozen=True)
class Answer:
    done: bool
    text: str


Step: TypeAlias = Question | Happening


def line_of(cell: str, step: Step, answer: Answer | None) -> str:
    if isinstance(step, Happening):
        return json.dumps({"cell": cell, "do": step.what})
    assert answer is not None
    about = {"cell": cell, "id": step.name, "by": step.by, "body": step.body}
    return json.dumps({**about, "done": answer.done, "answer": answer.text}, ensure_ascii=False)


def read_steps(file: Path) -> Iterator[tuple[str, Step, Answer | None]]:
    for line in file.read_text("utf-8").splitlines():
        read = json.loads(line)
        if "do" in read:
            yield read["cell"], Happening(read["do"]), None
        else:
            question = Question(read["id"], read["by"], read["body"])
            answer = Answer(read["done"], read["answer"]) if "done" in read else None
            yield read["cell"], question, answer


VISITOR = "visitor"
"""Has said hello and not logged in; the others have the role that they are called after."""

_CODEC = codec_for(PENDANT, ByteOrder.LITTLE, 4)
_MOST_MS = 5_000
_STEP_MS = 10


class AskedCell(EmulatedCell):
    """One cell with everything in it, an account for each role, and pendants of each.

    Nothing differs from run to run: passwords cost nothing, the store has a clock of its own.
    """

    def __init__(self) -> None:
        accounts = [account(role.value, role) for role in Role]
        login = Admission(AccountBook(accounts), single_user_host=False, record=_forget)
        self.login = login
        super().__init__(
            has_surroundings=True,
            access=CoreAccess(login, _forget),
            controller={"signals": "openpendant"},
        )
        assert self.core.environment is not None
        # Which there are depends on what is installed.
        self.core.environment.service.planners = ("RRTConnect", "BuiltInRRTConnect")
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
        self.login.places.opened(pendant.session, LAN, self.now, is_pendant=True, by_standing=True)
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

    def load(self) -> ConnectionLoad:
        return ConnectionLoad(frames=4, received=256, cost_ns=500_000)

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


ROLES = (VISITOR, "viewer", "operator", "programmer", "admin")
RIGHT = ": right"
"""Ends the name of the right request of an operation."""


def steps(file: Path) -> Iterator[tuple[str, Step]]:
    """Yield all steps of a file and what it lacks, with the name of the cell of each."""
    listed = list(read_steps(file))
    known = {step.name for _, step, _ in listed if isinstance(step, Question)}
    for cell, step, _ in listed:
        if isinstance(step, Question) and step.name.endswith(RIGHT):
            yield from ((cell, each) for each in wrong(step) if each.name not in known)
        yield cell, step


def wrong(right: Question) -> Iterator[Question]:
    """Yield what can be wrong with a right request, by the schema of its operation."""
    fields = json.loads(right.bytes)
    op = fields["op"]

    def question(label: str, body: Mapping[str, Any], by: str = right.by) -> Question:
        text = json.dumps(body, ensure_ascii=False, separators=(",", ":"))
        return Question(f"{op}: {label}", by, text)

    below = _below(op)
    if below is not None:
        yield question(f"by who is {below}", fields, below)
    yield question("a key too many", {**fields, "colour": "red"})
    schema = json.loads((SCHEMAS / f"{op}-request.json").read_text("utf-8"))
    for key in schema.get("required", []):
        if key != "op":
            yield question(f"without {key}", {k: v for k, v in fields.items() if k != key})
    for key, about in schema["properties"].items():
        if key == "op":
            continue
        if key in fields:
            yield question(f"{key} of another type", {**fields, key: _other(about)})
        for value in _beyond(about):
            yield question(f"{key} of {value}", {**fields, key: value})


def _below(op: str) -> str | None:
    """Return the highest role that may not ask for an operation; None where there is none."""
    # Here, because it loads all of the server.
    from openpendant.tools.reference.operations import published_operations

    role = published_operations()[op].role
    return None if role is None else ROLES[ROLES.index(role.value) - 1]


def _other(about: Mapping[str, Any]) -> Any:
    """Return a value of none of the types that a field has."""
    types = {each.get("type", "object") for each in about.get("anyOf", [about])}
    if "string" in types or "integer" in types:
        return [] if "integer" not in types else "seven"
    return "seven" if types & {"number", "boolean"} else 7


def _beyond(about: Mapping[str, Any]) -> Iterator[Any]:
    """Yield values just beyond the bounds of a field."""
    for each in about.get("anyOf", [about]):
        step = 1 if each.get("type") == "integer" else 0.001
        if "minimum" in each:
            yield each["minimum"] - step
        if "maximum" in each:
            yield each["maximum"] + step
        if "maxItems" in each and each["maxItems"] <= 20:
            items: Mapping[str, Any] = each["items"]
            yield [[0.0] * items.get("minItems", 6)] * (each["maxItems"] + 1)
