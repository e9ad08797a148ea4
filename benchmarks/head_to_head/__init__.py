"""Comparison of the diagnosis with ``mujoco.sysid`` on a mass-spring-damper."""
