"""Iterative learning and repetitive control."""
