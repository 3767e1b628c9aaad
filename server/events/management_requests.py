"""Management requests: the request that a JSON body holds, its handler, and the route of its reply.

Owns the one adapter of all operations, and the wording of what is wrong with a body: the first
place, in the order in which the request declares its fields, and the rule that it breaks. A list is
read up to its first wrong element, so that an illegal body costs no more than a legal one, and no
key may stand twice in an object, of which two readers could take another value each. Handlers are
methods of services, found by the request they are for.

Owns which bodies are read on the event loop: small ones that import nothing. All others are read in
the planning processes.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import reduce
from operator import or_
from typing import Annotated, Any, Generic, TypeAlias, TypeVar

from pydantic import BaseModel, Field, TypeAdapter, ValidationError
from pydantic_core import SchemaValidator

from openpendant.simplemsg import CommType, ReplyCode
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, PROTOCOL_VERSION, Management
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.pendant.management.program_values import ProgramError
from openpendant.simplemsg.verdicts import VerdictCode, in_version_2

from ..programs.editing.program_tasks import ProgramRefused
from ..programs.language.program_errors import ProgramSyntaxError, program_refusal
from ..refusal import Refusal
from .effects import Effect, Send

MOST_AT_ONCE = 4_096
"""Largest body that is read on the event loop [bytes]: the dearest takes 0.5 ms."""

MOST_BEFORE_LOGIN = 1_024
"""Largest body that is read of a connection which has not logged in [bytes]."""

_IMPORTS = frozenset(name for name in OPERATIONS if name.endswith(".import"))
"""Operations whose content is read as a file is, which takes longer than the body's size tells."""

LONGEST_TEXT = 400
"""A place may be as long as the request, and the answer has to fit a frame [characters]."""

_KINDS: Any = reduce(or_, OPERATIONS.values())
_TOLD_APART: Any = Annotated[_KINDS, Field(discriminator="op")]


def _failing_fast(schema: Any) -> Any:
    """Return a schema of pydantic whose lists are read up to their first wrong element."""
    if isinstance(schema, list):
        return [_failing_fast(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    # What is about a field, or for a JSON schema, is no schema of values.
    made = {key: each if key == "metadata" else _failing_fast(each) for key, each in schema.items()}
    return made | {"fail_fast": True} if made.get("type") in ("list", "tuple") else made


_VALIDATOR = SchemaValidator(_failing_fast(TypeAdapter(_TOLD_APART).core_schema))

_TOGETHER = (("frames", "tools", "scene", "signals", "robots", "trace"), ("access", "users"))
"""Topics whose operations are named together where an unknown one of them is refused."""

_WITHOUT_TOPIC = ("snapshot", "cells", "why", "catalogue")

_ALONE = frozenset({*_WITHOUT_TOPIC, "jog.retreat"})
"""Operations that a fault does not name in front of its place."""

_IN_PROGRAMS = {"edit", "move"}
"""Fields that hold parts of a program: a key too many has the words there that files get."""

_LONGEST_NAME = 40

_UNKNOWN_KEY = "Extra inputs are not permitted"

_LATER_FIELDS = {
    op: found
    for op, kind in OPERATIONS.items()
    if (found := {each.name for each in fields(kind) if "since" in each.metadata})
}
"""Fields that came with version 3, of operations that were there before."""


class _Named(BaseModel):
    """The fields of every request, to say what is wrong with one of no known operation."""

    op: str


def takes_long(body: bytes) -> bool:
    """Return True for a body that is not for the event loop: a large one, or any import."""
    if len(body) > MOST_AT_ONCE:
        return True
    # Nothing but an escape can hide a name, and few bodies have to be looked into.
    if b".import" not in body and b"\\u" not in body:
        return False
    try:
        found = json.loads(body)
    except (ValueError, RecursionError):
        return False
    name = found.get("op") if isinstance(found, dict) else None
    return isinstance(name, str) and name in _IMPORTS


def parse(body: bytes, version: int = PROTOCOL_VERSION) -> tuple[str, Request[Any] | Refusal]:
    """Return the name of the operation, empty where there is none, and the request or its fault.

    Args:
        version: of the protocol that the connection speaks.
    """
    objects: list[list[tuple[str, Any]]] = []
    try:
        # Each object of the body is appended with all its keys, the outermost last.
        is_object = json.loads(body, object_pairs_hook=objects.append) is None
    except (ValueError, RecursionError):
        is_object = False
        objects.clear()
    named = dict(objects[-1]).get("op") if is_object and objects else None
    name = named if isinstance(named, str) else ""
    for each in objects:
        if len(dict(each)) < len(each):
            return name, _key_twice(each)
    if name in OPERATIONS and not is_known(name, version):
        return name, unknown(name, version)
    if version < PROTOCOL_VERSION and name in _LATER_FIELDS:
        for key in _LATER_FIELDS[name] & dict(objects[-1]).keys():
            return name, _refusal((name, key), _UNKNOWN_KEY)
    # What version 2 took for a number, it goes on taking for one.
    is_strict = True if name in OPERATIONS and OPERATIONS[name].SINCE > 2 else None
    try:
        request: Request[Any] = _VALIDATOR.validate_json(body, strict=is_strict)
    except ValidationError as error:
        return name, _fault(name, body, error, version)
    return request.op, request


def _key_twice(pairs: list[tuple[str, Any]]) -> Refusal:
    ((key, _),) = Counter(key for key, _ in pairs).most_common(1)
    return _refusal((), f"the key {key[:_LONGEST_NAME]!a} stands twice in one object")


def is_known(name: str, version: int) -> bool:
    """Return True if a version of the protocol has an operation of this name."""
    return name in OPERATIONS and OPERATIONS[name].SINCE <= version


def is_of_topic(name: str, version: int) -> bool:
    """Return True if the name of an operation, which there may be or not, begins with a topic."""
    return "." in name and bool(_known_with(name, version))


def unknown(name: str, version: int) -> Refusal:
    """Return why an operation that is none in a version of the protocol is refused."""
    known = _known_with(name, version) if "." in name else []
    if len(known) == 1:
        return _refusal(("op",), f"Input should be {known[0]!r}")
    if known:
        tags = ", ".join(map(repr, known))
        problem = f"Input tag '{name}' found using 'op' does not match any of the expected tags"
        return _refusal((), f"{problem}: {tags}")
    accepted = ", ".join(op for op in _WITHOUT_TOPIC if is_known(op, version))
    return _refusal(("op",), f"{name[:_LONGEST_NAME]!r}; accepted: {accepted}")


def _known_with(name: str, version: int) -> list[str]:
    """Return the operations that are named together with those of a name's topic."""
    topic = name.partition(".")[0]
    topics = next((each for each in _TOGETHER if topic in each), (topic,))
    found = (op for each in topics for op in OPERATIONS if op.startswith(f"{each}."))
    return [op for op in found if is_known(op, version)]


def _fault(name: str, body: bytes, error: ValidationError, version: int) -> Refusal:
    kind = OPERATIONS.get(name)
    if kind is None:
        return _nameless(body, version)
    order = [each.name for each in fields(kind)]

    def rank(fault: Any) -> int:
        # The place begins with the tag of the union; pydantic looks at optional fields last.
        field = str(fault["loc"][1]) if len(fault["loc"]) > 1 else ""
        return order.index(field) if field in order else len(order)

    first = min(error.errors(include_url=False, include_input=False), key=rank)
    place, problem = first["loc"], first["msg"]
    if first["type"] == "unexpected_keyword_argument" and not _IN_PROGRAMS & set(place[1:2]):
        problem = _UNKNOWN_KEY
    return _refusal(place[1:] if name in _ALONE else place, problem)


def _nameless(body: bytes, version: int) -> Refusal:
    """Return what is wrong with a body that names no operation, or one that is none."""
    try:
        named = _Named.model_validate_json(body).op
    except ValidationError as error:
        (first,) = error.errors(include_url=False, include_input=False)
        return _refusal(first["loc"], first["msg"])
    return unknown(named, version)


def _refusal(place: tuple[int | str, ...], problem: str) -> Refusal:
    where = ".".join(str(part) for part in place)
    text = f"{where}: {problem}" if where else problem
    return Refusal(VerdictCode.BAD_ARGUMENT, text[-LONGEST_TEXT:])


Answer = TypeVar("Answer", contravariant=True)

MOST_ANSWER = MAX_PENDANT_FRAME - 64
"""Largest body of an answer; the rest of the frame is headers [bytes]."""


class ReplyTo(Generic[Answer]):
    """Sender of one request; makes its reply, a JSON object with the keys of `Answer`.

    Attributes:
        name: of the author, as saved with a change.
        request_id: the client's own number for the request.
        version: of the protocol that the connection speaks.
    """

    def __init__(
        self,
        session: int,
        request_id: int,
        name: str,
        version: int = PROTOCOL_VERSION,
        in_words: Callable[[str], str] = str,
    ) -> None:
        """Take note of one request.

        Args:
            in_words: returns a sentence with the joints' names as people know them.
        """
        self._in_words = in_words
        self.session = session
        self.version = version
        self.name = name
        self.request_id = request_id

    def answer(self, body: Answer) -> list[Effect]:
        """Return the answer to a request that was carried out."""
        return self._reply(
            json.dumps(body, ensure_ascii=False, separators=(",", ":")), ReplyCode.SUCCESS
        )

    def answer_text(self, text: str) -> list[Effect]:
        """Return the answer whose body is JSON already, without blanks between its parts."""
        return self._reply(text, ReplyCode.SUCCESS)

    def refuse(self, refusal: Refusal, **fields: Any) -> list[Effect]:
        """Return the answer to a request that was refused."""
        about = {
            "code": self.code(refusal.code),
            "text": self._in_words(refusal.sentence),
            "joint": refusal.joint,
            "value": refusal.value,
            "limit": refusal.limit,
        }
        return self._reply(
            json.dumps(about | fields, ensure_ascii=False, separators=(",", ":")), ReplyCode.FAILURE
        )

    def code(self, code: VerdictCode) -> VerdictCode:
        """Return the code by which this connection knows a code."""
        return code if self.version >= PROTOCOL_VERSION else VerdictCode(in_version_2(code))

    def refuse_program(self, error: ProgramError) -> list[Effect]:
        """Return the answer that says what is wrong with a program, and where in its text."""
        if isinstance(error, ProgramSyntaxError):
            return self.refuse(program_refusal(error), line=error.line, column=error.column)
        return self.refuse(program_refusal(error))

    def refuse_work(self, refused: ProgramRefused) -> list[Effect]:
        """Return the refusal of a program task, with the place in the text where it has one."""
        if refused.line is None:
            return self.refuse(refused.refusal)
        return self.refuse(refused.refusal, line=refused.line, column=refused.column)

    def _reply(self, text: str, code: ReplyCode) -> list[Effect]:
        body = text.encode()
        if len(body) > MOST_ANSWER:
            told = f"the answer has {len(body)} bytes; accepted by a frame: {MOST_ANSWER}"
            refusal = Refusal(VerdictCode.TOO_LARGE, told, value=len(body), limit=MOST_ANSWER)
            return self.refuse(refusal)
        reply = Management(self.request_id, body, comm_type=CommType.REPLY, reply_code=code)
        return [Send(self.session, reply)]


_Service = TypeVar("_Service")
_Asked = TypeVar("_Asked", bound=Request[Any])
_Reply = TypeVar("_Reply")

Handler: TypeAlias = Callable[[Any, ReplyTo[Any], int], list[Effect]]
"""Carries out a request at a time [ns]; the answer may come later."""

Handlers: TypeAlias = Mapping[type[Request[Any]], Handler]

_Method: TypeAlias = Callable[[_Service, _Asked, ReplyTo[_Reply], int], list[Effect]]


def handles(
    kind: Callable[..., Request[_Reply]],
) -> Callable[[_Method[_Service, _Asked, _Reply]], _Method[_Service, _Asked, _Reply]]:
    """Declare a method as the one that carries out requests of a kind.

    Args:
        kind: class of the request; what the method answers has to be of its reply's type.
    """

    def marked(
        method: _Method[_Service, _Asked, _Reply],
    ) -> _Method[_Service, _Asked, _Reply]:
        vars(method)["handles"] = kind
        return method

    return marked


def handlers_of(*services: object) -> dict[type[Request[Any]], Handler]:
    """Return the handlers of some services by the class of the request.

    Raises:
        ValueError: two handlers are for one request.
    """
    found: dict[type[Request[Any]], Handler] = {}
    for service in services:
        for name, method in vars(type(service)).items():
            kind = getattr(method, "handles", None)
            if kind is None:
                continue
            if kind in found:
                raise ValueError(f"{kind.__name__} has two handlers, one of them {name}")
            found[kind] = getattr(service, name)
    return found
