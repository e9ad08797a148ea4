"""Search over causes, their comparison and the verdict."""
