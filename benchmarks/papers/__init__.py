"""Published figures of the papers compared with ours."""
