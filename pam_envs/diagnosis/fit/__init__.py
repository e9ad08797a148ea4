"""Fits of plants by simulation."""
