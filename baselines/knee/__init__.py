"""knee."""
