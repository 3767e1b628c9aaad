"""What all bodies of management messages have in common."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Body(BaseModel):
    """One JSON object; an unknown key is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)
