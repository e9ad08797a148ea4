"""Controllers of the antagonistic joint, and of each joint of a manipulator."""
