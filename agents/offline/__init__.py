"""Offline learning from data sets in the format of Minari: behaviour cloning, implicit Q-learning."""
