"""Scores of every controller over fixed scenarios; the commands are in ``python -m benchmarks``."""
