"""What a simulation gets wrong of a rig, why, and the better model."""
