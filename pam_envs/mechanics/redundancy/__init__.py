"""Redundancy resolution of a serial chain: joint angles for poses, away from their limits."""
