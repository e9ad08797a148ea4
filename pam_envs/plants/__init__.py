"""Plants: regulators, muscles with hysteresis, loads and sensors, composed."""
