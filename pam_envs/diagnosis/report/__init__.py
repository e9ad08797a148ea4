"""Report of a diagnosis: its content, page and files."""
