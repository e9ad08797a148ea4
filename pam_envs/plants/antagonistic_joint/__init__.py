"""antagonistic_joint."""
