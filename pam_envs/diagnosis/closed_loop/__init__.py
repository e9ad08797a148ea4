"""Comparison of controllers before and after the extension of a plant."""
