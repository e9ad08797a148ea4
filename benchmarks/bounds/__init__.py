"""Bounds on the error that any controller can reach in a track."""
