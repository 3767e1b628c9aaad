"""Replies that operations of several topics have in common."""

from __future__ import annotations

from typing import TypedDict


class Done(TypedDict):
    """Nothing more is told: it is done."""


class Changed(TypedDict):
    """The revision to make the next change from.

    Attributes:
        revision: the one that is kept now: make the next change from it.
    """

    revision: int
