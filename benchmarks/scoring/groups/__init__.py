"""Metric groups of the plants' families; every ``Group`` in a module here is found by its name."""
