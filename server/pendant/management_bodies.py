"""What all bodies of management messages have in common, and what is said of one that is wrong.

Must not know any operation.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal

_LONGEST_TEXT = 400
"""A place may be as long as the request, and the answer has to fit a frame [characters]."""


class Body(BaseModel):
    """One JSON object; an unknown key is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def body_fault(error: ValidationError) -> Refusal:
    """Return why the body of a request is refused: the first place that is wrong, and how."""
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    text = f"{where}: {first['msg']}" if where else first["msg"]
    return Refusal(VerdictCode.BAD_ARGUMENT, text[-_LONGEST_TEXT:])
