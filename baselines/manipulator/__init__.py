"""Inverse kinematics of the redundant manipulator."""
