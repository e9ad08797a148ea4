"""Causes in guide, mount, wire and payload."""
