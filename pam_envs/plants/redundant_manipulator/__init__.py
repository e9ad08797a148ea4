"""Redundant manipulator: an arm of antagonistic joints."""
