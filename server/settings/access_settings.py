"""Access in a cell's configuration file: the tables `[access]` and `[tls]`."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator


class AccessSettings(BaseModel):
    """Who may look on, how long a pairing code lasts, and where the audit log is."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    observe_without_login: bool = False
    """Whoever reaches the server may look on; otherwise only this machine may without a login."""
    pairing_minutes: Annotated[float, Field(ge=1, le=24 * 60)] = 15.0
    """How long a pairing code lasts, minutes."""
    audit_log: str = ""
    """File of the audit log, `audit.jsonl`; empty for none on loopback."""


class TlsSettings(BaseModel):
    """The server's certificate, and whose certificates it asks for."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    certificate: str = ""
    """File with the certificate and the ones that signed it (PEM); empty for no TLS."""
    key: str = ""
    """File with its private key (PEM, not encrypted, readable by its owner)."""
    ca: str = ""
    """File with the authorities whose client certificates are taken (PEM); empty for none asked."""

    @model_validator(mode="after")
    def _is_whole(self) -> TlsSettings:
        if bool(self.certificate) != bool(self.key):
            raise ValueError("certificate and key are given together, or neither")
        if self.ca and not self.certificate:
            raise ValueError("ca needs certificate and key")
        return self

    @property
    def is_on(self) -> bool:
        """True if connections are encrypted."""
        return bool(self.certificate)
