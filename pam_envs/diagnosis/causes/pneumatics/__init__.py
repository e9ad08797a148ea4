"""pneumatics."""
