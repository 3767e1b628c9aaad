"""What of a dry run's findings is told: as much as fits the answer to a pendant.

Owns the cut. It is made in the planning process, because the findings about a long program have
more parts than an event loop should read.
"""

from __future__ import annotations

from dataclasses import replace

from ..programs.dry_run_results import DryRun, ToolSample
from .jobs import DryRunFound

MOST_VERDICTS = 100
"""Verdicts in an answer, those that refuse first."""

MOST_SAMPLES = 250
"""Samples of the tool's way in an answer."""


def shortened(found: DryRunFound) -> DryRunFound:
    """Return the findings cut to what is told; `refused` still counts all."""
    run = found.run
    moves = sorted(run.moves, key=lambda verdict: verdict.refusal is None)
    points = sorted(found.points, key=lambda verdict: verdict.refusal is None)
    told = replace(
        run,
        path=_thinned(run),
        moves=tuple(moves[:MOST_VERDICTS]),
        not_walked=run.not_walked[:MOST_VERDICTS],
        hand_overs=tuple(
            sorted(run.hand_overs, key=lambda verdict: verdict.refusal is None)[:MOST_VERDICTS]
        ),
    )
    refused = len(run.refusals) + sum(verdict.refusal is not None for verdict in points)
    return DryRunFound(told, tuple(points[:MOST_VERDICTS]), refused)


def _thinned(run: DryRun) -> tuple[ToolSample, ...]:
    """Return some samples of the tool's way, its end among them."""
    every = -(-len(run.path) // MOST_SAMPLES) or 1
    chosen = run.path[::every]
    if run.path and chosen[-1] != run.path[-1]:
        chosen = (*chosen, run.path[-1])
    return chosen
