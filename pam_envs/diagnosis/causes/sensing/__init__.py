"""Causes in the sensors."""
