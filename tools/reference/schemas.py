"""JSON Schemas of the management bodies, from the models that check them."""

from __future__ import annotations

import json
from typing import Any, Literal

from pydantic import BaseModel

from openpendant.server.pendant.management import Failure
from openpendant.server.pendant.served_cells import CellsRequest, ServedCells
from openpendant.server.pendant.snapshot import Snapshot, SnapshotRequest
from openpendant.server.why import WhyReply, WhyRequest

from .notice import NOTICE

BODIES: dict[str, type[BaseModel]] = {
    "snapshot-request": SnapshotRequest,
    "snapshot-reply": Snapshot,
    "cells-request": CellsRequest,
    "cells-reply": ServedCells,
    "why-request": WhyRequest,
    "why-reply": WhyReply,
    "failure-reply": Failure,
}
"""Every body of a management message: requests, replies, and the reply to what was refused."""

_MODES: dict[str, Literal["validation", "serialization"]] = {
    "request": "validation",
    "reply": "serialization",
}


def schema_files() -> dict[str, str]:
    """Return every schema: the name of its file and its text."""
    return {f"{name}.json": _schema(name, body) for name, body in BODIES.items()}


def _schema(name: str, body: type[BaseModel]) -> str:
    schema: dict[str, Any] = {
        "$comment": NOTICE.replace("simplemsg/", "server/pendant/management.py"),
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **body.model_json_schema(mode=_MODES[name.rpartition("-")[2]]),
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
