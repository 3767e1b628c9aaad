"""What all bodies of management messages have in common, and what is said of one that is wrong.

Must not know any operation.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..field_fault import field_fault
from ..refusal import Refusal

_LONGEST_TEXT = 400
"""A place may be as long as the request, and the answer has to fit a frame [characters]."""


class Body(BaseModel):
    """One JSON object; an unknown key is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def body_fault(error: ValidationError) -> Refusal:
    """Return why the body of a request is refused: the first place that is wrong, and how."""
    return Refusal(VerdictCode.BAD_ARGUMENT, field_fault(error)[-_LONGEST_TEXT:])
