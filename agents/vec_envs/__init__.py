"""Environments for stable-baselines3: batch, mixture, history, residual."""
