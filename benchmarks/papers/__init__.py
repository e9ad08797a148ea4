"""Published figures of the papers beside ours."""
