"""Physical constants in SI units: one value of each for every plant, environment and test."""

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s2]."""
ATMOSPHERE = 101325.0
"""Standard atmospheric pressure [Pa]."""
GAS_CONSTANT = 287.05
"""Specific gas constant of dry air [J/(kg K)]."""
CELSIUS = 273.15
"""Temperature [K] of 0 degrees C."""
ROOM_TEMPERATURE = 293.15
"""Reference temperature [K] of air and muscles: 20 degrees C."""
PRESSURE_PER_DENSITY = GAS_CONSTANT * ROOM_TEMPERATURE
"""Absolute pressure over density of air at 20 degrees C [J/kg]."""
DENSITY_PER_PRESSURE = 1.0 / PRESSURE_PER_DENSITY
"""Density over absolute pressure of air at 20 degrees C [kg/(m3 Pa)]."""
REFERENCE_DENSITY = 1.185
"""Density [kg/m3] of air in the reference state of ISO 8778: 20 degrees C and 1 bar."""
BAR, MM = 1e5, 1e-3
"""Bar [Pa] and millimetre [m], the units of files and messages."""
