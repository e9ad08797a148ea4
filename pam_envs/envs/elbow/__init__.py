"""elbow."""
