"""What is said of data from outside whose fields are not as they must be.

Names the place and the rule, never the value that stood there: it may be a secret.
"""

from __future__ import annotations

from pydantic import ValidationError


def field_fault(error: ValidationError) -> str:
    """Return the first place that is wrong, and how, as one sentence."""
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    return f"{where}: {first['msg']}" if where else first["msg"]
