"""redundant_manipulator."""
