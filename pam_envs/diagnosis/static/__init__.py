"""Diagnosis of tables of settled readings."""
