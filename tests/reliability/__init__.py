"""Attacks on files, states, rows, caches and long commands, with counts of what passed."""
