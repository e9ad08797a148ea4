"""elbow_orthosis."""
