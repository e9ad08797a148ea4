"""Reference trajectories r(t), seeded, with preview."""
