"""Why the store did not do what a recording needed, as a refusal."""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..store.errors import StoreError
from ..store.requests import Answer


def store_refusal(answer: Answer) -> Refusal:
    """Return what is told of an answer that is not the one asked for."""
    if isinstance(answer, StoreError):
        return answer.refusal()
    text = f"the store answered with a {type(answer).__name__}"
    return Refusal(VerdictCode.STORE_FAILED, text)
