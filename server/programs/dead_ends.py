"""Statements that lead nowhere: why a run ends at them, and why a dry run refuses them."""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .motion_blocks import MOST_INSTANT_STATEMENTS
from .statement_clauses import statement_text
from .statements import Statement


def flag_not_read(statement: Statement) -> Refusal:
    """Return why a condition on a flag cannot be answered that no input was read into."""
    text = f"{statement_text(statement)!r} asks for a flag that was not read"
    return Refusal(VerdictCode.FLAG_NOT_READ, text)


def going_round() -> Refusal:
    """Return why a run ends that passes statements for ever and none of them takes time."""
    text = f"{MOST_INSTANT_STATEMENTS} statements in a row without motion, wait or input"
    return Refusal(VerdictCode.PROGRAM_STUCK, text, limit=MOST_INSTANT_STATEMENTS)
