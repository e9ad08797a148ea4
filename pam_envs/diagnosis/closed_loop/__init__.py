"""closed_loop."""
