"""Step, single environment, batch and arguments of every family of environments."""
