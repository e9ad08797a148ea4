"""Pressure supply: proportional regulators and valves."""
