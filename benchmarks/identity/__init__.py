"""Identity of tasks and controllers by behaviour, and audit rounds."""
