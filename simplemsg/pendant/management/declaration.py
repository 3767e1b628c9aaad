"""Declaration of management operations: one frozen dataclass a request, with its reply and role.

Owns the table of all operations, the markers that say of a field what Python's types do not
(bounds, lengths, and how JSON becomes its value), and the values that several topics share. A
marker has the method that pydantic looks for by name, so that the server reads requests by their
declarations and this package needs the standard library only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, asdict, dataclass, field, fields, make_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from typing import (
    Annotated,
    Any,
    ClassVar,
    Generic,
    Literal,
    NotRequired,
    TypeAlias,
    TypedDict,
    TypeVar,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from ..roles import Permission

Reply = TypeVar("Reply")
_Declared = TypeVar("_Declared", bound="Request[Any]")

_CLOSED: Mapping[str, str] = {"extra": "forbid"}
"""What pydantic is told of a request, and of an object in one: an unknown key is refused."""


class NeedsAuthority(Enum):
    """When whoever asks must hold the motion authority of the cell; in the words of the pages."""

    NEVER = "never"
    WHILE_MOVING = "while the robot moves"
    """While a motion or a program is under way, or the controller reports motion."""
    MOVING_OR_CARRIED = "while the robot moves, or for what it carries"
    """As `WHILE_MOVING`, and where an object would be taken, changed or left that it carries."""
    SELECTED_TOOL = "for the selected tool"
    """Where `name` is that of the selected tool: its centre point is where the robot is."""
    PROGRAM_UNDER_WAY = "for a program under way"
    """Where `name` is that of a program that runs, is paused or is being loaded."""
    ALWAYS = "always"


class Request(Generic[Reply]):
    """One management request; what answers it is a `Reply`.

    Attributes:
        NEEDS: what whoever asks must be permitted; None for nothing.
        AUTHORITY: when whoever asks must hold the motion authority.
        IN_ORDER: whether it may move the robot or its surroundings, so that a connection's requests
            of this kind are taken in order and once.
        OVERTAKEN: whether it is refused where a stop of its connection has overtaken it; None where
            its permission decides. What changes the selected tool, or what the robot carries, is
            refused besides.
        SINCE: the first version of the protocol that has it; others do not know its name. A field
            that came later has its own as `metadata["since"]`; an older version takes it for an
            unknown key.
    """

    __slots__ = ()
    __pydantic_config__: ClassVar[Mapping[str, str]] = _CLOSED

    NEEDS: ClassVar[Permission | None]
    AUTHORITY: ClassVar[NeedsAuthority]
    IN_ORDER: ClassVar[bool]
    OVERTAKEN: ClassVar[bool | None]
    SINCE: ClassVar[int]
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    op: str

    @classmethod
    def reply(cls) -> Any:
        """Return the type of what answers the request."""
        (declared,) = get_args(vars(cls)["__orig_bases__"][0])
        return declared


OPERATIONS: dict[str, type[Request[Any]]] = {}
"""Every operation by the value of `op`; whole once the package of the topics is imported."""


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def operation(
    name: str,
    *,
    needs: Permission | None,
    authority: NeedsAuthority = NeedsAuthority.NEVER,
    in_order: bool = False,
    overtaken: bool | None = None,
    since: int = 2,
) -> Callable[[type[_Declared]], type[_Declared]]:
    """Declare the request of an operation: a class of fields becomes a frozen dataclass.

    Raises:
        ValueError: there is an operation of this name already.
    """

    def declare(declared: type[_Declared]) -> type[_Declared]:
        if name in OPERATIONS:
            raise ValueError(f"{name} is declared twice")
        declared.__annotations__["op"] = Literal[name]
        tag: Any = field(default=name, kw_only=True, repr=False)
        declared.op = tag
        # Nobody compares requests, and each method that is made costs every pendant's start.
        made = dataclass(frozen=True, slots=True, eq=False)(declared)
        made.NEEDS, made.AUTHORITY = needs, authority
        made.IN_ORDER, made.OVERTAKEN, made.SINCE = in_order, overtaken, since
        OPERATIONS[name] = made
        return made

    return declare


def body_of(request: Request[Any]) -> dict[str, Any]:
    """Return a request as the JSON object that is sent: its name, then its fields in call order."""
    told = fields(request)
    names = sorted((each.kw_only, at) for at, each in enumerate(told) if each.name != "op")
    return {"op": request.op} | {told[at].name: getattr(request, told[at].name) for _, at in names}


CoreSchema: TypeAlias = dict[str, Any]
"""What pydantic validates by; of ours only bounds are written into it."""

_Handler = Callable[[Any], Any]


@dataclass(frozen=True, slots=True)
class Count:
    """Bounds of a whole number.

    Attributes:
        below: the number that it must be below; None for no bound.
    """

    least: int
    most: int | None = None
    below: int | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema of the number with these bounds."""
        return _with(handler(source), ge=self.least, le=self.most, lt=self.below)


@dataclass(frozen=True, slots=True)
class Number:
    """Bounds of a real number.

    Attributes:
        finite: whether infinity and what is no number are refused by that name.
    """

    least: float | None = None
    most: float | None = None
    finite: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema of the number with these bounds."""
        infinite = False if self.finite else None
        return _with(handler(source), ge=self.least, le=self.most, allow_inf_nan=infinite)


@dataclass(frozen=True, slots=True)
class Length:
    """Bounds of the number of items in a list."""

    least: int | None
    most: int

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema of the list with these bounds."""
        return _with(handler(source), min_length=self.least, max_length=self.most)


@dataclass(frozen=True, slots=True)
class Strictly:
    """Only what JSON writes as the declared type is read: no number as text, no bool as number."""

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema that takes no other JSON type."""
        return _with(handler(source), strict=True)


@dataclass(frozen=True, slots=True)
class ReadAs:
    """The type that the server reads a field as, where callers may give it in wider types.

    Attributes:
        kind: the type, whose values are of the declared one too.
    """

    kind: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema of the narrower type."""
        schema: CoreSchema = handler(self.kind)
        return schema


@dataclass(frozen=True, slots=True)
class ReadAsKeys:
    """A field that holds a JSON object with certain keys and no others.

    Attributes:
        kind: the typed dictionary that has the keys; read values are such dictionaries.
    """

    kind: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema of an object that is checked key by key and becomes a dictionary."""
        call = {"type": "no-info", "function": asdict}
        return {"type": "function-after", "function": call, "schema": handler(_reader(self.kind))}


@dataclass(frozen=True, slots=True)
class ReadAsFrom:
    """As `ReadAs`, of a type in a file of this folder that callers have no need to import.

    Attributes:
        file: its name.
        name: of the type in it.
    """

    file: str
    name: str

    def __get_pydantic_core_schema__(self, source: Any, handler: _Handler) -> CoreSchema:
        """Return the schema of the type."""
        file = import_module(f".{self.file}", __package__)
        schema: CoreSchema = handler(getattr(file, self.name))
        return schema


@dataclass(frozen=True, slots=True)
class ToldApart:
    """A value of several classes, each of which has a field that says which it is.

    Attributes:
        tag: name of that field, which has one value in each class.
    """

    tag: str

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """Return the schema of a value that is read as the class of its tag."""
        choices = {}
        for kind in get_args(source):
            (value,) = get_args(get_type_hints(kind)[self.tag])
            choices[value] = handler.generate_schema(kind)
        return {"type": "tagged-union", "discriminator": self.tag, "choices": choices}


@dataclass(frozen=True, slots=True)
class Default:
    """The value of a key that is left out."""

    value: Any


@cache
def _reader(kind: Any) -> Any:
    """Return the dataclass that reads a typed dictionary; a key that may be missing has a default.

    On Python 3.11 pydantic takes no `TypedDict` of the standard library.
    """
    found: list[Any] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        is_optional = get_origin(hint) is NotRequired
        inner = get_args(hint)[0] if is_optional else hint
        marks = get_args(inner)[1:] if get_origin(inner) is Annotated else ()
        default = next((each.value for each in marks if isinstance(each, Default)), MISSING)
        found.append((name, inner) if default is MISSING else (name, inner, field(default=default)))
    about = (kind.__doc__ or "").partition("\n")[0]
    space = {"__module__": kind.__module__, "__doc__": about, "__pydantic_config__": _CLOSED}
    return make_dataclass(kind.__name__, found, namespace=space, frozen=True, slots=True)


def _with(schema: CoreSchema, **bounds: Any) -> CoreSchema:
    return schema | {name: bound for name, bound in bounds.items() if bound is not None}


Real: TypeAlias = Annotated[float, Number(finite=True)]
"""A finite number."""

Vector: TypeAlias = Annotated[Sequence[float], ReadAs(tuple[Real, Real, Real])]
"""Three numbers x, y, z."""

Quaternion: TypeAlias = Annotated[Sequence[float], ReadAs(tuple[Real, Real, Real, Real])]
"""Four numbers x, y, z, w."""

Content: TypeAlias = Annotated[Mapping[str, Any], ReadAs(dict[str, Any])]
"""A JSON object with keys of its own, such as a file's content."""

Revision: TypeAlias = Annotated[int, Count(0)]
"""The revision that a change was made from."""


class PlacedPose(TypedDict):
    """A pose in some frame.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; left out for no rotation.
    """

    position: Vector
    orientation: NotRequired[Annotated[Quaternion, Default((0.0, 0.0, 0.0, 1.0))]]


class FoundPose(TypedDict):
    """A pose that was worked out.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
    """

    position: list[float]
    orientation: list[float]


AnyPose: TypeAlias = PlacedPose | FoundPose
"""What a call takes: a pose that somebody wrote, or one that the server found."""

Placed: TypeAlias = Annotated[AnyPose, ReadAsKeys(PlacedPose)]
"""A pose in a request."""

ORIGIN: PlacedPose = {"position": (0.0, 0.0, 0.0), "orientation": (0.0, 0.0, 0.0, 1.0)}


class Done(TypedDict):
    """Nothing more is told: it is done."""


class Changed(TypedDict):
    """The revision to make the next change from.

    Attributes:
        revision: the one that is kept now: make the next change from it.
    """

    revision: int
