"""Controllers of the single muscle."""
