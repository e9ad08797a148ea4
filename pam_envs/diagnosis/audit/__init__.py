"""Audit of recordings and tables, and their noise floor."""
