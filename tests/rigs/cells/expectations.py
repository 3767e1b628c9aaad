"""What a test expects a value to be before it looks at it: of a kind, there, alone, a refusal."""

from collections.abc import Iterable
from typing import TypeVar

from openpendant.server.refusal import Refusal

_T = TypeVar("_T")


def expect(kind: type[_T], value: object) -> _T:
    assert isinstance(value, kind), value
    return value


def only(kind: type[_T], values: Iterable[object]) -> _T:
    """Return the one value that there is."""
    (value,) = values
    return expect(kind, value)


def known(value: _T | None) -> _T:
    assert value is not None
    return value


def refusal_from(answer: object) -> Refusal:
    return expect(Refusal, answer)
