"""Tables of calls that are refused: a row for each, with its error and words of its sentence."""

from collections.abc import Callable
from typing import NamedTuple

import pytest


class Refusal(NamedTuple):
    """A call, the error that it must raise, and a pattern that the error's sentence must have."""

    ask: Callable[[], object]
    error: type[Exception] | tuple[type[Exception], ...]
    words: str = ""

    def check(self) -> None:
        with pytest.raises(self.error, match=self.words or None):
            self.ask()


def refusals(
    *rows: tuple[str, Callable[[], object], type[Exception] | tuple[type[Exception], ...], str],
) -> pytest.MarkDecorator:
    """Give a test one `refusal` after the other, each by its id, the first of its row."""
    table = [pytest.param(Refusal(*row[1:]), id=row[0]) for row in rows]
    return pytest.mark.parametrize("refusal", table)
