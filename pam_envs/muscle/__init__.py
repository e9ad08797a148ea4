"""Static force laws of pneumatic muscles: force(pressure, contraction)."""
