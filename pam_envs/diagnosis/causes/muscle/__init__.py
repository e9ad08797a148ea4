"""Causes in the muscle."""
