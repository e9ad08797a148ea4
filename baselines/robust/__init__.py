"""Robust disturbance loops of joints."""
