"""Elbow orthosis with two antagonistic bundles of muscles."""
