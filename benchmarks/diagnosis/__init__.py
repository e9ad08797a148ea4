"""Benchmark of the diagnosis on simulated rigs with hidden effects, and on measured tables."""
