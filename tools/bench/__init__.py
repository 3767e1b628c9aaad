"""Benchmarks: measured costs beside a baseline of the least possible cost."""
