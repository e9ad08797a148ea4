"""knee_orthosis."""
