"""Comparison of predicted with measured closed-loop figures of a rig."""
