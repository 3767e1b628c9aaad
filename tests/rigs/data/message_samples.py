"""One sample of every declared message. Reals are exact in four bytes, arrays tell slots apart."""

from openpendant.simplemsg import MOTOMAN, PENDANT, STANDARD, Message
from openpendant.tools.reference.samples import sample

_SHARED = set(STANDARD.messages)

# A message that all dialects share is tried in the first of them.
DECLARED: dict[str, type[Message]] = {
    f"{dialect.name}:{cls.__name__}": cls
    for dialect in (STANDARD, MOTOMAN, PENDANT)
    for cls in dialect.messages
    if dialect is STANDARD or cls not in _SHARED
}

SAMPLES: dict[type[Message], Message] = {cls: sample(cls) for cls in DECLARED.values()}
