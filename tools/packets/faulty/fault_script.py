"""A fault script: rules in order, with the frames they fit, each fault's parameters and bounds.

It is read from a TOML file. Each rule has a fault, its parameters and what it fits; the first that
fits a frame acts on it, and no other. Owns what the author of a wrong script is told. Knows nothing
of how a fault is done.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from openpendant.motion.bounded_file import beginning_of, toml_of
from openpendant.simplemsg import DIALECTS

from ..console import PacketToolError
from ..trace import TraceDirection

Milliseconds = Annotated[float, Field(ge=0, le=600_000)]
Seconds = Annotated[float, Field(ge=0, le=86_400)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]


class FaultDirection(Enum):
    """The direction of a frame, as a script says it."""

    TO_SERVER = "to_server"
    TO_CLIENT = "to_client"

    @property
    def direction(self) -> TraceDirection:
        """The same, as a trace says it."""
        return TraceDirection[self.name]


class Exchange(Enum):
    """Communication types by name."""

    TOPIC = "topic"
    REQUEST = "request"
    REPLY = "reply"


class RuleTable(BaseModel):
    """A table of a script; a key that it does not know is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Match(RuleTable):
    """The frames that a rule fits; everything that is given must hold.

    Frames that an earlier rule took are not seen, and so not counted, by a later one.
    """

    direction: FaultDirection | None = None
    """Which way the frame travels."""
    type: int | str | None = None
    """Message type: number or name, e.g. 11 or "joint_traj_pt"."""
    comm: Exchange | None = None
    """Communication type."""
    reply_code: Annotated[int, Field(ge=0, le=2)] | None = None
    """Reply code of the header: 1 success, 2 failure."""
    sequence: int | None = None
    """Value of the field `sequence`; -4 is STOP."""
    connection: Count | None = None
    """Number of the connection on its port, from 1."""
    pair: Count | None = None
    """Number of the --listen and --to pair, from 1."""
    after_s: Seconds | None = None
    """Only when the connection is at least so old, s."""
    before_s: Seconds | None = None
    """Only while the connection is younger, s."""
    nth: Count | None = None
    """Only the n-th of the frames that fit so far, over all connections."""
    every: Count | None = None
    """Only every n-th of them."""
    probability: Annotated[float, Field(gt=0, le=1)] | None = None
    """Only so large a share of them, drawn from the seed."""
    times: Count | None = None
    """At most so often."""


class _Rule(RuleTable):
    """The fields of every rule."""

    match: Match = Match()


class Delay(_Rule):
    """Holds a frame back; what follows it waits too, as on a slow line."""

    fault: Literal["delay"]
    ms: Milliseconds
    """How long, ms."""
    jitter_ms: Milliseconds = 0
    """Up to so much longer, drawn from the seed, ms."""


class Split(_Rule):
    """Sends a frame in several pieces."""

    fault: Literal["split"]
    at: tuple[Annotated[int, Field(ge=1, le=65_538)], ...] = ()
    """Offsets at which to cut, bytes."""
    size: Count | None = None
    """Cut into pieces of this size instead, bytes; 1 sends each byte alone."""
    gap_ms: Milliseconds = 1.0
    """Pause between the pieces, ms."""

    @model_validator(mode="after")
    def _one_way_to_cut(self) -> Split:
        if bool(self.at) == (self.size is not None):
            raise ValueError("give either at or size")
        return self


class Coalesce(_Rule):
    """Holds frames until there are several, and sends them in one piece."""

    fault: Literal["coalesce"]
    frames: Annotated[int, Field(ge=2, le=1_000)]
    """How many."""
    within_ms: Annotated[float, Field(gt=0, le=60_000)] = 100.0
    """Send what there is after so long, ms."""


class Drop(_Rule):
    """Does not forward a frame."""

    fault: Literal["drop"]


class Duplicate(_Rule):
    """Sends a frame more than once."""

    fault: Literal["duplicate"]
    copies: Annotated[int, Field(ge=1, le=100)] = 1
    """How many more."""


class Corruption(Enum):
    """The damage that `corrupt` does to a frame."""

    BITS = "bits"
    LENGTH = "length"
    TRUNCATE = "truncate"
    VALID_FIELDS = "valid_fields"


class Corrupt(_Rule):
    """Changes the bytes of a frame."""

    fault: Literal["corrupt"]
    how: Corruption
    """bits: flip; length: a length field that lies; truncate: a body cut short; valid_fields:
    garbage in the upper 28 bits, as a real client sends."""
    bits: Annotated[int, Field(ge=1, le=1_000)] = 1
    """How many bits to flip."""
    offset: Annotated[int, Field(ge=0, le=65_538)] | None = None
    """In which byte; drawn from the seed where it is left out."""
    by: Annotated[int, Field(ge=-65_535, le=65_535)] = 4
    """What to add to the length field, or how many bytes to cut off."""


class _Ending(_Rule):
    forward: bool = False
    """Forward the frame before."""


class ResetLink(_Ending):
    """Breaks the connection off on both sides (RST)."""

    fault: Literal["reset"]


class CloseLink(_Ending):
    """Closes the connection on both sides in order (FIN)."""

    fault: Literal["close"]


class HalfOpen(_Ending):
    """Forwards and reads nothing any more, and keeps both sockets open."""

    fault: Literal["half_open"]


class LostReply(_Rule):
    """Forwards a request and loses the reply to it."""

    fault: Literal["lost_reply"]


class Refuse(_Rule):
    """Answers a request with failure in the server's name; the server never sees it."""

    fault: Literal["refuse"]


class Busy(_Rule):
    """Lets a request find a full buffer.

    With the Motoman dialect, motion requests are answered with result 1 (busy) and not forwarded;
    otherwise the reply is withheld, as controllers without such an answer do.
    """

    fault: Literal["busy"]
    ms: Milliseconds = 500.0
    """How long a reply is withheld, ms."""


class WrongByteOrder(_Rule):
    """Sends a frame in the other byte order."""

    fault: Literal["wrong_byte_order"]


class Throttle(_Rule):
    """Lets frames through no faster than a slow line would."""

    fault: Literal["throttle"]
    bytes_per_s: Annotated[float, Field(ge=1, le=1e9)]
    """Speed of the line, bytes per second."""


class Reorder(_Rule):
    """Lets later frames overtake a frame."""

    fault: Literal["reorder"]
    overtaken_by: Annotated[int, Field(ge=1, le=100)] = 1
    """How many."""
    within_ms: Annotated[float, Field(gt=0, le=60_000)] = 1_000.0
    """Send it after so long at the latest, ms."""


Rule = (
    Delay
    | Split
    | Coalesce
    | Drop
    | Duplicate
    | Corrupt
    | ResetLink
    | CloseLink
    | HalfOpen
    | LostReply
    | Refuse
    | Busy
    | WrongByteOrder
    | Throttle
    | Reorder
)

RULE_CLASSES: dict[str, type[_Rule]] = {
    get_args(cls.model_fields["fault"].annotation)[0]: cls for cls in get_args(Rule)
}
"""The class of each fault, by its name in a script."""


MAX_SCRIPT = 1_048_576
"""Largest script file, bytes."""


class FaultScriptError(PacketToolError):
    """A script that cannot be used; the text names file, rule, key and what is expected."""


class FaultScript(RuleTable):
    """A whole script."""

    about: str = ""
    """What it is for, in a sentence."""
    dialect: Literal["standard", "motoman", "pendant"] = "standard"
    """Messages to know by name and field."""
    real: Literal[4, 8] = 4
    """Bytes of a real."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    """Random choices repeat with the same seed."""
    rule: tuple[Annotated[Rule, Field(discriminator="fault")], ...]
    """The rules, in order."""

    @model_validator(mode="after")
    def _known_types(self) -> FaultScript:
        for number, rule in enumerate(self.rule, 1):
            if isinstance(rule.match.type, str):
                try:
                    type_number(rule.match.type, self.dialect)
                except ValueError as error:
                    raise ValueError(f"rule {number}: match.type: {error}") from None
        return self


def type_number(name: str, dialect: str) -> int:
    """Return the number of a message type; ValueError for a name that the dialect has not."""
    known = {cls.PLACE.name: cls.PLACE.msg_type for cls in DIALECTS[dialect].messages}
    if name not in known:
        raise ValueError(f"{name!r} is no message of the {dialect} dialect")
    return known[name]


def load_script(path: Path) -> FaultScript:
    """Read a script; FaultScriptError where it is unreadable, too large, no TOML or no script."""
    try:
        content = beginning_of(path, MAX_SCRIPT + 1)
        if len(content) > MAX_SCRIPT:
            raise FaultScriptError(f"{path}: is larger than {MAX_SCRIPT} bytes")
        data = toml_of(content)
    except OSError as error:
        raise FaultScriptError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, or nested without end
        raise FaultScriptError(f"{path}: is no TOML: {error}") from None
    return make_script(data, str(path))


def make_script(data: dict[str, Any], source: str) -> FaultScript:
    """Return a script of plain data; FaultScriptError names the first thing that is wrong."""
    try:
        return FaultScript.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise FaultScriptError(f"{source}: {_in_one_line(dict(first))}") from None


def _in_one_line(error: dict[str, Any]) -> str:
    location = [str(part) for part in error["loc"]]
    where = ""
    known = list(FaultScript.model_fields)
    if location[:1] == ["rule"] and len(location) > 1:
        where, location = f"rule {int(location[1]) + 1}: ", location[2:]
        known = ["fault, one of: " + ", ".join(RULE_CLASSES)]
        if location and location[0] in RULE_CLASSES:
            fields = RULE_CLASSES[location[0]].model_fields
            known = list(Match.model_fields) if location[1:2] == ["match"] else list(fields)
            location = location[1:]
    key = ".".join(location)
    match error["type"]:
        case "extra_forbidden":
            problem = f"unknown key; known here: {', '.join(known)}"
        case "missing":
            problem = "is missing"
        case "union_tag_not_found" | "union_tag_invalid":
            key, problem = "fault", f"expected one of {', '.join(RULE_CLASSES)}"
        case "value_error":
            problem = str(error["ctx"]["error"])
        case _:
            problem = f"{error['msg']}; got {str(error['input'])[:60]!r}"
    return f"{where}{key}: {problem}" if key else f"{where}{problem}"
