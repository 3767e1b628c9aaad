"""Search budget of inverse kinematics: restarts, iterations and an outer limit of time.

Owns the numbers and their ranges. Effort is counted in restarts and iterations, so that the same
query gets the same answer on any machine; knows no clock.
"""

from __future__ import annotations

from typing import NamedTuple

from ...errors import BadArgument


class Budget(NamedTuple):
    """Restarts, iterations of each attempt, and the greatest duration of a search [s]."""

    restarts: int
    iterations: int
    random_seed: int
    time_cap: float | None

    def check(self) -> None:
        """Refuse numbers out of range.

        Raises:
            BadArgument: with the name of the number.
        """
        if self.restarts < 0:
            raise BadArgument("restarts", self.restarts, "0 or more")
        if self.iterations < 1:
            raise BadArgument("iterations", self.iterations, "1 or more")
        if self.random_seed < 0:
            raise BadArgument("random_seed", self.random_seed, "0 or more")
        if self.time_cap is not None and not self.time_cap >= 0.0:
            raise BadArgument("time_cap", self.time_cap, "0 or more, or None")
