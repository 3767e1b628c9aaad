"""The page of the error catalogue: every code with its name, cause and remedy."""

from __future__ import annotations

from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

from .notice import NOTICE

_OPENING = """# Errors, and what to do about them

Every refusal and every aborted motion carries one of these codes, beside a sentence with the
numbers of the case: joint, value, limit. A code is never reused for something else. Link to one as
`errors.md#code-NUMBER`. What keeps a robot from moving right now, `openpendant why` tells.
"""


def error_page() -> str:
    """Return the page as Markdown."""
    parts = [f"<!-- {NOTICE} -->", "", _OPENING]
    for code in sorted(set(VerdictCode) - {VerdictCode.ACCEPTED}):
        entry = CATALOGUE[code]
        parts += [
            f'<a id="code-{code.value}"></a>',
            f"## {code.value} {code.name}",
            "",
            f"**Cause.** {entry.cause}",
            "",
            f"**Remedy.** {entry.remedy}",
            "",
        ]
    return "\n".join(parts)
