"""Measured tables and identified plants that the library ships, see ``PROVENANCE.md``."""
