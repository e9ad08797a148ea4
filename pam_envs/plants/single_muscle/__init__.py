"""Single muscle that lifts a hanging load."""
