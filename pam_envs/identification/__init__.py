"""Identification of models from measurements, with their identifiability."""
