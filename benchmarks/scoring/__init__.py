"""Metrics of an episode and statistics over episodes."""
