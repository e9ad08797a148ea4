"""Real-time environment around a rig: the signals and controllers of a simulated environment."""
