"""Strict JSON from files of unknown origin: bounded, unambiguous, and refused with the place.

Stricter than the standard parser: no key twice, no number that is not finite, no integer too long
to be read as one, and not too deep. Knows nothing of documents.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from .store_errors import BadDocument

DEEPEST = 64
"""Greatest depth of nested brackets."""

_MOST_DIGITS = 19


def parse(text: str, file: str) -> Any:
    """Return the value that a text stands for.

    Raises:
        BadDocument: it is no JSON, or not as strict as is asked here.
    """

    def integer(digits: str) -> int:
        count = len(digits.removeprefix("-"))
        if count > _MOST_DIGITS:
            problem = f"has an integer of {count} digits; accepted: {_MOST_DIGITS}"
            raise BadDocument(file, problem)
        return int(digits)

    def constant(word: str) -> NoReturn:
        raise BadDocument(file, f"has {word}; accepted: finite numbers")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        for key, value in pairs:
            if key in fields:
                raise BadDocument(file, f"has the key {key[:80]!a} twice in one object")
            fields[key] = value
        return fields

    try:
        content = json.loads(
            text, parse_int=integer, parse_constant=constant, object_pairs_hook=once
        )
    except json.JSONDecodeError as error:
        place = f"column {error.colno}"
        raise BadDocument(
            file, f"is not JSON: {error.msg}", line=error.lineno, place=place
        ) from None
    except RecursionError:
        raise BadDocument(file, f"nests too deeply; accepted: {DEEPEST} levels") from None
    _check_values(content, file)
    return content


def _check_values(content: Any, file: str) -> None:
    """Refuse what nests too deeply and reals that are too large to be finite."""
    # Without recursion, and with the place computed only where it is needed: a file may hold
    # millions of values.
    places: list[int | str] = []
    inside: list[Iterator[tuple[int | str, Any]]] = [iter([("", content)])]
    while inside:
        place, value = next(inside[-1], (None, None))
        if place is None:
            inside.pop()
            if places:
                places.pop()
        elif isinstance(value, dict | list):
            places.append(place)
            inside.append(iter(value.items() if isinstance(value, dict) else enumerate(value)))
            if len(inside) > DEEPEST + 1:
                problem = f"nests too deeply; accepted: {DEEPEST} levels"
                raise BadDocument(file, problem, place=_path(places))
        elif isinstance(value, float) and not math.isfinite(value):
            raise BadDocument(file, "the number is too large", place=_path([*places, place]))


def _path(places: Sequence[int | str]) -> str:
    parts = [
        f"[{part}]" if isinstance(part, int) else f".{part[:80]}" for part in places if part != ""
    ]
    return "".join(parts).removeprefix(".")[:400]
