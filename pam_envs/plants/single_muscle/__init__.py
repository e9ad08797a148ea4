"""single_muscle."""
