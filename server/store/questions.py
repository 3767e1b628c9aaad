"""How a core asks the store: a request, and what is to be done with its answer.

The core's shell has requests answered by the store's thread; the answer comes back as one more
event with its time, on which what was to be done is done.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from ..outgoing import Outgoing
from .requests import Answer, Request

Then: TypeAlias = Callable[[Answer, int], list[Outgoing]]
"""Takes an answer and the time [ns]; returns what follows."""

AskStore: TypeAlias = Callable[[Request, Then], list[Outgoing]]
"""Has a request answered; returns what the shell has to carry out for it."""
