"""Scenario files and their environments."""
