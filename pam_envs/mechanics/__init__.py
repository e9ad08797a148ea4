"""Mechanics of loads, levers, joints and chains."""
