"""A trajectory together with the proof that it keeps to the limits; plain data."""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.motion.certificate import Certificate
from openpendant.motion.ptp import StraightMove
from openpendant.motion.straight_certificate import StraightCertificate
from openpendant.motion.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class Certified:
    """A motion that may be played.

    Attributes:
        trajectory: the samples, or the few numbers that say all of them.
        certificate: what the independent checker found; kept for the record.
    """

    trajectory: Trajectory | StraightMove
    certificate: Certificate | StraightCertificate
