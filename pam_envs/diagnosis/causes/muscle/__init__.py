"""muscle."""
