"""Causes in regulator, valve and supply."""
