"""Plants: regulators, muscles with memory, loads and sensors, composed."""
