"""Timing: time-optimal parameterization (TOPP-RA), its limits, velocity profiles."""
