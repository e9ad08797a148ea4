"""Design of the next experiment."""
