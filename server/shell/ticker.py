"""When the next control tick is due: the rule for ticks that come late.

Deadlines are absolute, so that lateness does not add up. A tick that took a little longer than a
period delays the next one by that little, and not by a whole period; what lies further back is not
made up for, because set-points of the past are of no use to a robot.
"""

from __future__ import annotations


def next_deadline(last: float, now: float, period: float) -> tuple[float, int]:
    """Return when the next tick is due, and how many before it are left out.

    Args:
        last: when the last tick was due [s].
        now: the time after it [s].
        period: between two ticks [s].

    Returns:
        The latest deadline that has passed since, or else the next to come [s]; and the number of
        deadlines passed before that one.
    """
    left_out = max(0, int((now - last) / period) - 1)
    return last + (left_out + 1) * period, left_out
