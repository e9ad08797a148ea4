"""Linear control design: SIMC, loop transfer recovery, bumpless transfer, reduction."""
