"""Policies as files, and their networks."""
