"""Batches of environments on a GPU, or on the processor in its place."""
