"""Plants that can be diagnosed, a module for each kind."""
