"""Playground: environments and controllers in one web page, and the same runs in Python."""
