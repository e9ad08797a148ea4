"""Settings of a training: schema, presets and seeds."""
