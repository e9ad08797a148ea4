"""Parts of every plant: files, rollout, replay, stepper, linear model."""
