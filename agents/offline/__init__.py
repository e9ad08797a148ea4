"""Offline learning from data sets in Minari's format: behaviour cloning, implicit Q-learning."""
