"""Controllers of the elbow orthosis."""
