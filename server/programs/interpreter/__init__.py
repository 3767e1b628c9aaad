"""Interpreter: a program run as a pure machine, and the dry run."""
