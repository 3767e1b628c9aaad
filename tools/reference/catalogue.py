"""The catalogue of codes, messages and operations as one file of JSON, an entry a line."""

from __future__ import annotations

import json

from openpendant.simplemsg.pendant import PROTOCOL_VERSION
from openpendant.simplemsg.pendant.catalogue import PARTS, entries

from .messages import NOTICE


def catalogue_file() -> str:
    """Return the text of the file."""
    parts = ",\n".join(f'"{part}": [\n' + ",\n".join(entries(part)) + "\n]" for part in PARTS)
    return f'{{"$comment": {json.dumps(NOTICE)},\n"version": {PROTOCOL_VERSION},\n{parts}}}\n'
