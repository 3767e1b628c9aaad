"""What all refusals of `motion` have in common.

Owns that a refusal can travel between processes whole. Knows none of the kinds.
"""

from __future__ import annotations

from typing import Any, ClassVar, TypeVar

_Error = TypeVar("_Error", bound="MotionError")


class MotionError(Exception):
    """A motion question that is refused; `code` is its stable name in the error catalogue."""

    code: ClassVar[str] = "motion-error"

    def __reduce__(self) -> tuple[Any, ...]:
        # Refusals travel from the planning process to the server; the default protocol would call
        # the constructor with `args`, which misses what was passed by keyword.
        return _restore, (type(self), dict(self.__dict__))


def _restore(kind: type[_Error], attributes: dict[str, Any]) -> _Error:
    error = kind.__new__(kind)
    error.__dict__.update(attributes)
    return error
