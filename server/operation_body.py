"""What all management requests of the server's folders have in common.

Must not know any of them; `pendant.management` has the table of all.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class OperationBody(BaseModel):
    """One request; an unknown key is refused, and what stands below a field is published."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)
