"""manipulator."""
