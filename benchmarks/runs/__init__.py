"""Runs of controllers over scenarios, their rows, and verification."""
