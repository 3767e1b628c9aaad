"""Benchmarks: what things cost, beside what they would cost at least."""
