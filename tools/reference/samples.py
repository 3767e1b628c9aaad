"""Sample messages, made from the declarations alone, with a distinct value in each field."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntFlag
from typing import Any

from openpendant.simplemsg import Message
from openpendant.simplemsg.declaration import MASK, Array, Field, Int, Real, Reals, Tail, Text

_TAIL = b'{"op": "snapshot"}'
_RECORDS = 2
_LONGEST_REAL = 3.4028234663852886e38
_STEP = 1 / 64


def sample(cls: type[Message]) -> Message:
    """Return a message whose k-th field holds 10 + k (arrays go on in steps of 1/64).

    A field with named values holds the first above 0, a text its field's own name, a secret
    asterisks, because nobody is shown another one, and the second record goes on where the first
    one ended. All reals are exact in four bytes.
    """
    return _with_true_counts(cls(**_Telling().values(cls.FIELDS)))


def zeros(cls: type[Message]) -> Message:
    """Return a message of zeros and empty texts, with as few records as may be."""
    return _with_true_counts(cls(**_Zeros().values(cls.FIELDS)))


def extremes(cls: type[Message]) -> Message:
    """Return a message of the largest numbers, of reals that are none, and of full texts."""
    return _with_true_counts(cls(**_Extremes().values(cls.FIELDS)))


def _with_true_counts(message: Message) -> Message:
    for name, field in message.FIELDS.items():
        if isinstance(field, Array) and field.meant_by:
            setattr(message, field.meant_by, len(getattr(message, name)))
    return message


class _Zeros:
    """Values of fields: zero."""

    def values(self, fields: Mapping[str, Field]) -> dict[str, Any]:
        return {name: self.value(name, field) for name, field in fields.items()}

    def value(self, name: str, field: Field) -> Any:
        match field:
            case Int():
                return self.integer(field)
            case Real():
                return self.reals(1)[0]
            case Reals():
                return self.reals(field.count)
            case Text(secret=True):
                return self.secret()
            case Text():
                return self.text(name, field.size)
            case Tail():
                return self.tail()
            case Array(of=of) if of is not None:
                return tuple(of(**self.values(of.FIELDS)) for _ in range(self.records(field)))
        raise TypeError(f"no sample of a {type(field).__name__}")

    def integer(self, _field: Int) -> int:
        return 0

    def reals(self, count: int) -> tuple[float, ...]:
        return (0.0,) * count

    def text(self, _name: str, _size: int) -> str:
        return ""

    def secret(self) -> str:
        return ""

    def tail(self) -> bytes:
        return b""

    def records(self, field: Array) -> int:
        return field.least


class _Telling(_Zeros):
    """Values that identify their field."""

    def __init__(self) -> None:
        self._number = 10

    def value(self, name: str, field: Field) -> Any:
        if not isinstance(field, Array):
            self._number += 1
        return super().value(name, field)

    def integer(self, field: Int) -> int:
        if field.values is None:
            return self._number
        if issubclass(field.values, IntFlag):
            return sum(list(field.values)[:3])
        return next((int(member) for member in field.values if member > 0), self._number)

    def reals(self, count: int) -> tuple[float, ...]:
        return tuple(self._number + index * _STEP for index in range(count))

    def text(self, name: str, size: int) -> str:
        return name[:size]

    def secret(self) -> str:
        return MASK

    def tail(self) -> bytes:
        return _TAIL

    def records(self, field: Array) -> int:
        return min(max(field.least, _RECORDS), field.most)


class _Extremes(_Zeros):
    """The ends of what a field can hold, in turn."""

    def __init__(self) -> None:
        self._turn = 0

    def integer(self, field: Int) -> int:
        self._turn += 1
        if field.mask is not None:
            return field.mask
        return (2**31 - 1, -(2**31), -1)[self._turn % 3]

    def reals(self, count: int) -> tuple[float, ...]:
        ends = (float("nan"), float("inf"), -float("inf"), -0.0, _LONGEST_REAL, 2.0**-149)
        return tuple(ends[(self._turn + index) % len(ends)] for index in range(count))

    def text(self, _name: str, size: int) -> str:
        return "€" * (size // 3) + "x" * (size % 3)

    def secret(self) -> str:
        return MASK

    def tail(self) -> bytes:
        return '{"op": "größer", "values": [null, true, 1e300]}'.encode()

    def records(self, field: Array) -> int:
        return min(field.most, 4)
