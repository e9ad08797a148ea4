"""Learning: the batched environment for stable-baselines3, training, and policies as data."""
