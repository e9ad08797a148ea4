"""Classical controllers, built from a nominal plant and the named signals of an environment."""
