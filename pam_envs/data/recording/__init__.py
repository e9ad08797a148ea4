"""Recordings of rigs: columns, clock, segments."""
