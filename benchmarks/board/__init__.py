"""Leaderboard, its pages and the interactive site, computed from the rows."""
