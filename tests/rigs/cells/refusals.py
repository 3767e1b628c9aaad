"""The refusal in an answer that may be one."""

from __future__ import annotations

from openpendant.server.refusal import Refusal


def refusal_from(answer: object) -> Refusal:
    assert isinstance(answer, Refusal), answer
    return answer
