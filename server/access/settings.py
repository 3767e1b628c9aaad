"""What a cell's configuration file may say of access: the table `[access]`."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class AccessSettings(BaseModel):
    """Who may look on, how long a pairing code lasts, and where the audit log is."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    observe_without_login: bool = False
    """Whoever reaches the server may look on; otherwise only this machine may without a login."""
    pairing_minutes: Annotated[float, Field(ge=1, le=24 * 60)] = 15.0
    """How long a pairing code lasts, minutes."""
    audit_log: str = ""
    """File of the audit log, `audit.jsonl`; empty for none on loopback."""
