"""Antagonistic joint: a link between two pneumatic muscles."""
