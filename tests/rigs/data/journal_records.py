"""Records as a journal's reader finds them."""

import json
from typing import Any

from openpendant.simplemsg.journal import json_parts, spelled


def read_back(record: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads("".join(map(spelled, json_parts(record))))
    return found
