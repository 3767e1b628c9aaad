"""Records of the server's journal: store requests and answers, plans, accounts; and their reading.

Answers of the store and the planner come from outside like any packet and are recorded whole, so
that a journal is replayed without them. An event loop has no time to encode a megabyte, so the
journal's writer does: bodies and chunks go there as they are, and so do long samples and programs.

For the store, requests and answers are recorded; answers are read back. For a plan, every sample is
recorded exactly. The certificate is not recorded: reading an answer makes it anew, by the same
independent check. Nor is what a body says that was read beside the event loop: its bytes are.

For accounts, no hash of a password is recorded (promise 30): each password is a number, the same
one until it is changed. A replay needs no more, because the result of each password check is an
event of its own.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Array
from openpendant.motion.scene.scene import Scene
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.trajectory import FineSamples, Trajectory
from openpendant.simplemsg.journal import LateText, Part, base64_value, with_long_texts
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.accounts import Account, AccountBook
from ..access.connection_loads import ConnectionLoad
from ..access.passwords import DIGEST_BYTES, NOBODYS_HASH, PasswordHash
from ..events.effects import Ask, Backend, Question
from ..planning.jobs import (
    BodyRead,
    DryRunFound,
    DryRunSlice,
    Job,
    KinematicsFound,
    PathFree,
    PlanAnswer,
    PlanFacts,
    PlaybackPlan,
    ReadBody,
    SearchProgress,
    ShapesFound,
)
from ..programs.editing.program_tasks import TaskResult
from ..refusal import Refusal, field_fault
from ..store import store_errors
from ..store.documents import Document, Extent, Heading
from ..store.requests import Answer, AppendChunk, Request, Save
from ..store.store_client import NoStore
from ..store.store_errors import StoreError

_ERRORS: dict[str, type[StoreError]] = {
    kind.__name__: kind
    for kind in (*vars(store_errors).values(), NoStore)
    if isinstance(kind, type) and issubclass(kind, StoreError)
}

_Scalar = str | bool | int | float | None


class _Failed(BaseModel):
    model_config = ConfigDict(extra="forbid")

    kind: str
    text: str
    fields: dict[str, _Scalar]


class _Record(BaseModel):
    what: Literal["document", "heading", "extent", "headings", "chunks", "failed"]
    answer: Any


_DOCUMENT = TypeAdapter(Document)
_HEADING = TypeAdapter(Heading)
_EXTENT = TypeAdapter(Extent)
_HEADINGS = TypeAdapter(tuple[Heading, ...])
_TEXTS = TypeAdapter(tuple[str, ...])
_FAILED = TypeAdapter(_Failed)


ANSWERED: Mapping[Backend, str] = {
    Backend.PLANNER: "planned",
    Backend.STORE: "stored",
    Backend.PASSWORDS: "checked",
    Backend.ACCOUNTS: "account",
    Backend.LOADS: "loads",
}
"""The event of a journal that is an answer, by who gave it."""


class AnswerRecordError(ValueError):
    """The record holds no answer to the question; the text says why."""


@contextmanager
def _damage_named() -> Iterator[None]:
    """Turn what is raised while a record is read into an `AnswerRecordError`."""
    try:
        yield
    except KeyError as error:
        raise AnswerRecordError(f"no samples of {error.args[0]}") from None
    except ValidationError as error:
        raise AnswerRecordError(field_fault(error)) from None
    except (ValueError, MotionError) as error:
        raise AnswerRecordError(str(error)) from None


def question_to_record(question: Question) -> bytes | LateText:
    """Return a question as a journal records it: its `repr`, and what it stores."""
    if isinstance(question, Request):
        return request_to_bytes(question)
    found = {name: getattr(question, name, None) for name in _LARGE}
    large = {name: each for name, each in found.items() if each is not None}
    if not large:
        return repr(question).encode()
    size = _OF_THE_REST + sum(map(_text_size, large.values()))
    return LateText(size, partial(_text_of, question, large))


_LARGE = ("scene", "frames")
"""Fields of a job that hold hundreds of values, whose text takes up to 70 ms to make."""

# Characters, about.
_OF_THE_REST = 500
_PER_OBJECT = 170
_PER_PAIR = 35
_PER_FRAME = 200


def _text_size(value: Scene | FrameTree) -> int:
    if isinstance(value, Scene):
        return _PER_OBJECT * len(value.objects) + _PER_PAIR * len(value.allowed)
    return _PER_FRAME * len(value.frames)


class _Gap:
    """Stands for a large value while the text round it is made."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        # Of a text, `repr` writes this character in another way, so that it is nowhere else.
        return f"\0{self.name}\0"


def _text_of(job: Any, large: Mapping[str, Scene | FrameTree]) -> Iterator[str]:
    """Return the `repr` of a job in pieces."""
    text = repr(replace(job, **{name: _Gap(name) for name in large}))
    for index, part in enumerate(text.split("\0")):
        if index % 2:
            yield from large[part].text_pieces()
        else:
            yield part


def answer_to_record(asked: Ask, answer: Any) -> dict[str, Any]:
    """Return an answer as data for a journal."""
    match asked.backend:
        case Backend.PLANNER:
            return plan_to_json(answer)
        case Backend.STORE:
            return answer_to_json(answer)
        case Backend.PASSWORDS:
            return {"right": answer}
        case Backend.ACCOUNTS:
            return outcome_to_json(answer)
        case Backend.LOADS:
            return loads_to_json(answer)


def answer_from_record(asked: Ask, record: dict[str, Any], limits: JointLimits) -> object:
    """Return the answer that a record holds; other keys are ignored.

    Args:
        record: as `answer_to_record` made it.
        limits: of the robot; what a trajectory is certified against.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    question = asked.question
    if isinstance(question, ReadBody):
        return _body_from_json(question, record)
    if isinstance(question, Job):
        return plan_from_json(asked.id, record, limits, question.start)
    match asked.backend:
        case Backend.STORE:
            return answer_from_json(record)
        case Backend.PASSWORDS:
            return check_from_json(record)
        case Backend.LOADS:
            return loads_from_json(record)
        case _:
            return outcome_from_json(record)


def request_to_bytes(request: Request) -> bytes:
    """Return a store request: its `repr` without the data to store, and behind it the data."""
    match request:
        case Save(body=body):
            return repr(replace(request, body="")).encode() + body.encode("utf-8", "surrogatepass")
        case AppendChunk(data=data):
            return repr(replace(request, data=b"")).encode() + data
    return repr(request).encode()


def answer_to_json(answer: Answer) -> dict[str, Any]:
    """Return an answer as data for a journal."""
    match answer:
        case Document():
            document = _DOCUMENT.dump_python(answer, mode="json")
            return {"what": "document", "answer": with_long_texts(document)}
        case Heading():
            return {"what": "heading", "answer": _HEADING.dump_python(answer, mode="json")}
        case Extent():
            return {"what": "extent", "answer": _EXTENT.dump_python(answer, mode="json")}
        case StoreError():
            failed = _Failed(
                kind=type(answer).__name__,
                text=str(answer),
                # An exception's notes and causes are no part of what it says.
                fields={name: value for name, value in vars(answer).items() if name[0] != "_"},
            )
            return {"what": "failed", "answer": failed.model_dump(mode="json")}
    chunks = [part for part in answer if isinstance(part, bytes)]
    if chunks:
        return {"what": "chunks", "answer": [base64_value(part) for part in chunks]}
    headings = tuple(part for part in answer if isinstance(part, Heading))
    return {"what": "headings", "answer": _HEADINGS.dump_python(headings, mode="json")}


def answer_from_json(record: dict[str, Any]) -> Answer:
    """Return the answer that a record holds; other keys are ignored.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    with _damage_named():
        read = _Record.model_validate(record)
        match read.what:
            case "document":
                return _DOCUMENT.validate_python(read.answer)
            case "heading":
                return _HEADING.validate_python(read.answer)
            case "extent":
                return _EXTENT.validate_python(read.answer)
            case "headings":
                return _HEADINGS.validate_python(read.answer)
            case "chunks":
                texts = _TEXTS.validate_python(read.answer)
                return tuple(base64.b64decode(text, validate=True) for text in texts)
            case "failed":
                return _error(_FAILED.validate_python(read.answer))


def _error(failed: _Failed) -> StoreError:
    """Return the recorded error with its text; its constructor would format the text again."""
    kind = _ERRORS.get(failed.kind)
    if kind is None:
        raise AnswerRecordError(f"no error of a store is called {failed.kind!r}")
    error = kind.__new__(kind)
    error.args = (failed.text,)
    vars(error).update(failed.fields)
    return error


class _Account(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: str
    role: Role
    disabled: bool
    password: Annotated[int, Field(ge=0, lt=2**32)]


class _Accounts(BaseModel):
    accounts: tuple[_Account, ...]
    unreadable: tuple[str, ...] = ()
    single_user: bool


class _Check(BaseModel):
    right: bool | None


class _Loads(BaseModel):
    # Journals of version 2 have no unread bytes.
    loads: dict[int, tuple[int, int, int] | tuple[int, int, int, int]]


class _Outcome(BaseModel):
    code: int
    text: str
    value: float
    limit: float


class PasswordNumbers:
    """The numbers that stand for passwords in one journal."""

    def __init__(self) -> None:
        self._numbers: dict[PasswordHash, int] = {}

    def book_to_json(self, book: AccountBook, *, single_user: bool) -> dict[str, Any]:
        """Return accounts as plain data without any secret."""
        accounts = [
            {
                "name": account.name,
                "role": account.role.value,
                "disabled": account.disabled,
                "password": self._numbers.setdefault(account.password, len(self._numbers)),
            }
            for account in book
        ]
        unreadable = sorted(book.unreadable)
        return {"accounts": accounts, "unreadable": unreadable, "single_user": single_user}


def book_from_json(record: dict[str, Any]) -> tuple[AccountBook, bool]:
    """Return the accounts of a record, with numbers for passwords, and who is single user.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    with _damage_named():
        read = _Accounts.model_validate(record)
        accounts = [
            Account(
                name=each.name,
                role=each.role,
                disabled=each.disabled,
                password=PasswordHash(
                    salt=NOBODYS_HASH.salt, digest=f"{each.password:0{2 * DIGEST_BYTES}x}"
                ),
            )
            for each in read.accounts
        ]
    return AccountBook(accounts, dict.fromkeys(read.unreadable, "")), read.single_user


def check_from_json(record: dict[str, Any]) -> bool | None:
    """Return whether a password was right; None where it could not be checked.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    with _damage_named():
        return _Check.model_validate(record).right


def loads_to_json(loads: Mapping[int, ConnectionLoad]) -> dict[str, Any]:
    """Return as plain data what connections took of the loop, by their numbers."""
    return {
        "loads": {
            str(session): (load.frames, load.received, load.cost_ns, load.unread)
            for session, load in loads.items()
        }
    }


def loads_from_json(record: dict[str, Any]) -> dict[int, ConnectionLoad]:
    """Return what connections took of the loop, by their numbers.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    with _damage_named():
        read = _Loads.model_validate(record)
    return {session: ConnectionLoad(*numbers) for session, numbers in read.loads.items()}


def outcome_to_json(refusal: Refusal | None) -> dict[str, Any]:
    """Return as plain data why an account was not changed, or that it was."""
    reason = refusal or Refusal(VerdictCode.ACCEPTED)
    return {
        "code": int(reason.code),
        "text": reason.text,
        "value": reason.value,
        "limit": reason.limit,
    }


def outcome_from_json(record: dict[str, Any]) -> Refusal | None:
    """Return why an account was not changed; None where it was.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    with _damage_named():
        read = _Outcome.model_validate(record)
        code = VerdictCode(read.code)
    if code is VerdictCode.ACCEPTED:
        return None
    return Refusal(code, read.text, value=read.value, limit=read.limit)


_FOUND: dict[str, TypeAdapter[Any]] = {
    kind.__name__: TypeAdapter(kind)
    for kind in (
        *(DryRunFound, DryRunSlice, KinematicsFound, ShapesFound, PathFree, SearchProgress),
        *get_args(TaskResult),
    )
}
_PLAYBACK = TypeAdapter(PlaybackPlan)
_FACTS = TypeAdapter(PlanFacts)
_ARRAYS = ("times", "position", "velocity", "acceleration", "waypoint_times")
_FINE = ("position", "velocity")


class _Refused(BaseModel):
    model_config = ConfigDict(extra="forbid")

    code: VerdictCode
    text: str
    joint: int
    value: float
    limit: float


class _PlanRecord(BaseModel):
    plan_time: float
    took: float = 0.0
    joints: int = 0
    refused: _Refused | None = None
    samples: dict[str, str] | None = None
    playback: Any = None
    facts: Any = None
    kind: str | None = None
    found: Any = None


def plan_to_json(planned: PlanAnswer) -> dict[str, Any]:
    """Return an answer as data for a journal; reals keep every bit."""
    result = planned.result
    if isinstance(result, Refusal):
        refused = {name: getattr(result, name) for name in _Refused.model_fields}
        return {"plan_time": planned.plan_time, "refused": refused}
    if isinstance(result, BodyRead):
        return {"plan_time": planned.plan_time, "kind": BodyRead.__name__}
    if not isinstance(result, tuple):
        found = _FOUND[type(result).__name__].dump_python(result, mode="json")
        if isinstance(result, TaskResult | KinematicsFound | ShapesFound):
            found = with_long_texts(found)
        record = {"plan_time": planned.plan_time, "kind": type(result).__name__, "found": found}
        return record if planned.preview is None else record | _samples_of(planned.preview[0])
    times = {"plan_time": planned.plan_time, "took": planned.took}
    record = times | _samples_of(result[0])
    if planned.playback is not None:
        record["playback"] = _PLAYBACK.dump_python(planned.playback, mode="json")
    if planned.facts is not None:
        record["facts"] = _FACTS.dump_python(planned.facts, mode="json")
    return record


def _samples_of(trajectory: Trajectory) -> dict[str, Any]:
    samples = {name: _encode(getattr(trajectory, name)) for name in _ARRAYS}
    if trajectory.fine is not None:
        samples |= {f"fine_{name}": _encode(getattr(trajectory.fine, name)) for name in _FINE}
    return {"joints": trajectory.dof, "samples": samples}


def _body_from_json(job: ReadBody, record: dict[str, Any]) -> PlanAnswer:
    """Return the answer to a body: it is in the journal as bytes of its connection, and read anew.

    Raises:
        AnswerRecordError: the record is damaged.
    """
    with _damage_named():
        read = _PlanRecord.model_validate(record)
        if read.refused is not None:
            return PlanAnswer(job.job_id, Refusal(**read.refused.model_dump()), read.plan_time)
        if read.kind != BodyRead.__name__:
            raise AnswerRecordError("neither a body that was read nor a refusal")
        return PlanAnswer(job.job_id, BodyRead(*job.read(job.body)), read.plan_time)


def plan_from_json(
    job_id: int, record: dict[str, Any], limits: JointLimits, start: Sequence[float]
) -> PlanAnswer:
    """Return the answer that a record holds.

    Args:
        record: as `plan_to_json` made it; other keys are ignored.
        limits: what the trajectory is certified against.
        start: (n,) where the robot stood when the job was given [rad or m].

    Raises:
        AnswerRecordError: the record is damaged, or its trajectory does not pass the certificate.
    """
    with _damage_named():
        read = _PlanRecord.model_validate(record)
        if read.refused is not None:
            return PlanAnswer(job_id, Refusal(**read.refused.model_dump()), read.plan_time)
        if read.kind is not None:
            if read.kind not in _FOUND:
                raise AnswerRecordError(f"no answer of a planner is called {read.kind!r}")
            # As text, because statements are strict: an object is a statement in JSON alone.
            found = _FOUND[read.kind].validate_json(json.dumps(read.found))
            preview = None
            if read.samples is not None:
                shown = _trajectory(read.samples, read.joints)
                preview = shown, certify(shown, limits)
            return PlanAnswer(job_id, found, read.plan_time, preview=preview)
        if read.samples is None:
            raise AnswerRecordError("neither a trajectory nor a refusal")
        trajectory = _trajectory(read.samples, read.joints)
        return PlanAnswer(
            job_id,
            (trajectory, certify(trajectory, limits, start=start)),
            read.plan_time,
            None if read.playback is None else _PLAYBACK.validate_python(read.playback),
            read.took,
            None if read.facts is None else _FACTS.validate_python(read.facts),
        )


def _trajectory(samples: dict[str, str], joints: int) -> Trajectory:
    arrays = {name: _decode(samples[name]) for name in _ARRAYS}
    for name in ("position", "velocity", "acceleration"):
        arrays[name] = arrays[name].reshape(-1, joints)
    return Trajectory(**arrays, fine=_fine(samples, joints))


def _fine(samples: dict[str, str], joints: int) -> FineSamples | None:
    if f"fine_{_FINE[0]}" not in samples:
        return None
    return FineSamples(*(_decode(samples[f"fine_{name}"]).reshape(-1, joints) for name in _FINE))


def _encode(array: Array) -> Part:
    return base64_value(np.ascontiguousarray(array, dtype="<f8").reshape(-1).view(np.uint8).data)


def _decode(text: str) -> Array:
    return np.frombuffer(base64.b64decode(text, validate=True), dtype="<f8").astype(np.float64)
